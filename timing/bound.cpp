#include "timing/bound.h"

#include <algorithm>

#include "base/check.h"
#include "base/parallel.h"

namespace tessera::timing {
namespace {

using hardware::Machine;
using hardware::Stage;

void double_stage(Machine& gpu, Stage stage) {
  hardware::Throughputs& rates = gpu.rates;
  switch (stage) {
    case Stage::kFrontend:
      rates.bounds_per_clk *= 2, gpu.reprojection.reprojected_blocks_per_clk *= 2;
      gpu.reprojection.depth_tests_per_clk *= 2;
      break;
    case Stage::kBinner:
      rates.binned_entries_per_clk *= 2, rates.binned_tiles_per_clk *= 2;
      gpu.signatures.input_bytes_per_clk *= 2;
      break;
    case Stage::kFetch:
      rates.fetched_entries_per_clk *= 2, rates.sort_steps_per_clk *= 2;
      break;
    case Stage::kTessellator:
      rates.vertices_per_clk *= 2, rates.transforms_per_clk *= 2;
      break;
    case Stage::kBoxes:
      rates.boxes_per_clk *= 2;
      break;
    case Stage::kBoxTests:
      rates.box_tests_per_clk *= 2;
      break;
    case Stage::kStencil:
      rates.stencil_tests_per_clk *= 2;
      break;
    case Stage::kSampling:
      rates.sampling_operations_per_clk *= 2;
      break;
    case Stage::kTriangleTests:
      rates.triangle_tests_per_clk *= 2;
      break;
    case Stage::kAlphaTests:
      rates.alpha_tests_per_clk *= 2;
      break;
    case Stage::kCoarseDepth:
      rates.depth_blocks_per_clk *= 2;
      break;
    case Stage::kCompaction:
      rates.compacted_samples_per_clk *= 2;
      break;
    case Stage::kShader:
      gpu.shader.lanes *= 2;
      break;
    case Stage::kTexture:
      rates.texels_per_clk *= 2;
      break;
    case Stage::kBlend:
      rates.blends_per_clk *= 2;
      break;
    case Stage::kResolve:
      rates.resolved_pixels_per_clk *= 2, rates.resolve_operations_per_clk *= 2;
      gpu.signatures.color_bytes_per_clk *= 2;
      break;
    case Stage::kDram:
      gpu.memory.gb_per_s *= 2, gpu.memory.channels *= 2;
      break;
  }
}

}  // namespace

Machine doubled(const Machine& gpu, Bound bound) {
  Machine more = gpu;
  if (index(bound) < hardware::kStageCount) {
    double_stage(more, static_cast<Stage>(bound));
    return more;
  }
  switch (bound) {
    case Bound::kLatency:
      more.memory.latency_ns /= 2, more.queues.texture_latency_clk /= 2, more.queues.l2_latency_clk /= 2;
      more.queues.items *= 2, more.queues.fetched_lines *= 2, more.queues.table_lines *= 2,
          more.queues.store_bytes *= 2;
      more.queues.texture_requests *= 2, more.queues.l2_requests *= 2;
      more.queues.max_warps *= 2, more.queues.register_bytes *= 2;
      break;
    case Bound::kL2:
      more.queues.l2_lines_per_clk *= 2;
      break;
    case Bound::kCaches:
      more.caches.l2_bytes *= 2, more.caches.texture_bytes *= 2;
      break;
    case Bound::kTileMemory:
      more.cores.memory_bytes *= 2;
      break;
    case Bound::kGeometry:
      double_stage(more, Stage::kFrontend);
      double_stage(more, Stage::kBinner);
      break;
    case Bound::kTileCores:
      more.cores.count *= 2;
      break;
    case Bound::kImbalance:
      TESSERA_CHECK(false, "imbalance is no number of the machine");
  }
  return more;
}

BoundGain find_bound(double cycles, std::vector<BoundGuess> guesses, double imbalance,
                     const std::function<double(Bound)>& with_twice) {
  std::stable_sort(guesses.begin(), guesses.end(),
                   [](const BoundGuess& a, const BoundGuess& b) { return a.most > b.most; });
  // Two at a time, on however many threads: which are simulated must not depend on it.
  constexpr std::size_t kAtOnce = 2;
  std::vector<BoundGain> gains = {{Bound::kImbalance, imbalance}};
  double best = imbalance;
  for (std::size_t next = 0; next < guesses.size() && guesses[next].most > kNearlyBest * best; next += kAtOnce) {
    const std::size_t count = std::min(kAtOnce, guesses.size() - next), first = gains.size();
    gains.resize(first + count);
    parallel_for(count, [&](std::size_t k) {
      const Bound bound = guesses[next + k].bound;
      gains[first + k] = {bound, std::max(0.0, cycles - with_twice(bound))};
    });
    for (std::size_t k = first; k < gains.size(); ++k) best = std::max(best, gains[k].cycles);
  }
  std::stable_sort(gains.begin(), gains.end(),
                   [](const BoundGain& a, const BoundGain& b) { return index(a.bound) < index(b.bound); });
  return *std::find_if(gains.begin(), gains.end(), [&](const BoundGain& g) { return g.cycles >= best * kNearlyBest; });
}

}  // namespace tessera::timing

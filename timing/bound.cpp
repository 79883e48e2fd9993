#include "timing/bound.h"

#include <algorithm>

#include "base/check.h"
#include "base/parallel.h"

namespace tessera::timing {
namespace {

using hardware::Machine;
using hardware::Stage;

void double_stage(Machine& gpu, Stage stage) {
  for (const hardware::Event event : hardware::kAllEvents)
    if (hardware::kEventTable[event].unit == stage) gpu.rates[event] *= 2;
  if (stage == Stage::kShader) gpu.shader.lanes *= 2;
  if (stage == Stage::kDram) gpu.memory.gb_per_s *= 2, gpu.memory.channels *= 2;
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
                     const std::function<double(Bound, double limit)>& with_twice) {
  const auto by_bound = [](const auto& a, const auto& b) { return index(a.bound) < index(b.bound); };
  std::stable_sort(guesses.begin(), guesses.end(), by_bound);
  std::vector<BoundGain> gains = {{Bound::kImbalance, imbalance}};
  while (true) {
    double best = 0;
    for (const BoundGain& gain : gains) best = std::max(best, gain.cycles);
    const BoundGain named =
        *std::find_if(gains.begin(), gains.end(), [&](const BoundGain& g) { return g.cycles >= best * kNearlyBest; });
    // Candidates that may replace `named`: a more specific one if it gains nearly the best, a less specific one if it gains much more.
    const auto may_be = [&](const BoundGuess& guess) {
      return by_bound(guess, named) ? guess.most > 0 && guess.most >= best * kNearlyBest
                                    : guess.most * kNearlyBest > named.cycles;
    };
    std::vector<BoundGuess> open;
    double most = best;
    for (const BoundGuess& guess : guesses)
      if (may_be(guess)) open.push_back(guess), most = std::max(most, guess.most);
    if (open.empty()) return named;
    // The first round simulates one candidate, which may suffice; later rounds two, on any number of threads. The
    // choice of candidates must not depend on that number.
    std::stable_partition(open.begin(), open.end(), [&](const BoundGuess& g) { return g.most >= most * kNearlyBest; });
    open.resize(std::min<std::size_t>(gains.size() == 1 ? 1 : 2, open.size()));
    // A candidate that gains less than this cannot be chosen: less than nearly the best, or than a more specific one.
    const auto least = [&](const BoundGuess& guess) {
      return by_bound(guess, named) ? best * kNearlyBest : named.cycles;
    };
    std::vector<double> found(open.size());
    parallel_for(open.size(), [&](std::size_t k) {
      found[k] = std::max(0.0, cycles - with_twice(open[k].bound, cycles - least(open[k])));
    });
    for (std::size_t k = 0; k < open.size(); ++k) {
      std::erase_if(guesses, [&](const BoundGuess& g) { return g.bound == open[k].bound; });
      if (found[k] > 0 && found[k] >= least(open[k])) gains.push_back({open[k].bound, found[k]});
    }
    std::stable_sort(gains.begin(), gains.end(), by_bound);
  }
}

}  // namespace tessera::timing

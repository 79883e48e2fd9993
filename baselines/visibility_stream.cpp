#include "baselines/visibility_stream.h"

#include <algorithm>
#include <cstdlib>

#include "base/bit_stream.h"
#include "base/round_up.h"

namespace tessera::baselines {
namespace {

constexpr int kBinStep = 32;

int stepped(int pixels) {
  return static_cast<int>(round_up(static_cast<std::uint64_t>(std::max(pixels, 1)), kBinStep));
}

}  // namespace

BinSize bin_size(const IntRect& region, int samples_per_pixel, std::uint64_t gmem_bytes, std::uint64_t sample_bytes) {
  const std::uint64_t step_bytes =
      std::uint64_t{kBinStep} * kBinStep * static_cast<std::uint64_t>(samples_per_pixel) * sample_bytes;
  const auto steps =
      static_cast<int>(std::min<std::uint64_t>(std::max<std::uint64_t>(gmem_bytes / step_bytes, 1), 1 << 20));
  const int wide = stepped(region.width()) / kBinStep, high = stepped(region.height()) / kBinStep;
  BinSize best{kBinStep, kBinStep};
  long fewest = 0;
  for (int w = 1; w <= std::min(wide, steps); ++w) {
    const int h = std::min(steps / w, high);
    const long bins = static_cast<long>((wide + w - 1) / w) * ((high + h - 1) / h);
    const bool squarer = std::abs(w - h) < std::abs(best.width - best.height) / kBinStep;
    if (fewest == 0 || bins < fewest || (bins == fewest && squarer)) best = {w * kBinStep, h * kBinStep}, fewest = bins;
  }
  return best;
}

void VisibilityStreamBinner::put_run(binner::TileIndex bin) {
  Stream& stream = bins_[bin];
  if (stream.begin == stream.end) return;
  std::vector<std::uint8_t> bytes;
  put_number(stream.begin - stream.coded, bytes);
  put_number(stream.end - stream.begin, bytes);
  stream.coded = stream.end;
  lists_.append(bin, bytes);
  ++lists_.counters().entries;
}

void VisibilityStreamBinner::add(const TessellatedPatch& patch, const TriangleList& list) {
  lists_.reshading().add(patch, list);
  std::size_t tile = 0;
  for (const TriangleList::Triangle& t : list.triangles) {
    const std::uint64_t number = triangles_ + t.number;
    for (; tile < t.tiles_end; ++tile) {
      Stream& stream = bins_[list.tiles[tile]];
      if (stream.end != number || stream.begin == stream.end) {
        put_run(list.tiles[tile]);
        stream.begin = number;
      }
      stream.end = number + 1;
    }
  }
  triangles_ += patch.triangles.size();
}

void VisibilityStreamBinner::finish(std::span<const std::uint64_t> state_bytes) {
  for (std::size_t bin = 0; bin < bins_.size(); ++bin) put_run(static_cast<binner::TileIndex>(bin));
  lists_.finish(state_bytes);
}

std::unique_ptr<Scheme> make_visibility_stream() {
  return std::make_unique<ReferenceScheme<VisibilityStreamBinner, true, false>>();
}

}  // namespace tessera::baselines

#include "tilecore/visibility/stencil.h"

#include <utility>

namespace tessera::tilecore {
namespace {

// Calls row(first, last) with the natural numbers of each row of samples.
template <class Row>
void for_each_row(const TileSamples& samples, const IntRect& pixels, const Row& row) {
  const auto spp = static_cast<std::uint32_t>(samples.spp);
  for (int y = pixels.y0; y < pixels.y1; ++y) {
    const auto start = static_cast<std::uint32_t>((y - samples.pixels.y0) * samples.pixels.width());
    row((start + static_cast<std::uint32_t>(pixels.x0 - samples.pixels.x0)) * spp,
        (start + static_cast<std::uint32_t>(pixels.x1 - samples.pixels.x0)) * spp);
  }
}

}  // namespace

void StencilUnit::keep(const TileSamples& samples, const IntRect& pixels, const StencilReferences& references,
                       std::vector<std::uint32_t>& kept) {
  const std::size_t tests = static_cast<std::size_t>(pixels.width()) * static_cast<std::size_t>(pixels.height()) *
                            static_cast<std::size_t>(samples.spp);
  kept.resize(tests);
  std::size_t count = 0, count_before = 0;  // kept so far, and before the current group of lanes
  std::uint32_t lane = 0;
  for_each_row(samples, pixels, [&](std::uint32_t first, std::uint32_t last) {
    for (std::uint32_t i = first; i < last; ++i) {
      kept[count] = i;
      count += references.keeps(samples.stencil(i)) ? 1 : 0;
      if (++lane < kLanes) continue;
      counters_.lanes_issued += count > count_before ? kLanes : 0;
      count_before = count;
      lane = 0;
    }
  });
  counters_.lanes_issued += count > count_before ? kLanes : 0;
  counters_.tests += tests;
  counters_.kept += count;
  kept.resize(count);
}

StencilCounters StencilUnit::take_counters() { return std::exchange(counters_, {}); }

void all_samples(const TileSamples& samples, const IntRect& pixels, std::vector<std::uint32_t>& out) {
  out.clear();
  for_each_row(samples, pixels, [&](std::uint32_t first, std::uint32_t last) {
    for (std::uint32_t i = first; i < last; ++i) out.push_back(i);
  });
}

}  // namespace tessera::tilecore

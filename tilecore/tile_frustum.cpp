#include "tilecore/tile_frustum.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace tessera::tilecore {
namespace {

constexpr std::size_t kMaxBlockColumns = 256 / kBlockSide + 1;  // of the widest tile, not on the blocks' grid

// Keeps of [low, high] the part where a + b * tau <= 0, allowing for an error of `slack` in a and in a + b.
void keep_below(double a, double b, double slack, LeafInterval& interval) {
  const double open = a - slack, close = a + b - slack;  // at tau = 0 and 1
  if (!(open > 0) && !(close > 0)) return;
  if (open > 0 && close > 0) {
    interval.high = -1;  // outside at both ends: never inside
    return;
  }
  const double crossing = open / (open - close);
  if (open > 0) interval.low = std::max(interval.low, crossing);
  else interval.high = std::min(interval.high, crossing);
}

}  // namespace

LeafFrustum::LeafFrustum(const MicroMesh::Leaf& leaf, bool moving, float lens_radius)
    : leaf_(leaf),
      moving_(moving),
      reach_(static_cast<double>(lens_radius) * static_cast<double>(std::max(std::abs(leaf.coc_low), std::abs(leaf.coc_high)))) {}

LeafInterval LeafFrustum::touching(float face_low, float d_low, float face_high, float d_high, int begin, int end) const {
  if (!(face_low <= face_high)) return {1, 0};
  // Samples lie in [begin, end). 2^-20 of the coordinates is 16 roundings of single precision.
  const double size = std::abs(static_cast<double>(face_low)) + std::abs(static_cast<double>(face_high)) + std::abs(static_cast<double>(d_low)) +
                      std::abs(static_cast<double>(d_high)) + std::abs(static_cast<double>(end)) + reach_;
  const double slack = reach_ + size * 0x1p-20;
  LeafInterval interval;
  keep_below(static_cast<double>(face_low) - end, static_cast<double>(d_low), slack, interval);
  keep_below(begin - static_cast<double>(face_high), -static_cast<double>(d_high), slack, interval);
  return interval;
}

TimeRange LeafFrustum::times(const LeafInterval& columns, const LeafInterval& rows) const {
  const double low = std::max(columns.low, rows.low), high = std::min(columns.high, rows.high);
  if (low > high) return {1, 0};
  if (!moving_) return {0, 255};
  // tau = t r / ((1-t) + t r), so t = tau / (tau + r (1 - tau)).
  const double rate = static_cast<double>(leaf_.rate);
  const auto time = [&](double tau) { return tau / (tau + rate * (1 - tau)); };
  TimeRange range;
  range.first = std::max(0, static_cast<int>(std::floor(time(low) * 256)) - 1);
  range.last = std::min(255, static_cast<int>(std::ceil(time(high) * 256)) + 1);
  return range;
}

void touched_samples(const LeafFrustum& frustum, const TileSamples& samples, const TimeRange& within, std::vector<SampleRange>& out) {
  out.clear();
  const auto columns = static_cast<std::size_t>(samples.block_columns);
  std::array<LeafInterval, kMaxBlockColumns> interval;
  for (std::size_t c = 0; c < columns; ++c) interval[c] = frustum.columns(samples.blocks[c].pixels.x0, samples.blocks[c].pixels.x1);
  for (std::size_t first = 0; first < samples.blocks.size(); first += columns) {
    const LeafInterval row = frustum.rows(samples.blocks[first].pixels.y0, samples.blocks[first].pixels.y1);
    if (row.empty()) continue;
    for (std::size_t c = 0; c < columns; ++c) {
      if (interval[c].empty()) continue;
      const TimeRange times = frustum.times(interval[c], row).intersect(within);
      if (times.empty()) continue;
      const TileSamples::Block& block = samples.blocks[first + c];
      const std::uint32_t begin = block.first_at[static_cast<std::size_t>(times.first)], end = block.first_at[static_cast<std::size_t>(times.last) + 1];
      if (begin < end) out.push_back({&block, begin, end});
    }
  }
}

TimeRange touching_times(const MicroMesh::Leaf& leaf, const IntRect& pixels, bool moving, float lens_radius) {
  const LeafFrustum frustum(leaf, moving, lens_radius);
  return frustum.times(frustum.columns(pixels.x0, pixels.x1), frustum.rows(pixels.y0, pixels.y1));
}

}  // namespace tessera::tilecore

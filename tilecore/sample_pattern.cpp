#include "tilecore/sample_pattern.h"

#include <bit>
#include <cmath>

#include "base/random.h"
#include "tilecore/temporal_pattern.h"

namespace tessera::tilecore {
namespace {

// Square to disc without folding strata.
SamplePattern::LensPoint concentric_disc(float a, float b) {
  const float x = 2.0f * a - 1.0f, y = 2.0f * b - 1.0f;
  if (x == 0.0f && y == 0.0f) return {0.0f, 0.0f};
  constexpr float kQuarterPi = 0.78539816339f;
  float radius, angle;
  if (std::abs(x) > std::abs(y)) {
    radius = x;
    angle = kQuarterPi * (y / x);
  } else {
    radius = y;
    angle = 2.0f * kQuarterPi - kQuarterPi * (x / y);
  }
  return {radius * std::cos(angle), radius * std::sin(angle)};
}

}  // namespace

SamplePattern::SamplePattern(const SamplingSettings& settings)
    : settings_(settings), power_of_two_(std::bit_ceil(static_cast<std::uint32_t>(settings.samples_per_pixel))) {
  const auto n = static_cast<std::uint32_t>(settings.samples_per_pixel);
  const std::uint32_t shift = hash32(settings.seed, settings.frame, 0x7A11u);
  shift_x_ = static_cast<int>(shift & 7);
  shift_y_ = static_cast<int>(shift >> 3 & 7);
  for (std::uint32_t s = 0; s < n; ++s) {
    // Strata centres: 1/(2n) is a multiple of 1/256 for n up to 64.
    const float half = 0.5f / static_cast<float>(power_of_two_);
    const auto digits = [&](std::uint32_t bits) {
      return std::floor(static_cast<float>(bits >> 8) * 0x1p-24f * static_cast<float>(power_of_two_)) / static_cast<float>(power_of_two_);
    };
    offsets_.push_back({digits(reverse_bits32(s)) + half, digits(sobol2_32(s)) + half});
  }
  const std::vector<std::uint16_t> ranks = void_and_cluster_ranks(kBlockSide);
  for (std::uint32_t pixel = 0; pixel < kBlockPixels; ++pixel)
    for (std::uint32_t s = 0; s < n; ++s) {
      // Which of the pixel's n strata a sample gets differs from pixel to pixel, or sub-pixel position and time would
      // be tied together.
      const std::uint32_t scramble = hash32(settings.seed, pixel, 0x57A7u);
      const std::uint32_t stratum = n == power_of_two_ ? s ^ (scramble & (n - 1)) : (s + scramble) % n;
      times_.push_back(static_cast<std::uint8_t>((stratum * kBlockPixels + ranks[pixel]) * 256u / (n * kBlockPixels)));
    }
}

SamplePattern::LensPoint SamplePattern::lens(int x, int y, int sample) const {
  const auto px = static_cast<std::uint32_t>(x), py = static_cast<std::uint32_t>(y);
  const std::uint32_t scramble_u = hash32(settings_.seed ^ 0x1E45u, px, py, settings_.frame);
  const std::uint32_t scramble_v = mix32(scramble_u ^ 0x9E3779B9u), order = mix32(scramble_v ^ 0x85EBCA6Bu);
  // The order of the points is scrambled too: decorrelates lens from time and position.
  const std::uint32_t index = static_cast<std::uint32_t>(sample) ^ (order & (power_of_two_ - 1));
  const float a = static_cast<float>((reverse_bits32(index) ^ scramble_u) >> 8) * 0x1p-24f;
  const float b = static_cast<float>((sobol2_32(index) ^ scramble_v) >> 8) * 0x1p-24f;
  return concentric_disc(a, b);
}

void TileSamples::fill(const SamplePattern& pattern, IntRect tile, float lens_scale, bool lens, bool sorted) {
  pixels = tile;
  spp = pattern.samples_per_pixel();
  count = static_cast<std::size_t>(tile.width()) * static_cast<std::size_t>(tile.height()) * static_cast<std::size_t>(spp);
  x.resize(count + kPadding);
  y.resize(count + kPadding);
  time.resize(count);
  lens_u.resize(lens ? count + kPadding : 0);
  lens_v.resize(lens ? count + kPadding : 0);
  std::size_t i = 0;
  for (int py = tile.y0; py < tile.y1; ++py)
    for (int px = tile.x0; px < tile.x1; ++px)
      for (int s = 0; s < spp; ++s, ++i) {
        const SamplePattern::Offset offset = pattern.offset(s);
        x[i] = static_cast<float>(px) + offset.x;
        y[i] = static_cast<float>(py) + offset.y;
        time[i] = pattern.time(px, py, s);
        if (!lens) continue;
        const SamplePattern::LensPoint point = pattern.lens(px, py, s);
        lens_u[i] = point.u * lens_scale;
        lens_v[i] = point.v * lens_scale;
      }
  blocks.clear();
  if (sorted) sort_blocks();
}

void TileSamples::sort_blocks() {
  const IntRect grid = {pixels.x0 / kBlockSide, pixels.y0 / kBlockSide, (pixels.x1 + kBlockSide - 1) / kBlockSide,
                        (pixels.y1 + kBlockSide - 1) / kBlockSide};
  block_columns = grid.width();
  natural.clear();
  for (int row = grid.y0; row < grid.y1; ++row)
    for (int column = grid.x0; column < grid.x1; ++column) {
      Block& block = blocks.emplace_back();
      block.pixels = IntRect{column * kBlockSide, row * kBlockSide, (column + 1) * kBlockSide, (row + 1) * kBlockSide}.intersect(pixels);
      block.first = static_cast<std::uint32_t>(natural.size());
      block.count = static_cast<std::uint32_t>(block.pixels.width() * block.pixels.height() * spp);
      // Counting sort by time; within one time by natural order.
      block.first_at.fill(0);
      const auto each = [&](auto&& visit) {
        for (int py = block.pixels.y0; py < block.pixels.y1; ++py)
          for (int px = block.pixels.x0; px < block.pixels.x1; ++px)
            for (int s = 0; s < spp; ++s)
              visit(static_cast<std::uint32_t>(((py - pixels.y0) * pixels.width() + (px - pixels.x0)) * spp + s));
      };
      each([&](std::uint32_t k) { ++block.first_at[time[k] + 1u]; });
      for (std::size_t t = 1; t <= 256; ++t) block.first_at[t] += block.first_at[t - 1];
      std::array<std::uint32_t, 257> next = block.first_at;
      natural.resize(block.first + block.count);
      each([&](std::uint32_t k) { natural[block.first + next[time[k]]++] = k; });
    }
  const auto gather = [&](const std::vector<float>& from, std::vector<float>& to) {
    to.resize(from.empty() ? 0 : natural.size() + kPadding);
    for (std::size_t k = 0; !from.empty() && k < natural.size(); ++k) to[k] = from[natural[k]];
  };
  gather(x, sorted_x);
  gather(y, sorted_y);
  gather(lens_u, sorted_lens_u);
  gather(lens_v, sorted_lens_v);
  sorted_t.resize(natural.size() + kPadding);
  for (std::size_t k = 0; k < natural.size(); ++k) sorted_t[k] = static_cast<float>(time[natural[k]]) * 0x1p-8f;
}

}  // namespace tessera::tilecore

#include "tilecore/resolve/cubic_stencil.h"

#include <algorithm>
#include <cmath>

#include "tilecore/resolve/cubic_kernel.h"

namespace tessera::tilecore {
namespace {

bool is_finite(const Vec4& c) { return std::isfinite(c.x) && std::isfinite(c.y) && std::isfinite(c.z) && std::isfinite(c.w); }

struct Taps {
  int count = 0;
  std::array<const Vec4*, 100> color;
  std::array<float, 100> weight;
  void add(const Vec4* c, float w) { color[static_cast<std::size_t>(count)] = c, weight[static_cast<std::size_t>(count++)] = w; }
};

Vec4 weighted(const Taps& taps, bool clamp_to_range) {
  std::size_t nearest = 0;
  for (std::size_t i = 1; i < static_cast<std::size_t>(taps.count); ++i)
    if (taps.weight[i] > taps.weight[nearest]) nearest = i;
  const Vec4 base = *taps.color[nearest];
  Vec4 sum(0.0f), low = base, high = base;
  for (std::size_t i = 0; i < static_cast<std::size_t>(taps.count); ++i) {
    sum += taps.weight[i] * (*taps.color[i] - base);
    low = glm::min(low, *taps.color[i]), high = glm::max(high, *taps.color[i]);
  }
  const Vec4 value = base + sum;
  return clamp_to_range ? glm::clamp(value, low, high) : value;
}

}  // namespace

BlockMask reconstruct_block(Reconstruction reconstruction, bool, bool clamp_to_range, const BlockWindow& window, BlockMask missing, Vec4* out16,
                            ReconstructionWork& work) {
  auto usable = window.usable;
  bool any = false;
  for (int y = 0; y < kWindowSide; ++y) {
    auto& row = usable[static_cast<std::size_t>(y)];
    row &= 0x3ff;
    if (y >= 3 && y < 7) row = static_cast<std::uint16_t>(row & ~(((missing >> (4 * (y - 3))) & 15u) << 3));
    for (int x = 0; x < kWindowSide; ++x)
      if ((row >> x & 1) && !is_finite(window.first_pixel[y * window.row_stride + x])) row = static_cast<std::uint16_t>(row & ~(1u << x)), ++work.non_finite_pixels;
    any = any || row != 0;
  }
  if (!any) return missing;
  for (int p = 0; p < 16; ++p) {
    if (!(missing >> p & 1)) continue;
    const int cx = p % 4 + 3, cy = p / 4 + 3;
    Taps taps;
    double sum = 0, magnitude = 0;
    int nearest = 1000;
    for (int y = 0; y < kWindowSide; ++y)
      for (int x = 0; x < kWindowSide; ++x) {
        if (!(usable[static_cast<std::size_t>(y)] >> x & 1)) continue;
        nearest = std::min(nearest, (x - cx) * (x - cx) + (y - cy) * (y - cy));
        const double w = kernel_weight(reconstruction, x - cx) * kernel_weight(reconstruction, y - cy);
        if (w == 0) continue;
        sum += w, magnitude += std::abs(w);
        taps.add(window.first_pixel + y * window.row_stride + x, static_cast<float>(w));
      }
    if (taps.count == 0 || sum < kMinimumDenominator * magnitude) {
      taps.count = 0;
      for (int y = 0; y < kWindowSide; ++y)
        for (int x = 0; x < kWindowSide; ++x)
          if ((usable[static_cast<std::size_t>(y)] >> x & 1) && (x - cx) * (x - cx) + (y - cy) * (y - cy) == nearest)
            if (reconstruction != Reconstruction::kNearest || taps.count == 0) taps.add(window.first_pixel + y * window.row_stride + x, 1);
      sum = taps.count;
      work.fallbacks += reconstruction != Reconstruction::kNearest;
    }
    for (int i = 0; i < taps.count; ++i) taps.weight[static_cast<std::size_t>(i)] /= static_cast<float>(sum);
    out16[p] = weighted(taps, clamp_to_range);
    ++work.pixels, ++work.direct_pixels;
    work.taps += static_cast<std::uint64_t>(taps.count);
  }
  return 0;
}

}  // namespace tessera::tilecore

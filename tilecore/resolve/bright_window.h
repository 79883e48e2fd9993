#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "tilecore/resolve/cubic_stencil.h"

namespace tessera::tilecore {

// A window with light above 1: stencils over it would spread a highlight over its neighbours, and their negative lobes
// would put black beside it. Its colours are filled as c / (1 + c) instead, which is roughly the displayed value, and
// results are clamped to the range of the inputs.
//
// Invariants (cited by the tests):
//   BRW1  No filled pixel is darker than the darkest usable pixel of the window, or brighter than the brightest,
//        channel by channel.
//   BRW2  A window without light above 1 is not touched.
class BrightWindow {
 public:
  // Whether a usable pixel is brighter than 1 in any channel. Channels that are not finite do not count.
  static bool is_bright(const BlockWindow& window) {
    bool bright = false;
    for_each_usable(window, [&](const Vec4& c, std::size_t) {
      const float most = std::max({c.x, c.y, c.z});
      bright = bright || (most > 1.0f && std::isfinite(most));
    });
    return bright;
  }

  explicit BrightWindow(const BlockWindow& window) : window_{colors_.data(), kWindowSide, window.usable} {
    for_each_usable(window, [&](const Vec4& c, std::size_t at) {
      const Vec4 seen = {shown(c.x), shown(c.y), shown(c.z), c.w};
      colors_[at] = seen;
      ++count_;
      if (!std::isfinite(seen.x + seen.y + seen.z + seen.w)) return;
      low_ = {std::min(low_.x, seen.x), std::min(low_.y, seen.y), std::min(low_.z, seen.z), std::min(low_.w, seen.w)};
      high_ = {std::max(high_.x, seen.x), std::max(high_.y, seen.y), std::max(high_.z, seen.z),
               std::max(high_.w, seen.w)};
    });
  }
  BrightWindow(const BrightWindow&) = delete;
  BrightWindow& operator=(const BrightWindow&) = delete;

  const BlockWindow& window() const { return window_; }
  // Number of usable pixels: each took a division.
  std::size_t count() const { return count_; }
  // The light of a pixel that was filled from window().
  Vec4 light(const Vec4& filled) const {
    return {light(std::clamp(filled.x, low_.x, high_.x)), light(std::clamp(filled.y, low_.y, high_.y)),
            light(std::clamp(filled.z, low_.z, high_.z)), std::clamp(filled.w, low_.w, high_.w)};
  }

 private:
  static float shown(float c) { return c > 0.0f ? c / (1.0f + c) : c; }
  static float light(float c) { return c > 0.0f ? c / std::max(1.0f - c, 0x1p-24f) : c; }

  template <class Visit>
  static void for_each_usable(const BlockWindow& window, const Visit& visit) {
    for (std::size_t y = 0; y < kWindowSide; ++y)
      for (unsigned row = window.usable[y] & ((1u << kWindowSide) - 1); row != 0; row &= row - 1) {
        const auto x = static_cast<std::size_t>(std::countr_zero(row));
        visit(window.first_pixel[static_cast<std::ptrdiff_t>(y) * window.row_stride + static_cast<std::ptrdiff_t>(x)],
              y * kWindowSide + x);
      }
  }

  std::array<Vec4, std::size_t{kWindowSide} * kWindowSide> colors_{};
  BlockWindow window_;
  std::size_t count_ = 0;
  Vec4 low_{3e38f}, high_{-3e38f};
};

}  // namespace tessera::tilecore

#include "tilecore/resolve/stencil_kernels.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "tilecore/resolve/cubic_weights.h"
#include "tilecore/resolve/stencil_tilt.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tilecore/resolve/any_stencils_kernel.cpp"
#include <hwy/foreach_target.h>

#include "tilecore/resolve/channels-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::tilecore::HWY_NAMESPACE {

struct WeightedTap {
  const Vec4* color;
  float weight;
};

// Largest weight first. Sums differences from it, so that a flat colour is exact whatever the weights.
struct TapList {
  std::array<WeightedTap, kMaxDirectTaps> taps;
  std::size_t count = 0;
  bool holds = false;  // a kernel's: there are taps, and their weights do not cancel

  TapList() { taps[0] = {nullptr, 0.0f}; }  // the rest need not be cleared
  void add(const Vec4* color, float weight) {
    taps[count] = {color, weight};
    if (count > 0 && weight > taps[0].weight) std::swap(taps[0], taps[count]);
    ++count;
  }
  Channels sum() const {
    const Channels base = load(taps[0].color);
    Channels difference = splat<4>(0.0f);
    for (std::size_t i = 1; i < count; ++i) difference = difference + (load(taps[i].color) - base) * taps[i].weight;
    return count == 1 ? base : base + difference;  // a lone tap is copied, -0 too
  }
};

constexpr auto kKernelWeights = [] {
  std::array<std::array<double, kWindowMargin + 1>, kReconstructionCount> k{};
  for (std::size_t r = 0; r < kReconstructionCount; ++r)
    for (std::size_t d = 0; d <= kWindowMargin; ++d)
      k[r][d] = kernel_weight(static_cast<Reconstruction>(r), static_cast<int>(d));
  return k;
}();

// Offsets within a window as seen from a pixel of its block, nearest first, equally near ones in raster order.
struct NearOffset {
  std::int8_t dx, dy;
  std::int16_t square;
};
constexpr int kFarthest = kWindowMargin + 3;
constexpr auto kNearOffsets = [] {
  constexpr int kSide = 2 * kFarthest + 1;
  std::array<NearOffset, static_cast<std::size_t>(kSide * kSide)> all{};
  for (int i = 0; i < kSide * kSide; ++i) {
    const int dx = i % kSide - kFarthest, dy = i / kSide - kFarthest;
    all[static_cast<std::size_t>(i)] = {static_cast<std::int8_t>(dx), static_cast<std::int8_t>(dy),
                                        static_cast<std::int16_t>(dx * dx + dy * dy)};
  }
  std::sort(all.begin(), all.end(), [](const NearOffset& a, const NearOffset& b) {
    return a.square != b.square ? a.square < b.square : a.dy != b.dy ? a.dy < b.dy : a.dx < b.dx;
  });
  return all;
}();

// The nearest usable pixels, or the first of them: never none, as the caller knows that there is a usable one.
TapList nearest_taps(const WindowView& view, int pixel, bool only_one) {
  const int cx = pixel % 4 + kWindowMargin, cy = pixel / 4 + kWindowMargin;
  TapList taps;
  int square = -1;
  for (const NearOffset& o : kNearOffsets) {
    if (square >= 0 && (o.square != square || only_one)) break;
    const int x = cx + o.dx, y = cy + o.dy;
    if (x < 0 || y < 0 || x >= kWindowSide || y >= kWindowSide || !(view.usable[static_cast<std::size_t>(y)] >> x & 1))
      continue;
    square = o.square;
    taps.add(view.at(x, y), 1.0f);
  }
  const float share = 1.0f / static_cast<float>(taps.count);
  for (std::size_t i = 0; i < taps.count; ++i) taps.taps[i].weight = share;
  return taps;
}

TapList kernel_taps(const WindowView& view, Reconstruction kernel, int pixel) {
  const auto& k = kKernelWeights[static_cast<std::size_t>(kernel)];
  const int reach = kernel_reach(kernel), cx = pixel % 4 + kWindowMargin, cy = pixel / 4 + kWindowMargin;
  std::array<ExactTap, kMaxDirectTaps> exact;
  std::size_t count = 0;
  double sum = 0, magnitude = 0;
  const unsigned within = (1u << (2 * reach + 1)) - 1;
  for (int dy = -reach; dy <= reach; ++dy) {
    const double wy = k[static_cast<std::size_t>(dy < 0 ? -dy : dy)];
    const unsigned row = view.usable[static_cast<std::size_t>(cy + dy)] >> (cx - reach) & within;
    for (unsigned left = row; left != 0; left &= left - 1) {
      const int dx = std::countr_zero(left) - reach;
      const double w = k[static_cast<std::size_t>(dx < 0 ? -dx : dx)] * wy;
      if (w == 0.0) continue;
      exact[count++] = {dx, dy, w};
      sum += w, magnitude += w < 0 ? -w : w;
    }
  }
  TapList taps;
  taps.holds = count > 0 && sum >= kMinimumDenominator * magnitude;
  if (taps.holds) tilt<kMaxDirectTaps>(std::span(exact.data(), count));
  for (std::size_t i = 0; i < count; ++i)
    taps.add(view.at(cx + exact[i].dx, cy + exact[i].dy), static_cast<float>(exact[i].weight));
  return taps;
}

Channels fill_directly(const WindowView& view, Reconstruction kernel, int pixel, ReconstructionWork& work) {
  ++work.direct_pixels;
  const bool nearest = kernel == Reconstruction::kNearest;
  const TapList taps = nearest ? TapList() : kernel_taps(view, kernel, pixel);
  if (taps.holds) {
    work.taps += taps.count;
    return taps.sum();
  }
  work.fallbacks += !nearest;
  const TapList near = nearest_taps(view, pixel, nearest);
  work.taps += near.count;
  Channels r = near.sum();
  // Without a tap that is not finite the stencil might hold: let the result tell of it.
  for (std::size_t i = 0; i < taps.count; ++i) r = r + (load(taps.taps[i].color) - load(taps.taps[i].color));
  return r;
}

// TapList::sum() without the list: stencils have their largest weight first.
Channels fill_from_table(const WindowView& view, const StencilIndexEntry& entry, int pixel, ReconstructionWork& work) {
  const Stencil& s = kStencils[entry.stencil];
  const float scale = 1.0f / static_cast<float>(s.unit());
  const Vec4* center = view.at(pixel % 4 + kWindowMargin, pixel / 4 + kWindowMargin);
  const auto place = [&](std::size_t i) {
    const StencilTap t = entry.symmetry.apply(s.taps[i]);
    return center + t.dy * view.window.row_stride + t.dx;
  };
  work.taps += s.count;
  const Channels base = load(place(0));
  Channels difference = splat<4>(0.0f);
  for (std::size_t i = 1; i < s.count; ++i)
    difference = difference + (load(place(i)) - base) * (static_cast<float>(s.taps[i].weight) * scale);
  return s.count == 1 ? base : base + difference;  // a lone tap is copied, -0 too
}

bool FillAny(const WindowView& view, const FillPlan& plan, BlockMask pixels, Vec4* out16, ReconstructionWork& work) {
  Channels zeros = splat<4>(0.0f);  // stays +0 while all results are finite
  for (unsigned left = pixels; left != 0; left &= left - 1) {
    const int p = std::countr_zero(left);
    const StencilIndexEntry entry =
        plan.pattern ? mirrored_entry(plan.kernel, plan.border, *plan.pattern, p) : StencilIndexEntry{};
    const Channels r =
        entry.stencil == kNoStencil ? fill_directly(view, plan.kernel, p, work) : fill_from_table(view, entry, p, work);
    zeros = zeros + (r - r);
    store(r, out16 + p);
  }
  return is_finite(zeros);
}

}  // namespace tessera::tilecore::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::tilecore {

HWY_EXPORT(FillAny);

bool fill_any(const WindowView& view, const FillPlan& plan, BlockMask pixels, Vec4* out16, ReconstructionWork& work) {
  return HWY_DYNAMIC_DISPATCH(FillAny)(view, plan, pixels, out16, work);
}

}  // namespace tessera::tilecore
#endif

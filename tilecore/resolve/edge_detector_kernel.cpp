#include <cmath>

#include "tilecore/resolve/edge_detector.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tilecore/resolve/edge_detector_kernel.cpp"
#include <hwy/foreach_target.h>

#include "base/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::tilecore::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET == HWY_SCALAR

bool DetectEdgeOfWhole(const EdgeSettings& settings, const float* depth, std::size_t stride) {
  return detect_edge_by_pixel(settings, depth, stride, 4, 4);
}

#else

using D = hn::FixedTag<float, 4>;
using V = hn::Vec<D>;

HWY_INLINE V second_difference(V before, V here, V after) {
  return hn::Add(hn::Sub(before, hn::Mul(hn::Set(D(), 2.0f), here)), after);
}

// Row by row at once.
bool DetectEdgeOfWhole(const EdgeSettings& settings, const float* depth, std::size_t stride) {
  const D d;
  V row[4], nothing = hn::Zero(d);  // +0 where depth is finite, else NaN
  for (std::size_t y = 0; y < 4; ++y) {
    row[y] = hn::LoadU(d, depth + y * stride);
    nothing = hn::Add(nothing, hn::Sub(row[y], row[y]));
  }
  if (!hn::AllTrue(d, hn::Eq(nothing, hn::Zero(d)))) {
    for (std::size_t i = 0; i < 16; ++i)
      if (std::isfinite(depth[i / 4 * stride + i % 4])) return true;
    return false;
  }
  if (settings.measure == EdgeMeasure::kInverseDepth && !settings.orthographic)
    for (V& r : row) r = hn::Div(hn::Set(d, 1.0f), r);
  const V along_y[2] = {second_difference(row[0], row[1], row[2]), second_difference(row[1], row[2], row[3])};
  for (std::size_t y = 0; y < 4; ++y) {
    // The two inner pixels count, each for its own place and for its outer neighbour.
    const V r = row[y], inner = second_difference(r, hn::Shuffle0321(r), hn::Shuffle1032(r)),
            laplacian = hn::Add(hn::InterleaveLower(d, inner, inner), along_y[y / 2]);
    if (!hn::AllFalse(d, hn::Gt(hn::Abs(laplacian), hn::Mul(hn::Set(d, settings.threshold), hn::Abs(r))))) return true;
  }
  return false;
}

#endif

}  // namespace tessera::tilecore::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::tilecore {

HWY_EXPORT(DetectEdgeOfWhole);

bool detect_edge(const EdgeSettings& settings, const float* depth, std::size_t stride, int width, int height) {
  return width == 4 && height == 4 ? HWY_DYNAMIC_DISPATCH(DetectEdgeOfWhole)(settings, depth, stride)
                                   : detect_edge_by_pixel(settings, depth, stride, width, height);
}

}  // namespace tessera::tilecore
#endif

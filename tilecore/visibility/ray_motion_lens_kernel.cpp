// Visibility with motion and a lens.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tilecore/visibility/ray_motion_lens_kernel.cpp"
#include <hwy/foreach_target.h>

#include "tilecore/visibility/ray-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::tilecore::HWY_NAMESPACE {

VisibilityKernels MotionLensKernels() { return kernels_with<true, true>(); }

}  // namespace tessera::tilecore::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::tilecore {

HWY_EXPORT(MotionLensKernels);

VisibilityKernels motion_lens_kernels() { return HWY_DYNAMIC_DISPATCH(MotionLensKernels)(); }

}  // namespace tessera::tilecore
#endif

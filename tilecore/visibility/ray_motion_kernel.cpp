// Visibility with motion, without lens.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tilecore/visibility/ray_motion_kernel.cpp"
#include <hwy/foreach_target.h>

#include "tilecore/visibility/ray-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::tilecore::HWY_NAMESPACE {

VisibilityKernels MotionKernels() { return kernels_with<true, false>(); }

}  // namespace tessera::tilecore::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::tilecore {

HWY_EXPORT(MotionKernels);

VisibilityKernels motion_kernels() { return HWY_DYNAMIC_DISPATCH(MotionKernels)(); }

}  // namespace tessera::tilecore
#endif

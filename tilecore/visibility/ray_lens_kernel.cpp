// Visibility with a lens, without motion.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tilecore/visibility/ray_lens_kernel.cpp"
#include <hwy/foreach_target.h>

#include "tilecore/visibility/ray-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::tilecore::HWY_NAMESPACE {

VisibilityKernels LensKernels() { return kernels_with<false, true>(); }

}  // namespace tessera::tilecore::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::tilecore {

HWY_EXPORT(LensKernels);

VisibilityKernels lens_kernels() { return HWY_DYNAMIC_DISPATCH(LensKernels)(); }

}  // namespace tessera::tilecore
#endif

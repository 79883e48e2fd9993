// Visibility with motion and a lens.
#include "tilecore/visibility_kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tilecore/motion_lens_kernel.cpp"
#include <hwy/foreach_target.h>

#include "tilecore/visibility_kernel-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::tilecore::HWY_NAMESPACE {

void TraceMotionLens(const MicroMesh& mesh, std::size_t leaf, const TileSamples& samples, TimeRange times, const VisibilitySettings& settings,
                     HitSink& sink, VisibilityWork& work) {
  trace_leaf_with<true, true>(mesh, leaf, samples, times, settings, sink, work);
}

void TestMotionLens(const MicroMesh& mesh, std::size_t cell, std::span<const std::uint32_t> list, const TileSamples& samples,
                    const VisibilitySettings& settings, HitSink& sink, VisibilityWork& work) {
  test_cell_samples_with<true, true>(mesh, cell, list, samples, settings, sink, work);
}

}  // namespace tessera::tilecore::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::tilecore {
namespace {

HWY_EXPORT(TraceMotionLens);
HWY_EXPORT(TestMotionLens);

}  // namespace

const VisibilityKernels kMotionLensKernels = {
    [](const MicroMesh& mesh, std::size_t leaf, const TileSamples& samples, TimeRange times, const VisibilitySettings& settings,
       HitSink& sink, VisibilityWork& work) {
      HWY_DYNAMIC_DISPATCH(TraceMotionLens)(mesh, leaf, samples, times, settings, sink, work);
    },
    [](const MicroMesh& mesh, std::size_t cell, std::span<const std::uint32_t> list, const TileSamples& samples,
       const VisibilitySettings& settings, HitSink& sink, VisibilityWork& work) {
      HWY_DYNAMIC_DISPATCH(TestMotionLens)(mesh, cell, list, samples, settings, sink, work);
    }};

}  // namespace tessera::tilecore
#endif

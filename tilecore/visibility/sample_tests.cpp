#include "tilecore/visibility/sample_tests.h"

#include "base/check.h"
#include "tilecore/visibility/effect_kernels.h"

namespace tessera::tilecore {
namespace {

VisibilityKernels kernels_for(RayEffects effects, const VisibilitySettings& settings) {
  if (settings.kernels != nullptr) return *settings.kernels;
#ifdef TESSERA_STATIC_EFFECTS
  TESSERA_CHECK(!effects.motion && !effects.lens,
                "a build with TESSERA_EFFECTS=static has no code for motion and defocus");
  return still_kernels();
#else
  if (effects.motion) return effects.lens ? motion_lens_kernels() : motion_kernels();
  return effects.lens ? lens_kernels() : still_kernels();
#endif
}

}  // namespace

void trace_leaf(const MicroMesh& mesh, std::size_t leaf, const TileSamples& samples, TimeRange times,
                RayEffects effects, const VisibilitySettings& settings, HitSink& sink, VisibilityWork& work) {
  kernels_for(effects, settings).trace_leaf(mesh, leaf, samples, times, settings, sink, work);
  // The next leaf sees what this one covered.
  if (settings.depth != nullptr) sink.flush();
}

void test_cell_samples(const MicroMesh& mesh, std::size_t cell, std::span<const std::uint32_t> list,
                       const TileSamples& samples, RayEffects effects, const VisibilitySettings& settings,
                       HitSink& sink, VisibilityWork& work) {
  kernels_for(effects, settings).test_cell_samples(mesh, cell, list, samples, settings, sink, work);
}

}  // namespace tessera::tilecore

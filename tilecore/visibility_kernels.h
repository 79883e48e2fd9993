#pragma once

#include "tilecore/visibility_kernel.h"

namespace tessera::tilecore {

// The kernels of one set of effects, as visibility_kernel.h describes them; each set has a file of its own, compiled for all SIMD
// targets. A build with TESSERA_EFFECTS=static has the first set only.
struct VisibilityKernels {
  void (*trace_leaf)(const MicroMesh& mesh, std::size_t leaf, const TileSamples& samples, TimeRange times,
                     const VisibilitySettings& settings, HitSink& sink, VisibilityWork& work);
  void (*test_cell_samples)(const MicroMesh& mesh, std::size_t cell, std::span<const std::uint32_t> list, const TileSamples& samples,
                            const VisibilitySettings& settings, HitSink& sink, VisibilityWork& work);
};

extern const VisibilityKernels kStillKernels, kMotionKernels, kLensKernels, kMotionLensKernels;

}  // namespace tessera::tilecore

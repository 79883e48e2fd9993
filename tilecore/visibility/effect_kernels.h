#pragma once

#include "tilecore/visibility/sample_tests.h"

namespace tessera::tilecore {

// The kernels of one set of effects, as visibility_kernel.h describes them.
struct VisibilityKernels {
  void (*trace_leaf)(const MicroMesh& mesh, std::size_t leaf, const TileSamples& samples, TimeRange times,
                     const VisibilitySettings& settings, HitSink& sink, VisibilityWork& work);
  void (*test_cell_samples)(const MicroMesh& mesh, std::size_t cell, std::span<const std::uint32_t> list,
                            const TileSamples& samples, const VisibilitySettings& settings, HitSink& sink,
                            VisibilityWork& work);
};

// Those for the best SIMD target. Each set of effects has a file of its own, compiled for all targets; a build with
// TESSERA_EFFECTS=static has the first only.
VisibilityKernels still_kernels();
VisibilityKernels motion_kernels();
VisibilityKernels lens_kernels();
VisibilityKernels motion_lens_kernels();

}  // namespace tessera::tilecore

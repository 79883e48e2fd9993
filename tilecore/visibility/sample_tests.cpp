#include "tilecore/visibility/sample_tests.h"

#include <hwy/cache_control.h>

#include "base/check.h"

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

// Prefetches the data of a leaf that the kernels read.
void prefetch_leaf(const MicroMesh& mesh, std::size_t l, bool moving) {
  const std::size_t first = l * kLeafCells;
  for (const auto* box : {&mesh.box_x_low, &mesh.box_x_high, &mesh.box_y_low, &mesh.box_y_high})
    hwy::Prefetch(box->data() + first);
  hwy::Prefetch(mesh.triangle.data() + first);
  const MicroMesh::Grid& grid = mesh.leaves[l].grid;
  if (grid.columns == 0) {
    for (const auto& corner : mesh.corner) hwy::Prefetch(corner.data() + first);
    return;
  }
  const int rows = (static_cast<int>(mesh.leaves[l].cell_count) + grid.columns - 1) / grid.columns;
  for (int j = 0; j <= rows; ++j) {
    const auto v = static_cast<std::size_t>(grid.first + j * grid.stride);
    for (const auto* key : {&mesh.x0, &mesh.y0, &mesh.z0}) hwy::Prefetch(key->data() + v);
    if (!moving) continue;
    for (const auto* key : {&mesh.x1, &mesh.y1, &mesh.z1}) hwy::Prefetch(key->data() + v);
  }
}

// The next one from `l` on with times.
std::size_t next_leaf(std::span<const TimeRange> times, std::size_t l) {
  while (l < times.size() && times[l].empty()) ++l;
  return l;
}

}  // namespace

void trace_leaves(const MicroMesh& mesh, std::span<const TimeRange> times, const TileSamples& samples,
                  RayEffects effects, const VisibilitySettings& settings, HitSink& sink, VisibilityWork& work) {
  const auto trace = kernels_for(effects, settings).trace_leaf;
  std::size_t l = next_leaf(times, 0);
  if (l < times.size()) prefetch_leaf(mesh, l, effects.motion);
  while (l < times.size()) {
    const std::size_t next = next_leaf(times, l + 1);
    if (next < times.size()) prefetch_leaf(mesh, next, effects.motion);
    trace(mesh, l, samples, times[l], settings, sink, work);
    if (settings.depth != nullptr) sink.flush();
    l = next;
  }
}

void trace_leaf(const MicroMesh& mesh, std::size_t leaf, const TileSamples& samples, TimeRange times,
                RayEffects effects, const VisibilitySettings& settings, HitSink& sink, VisibilityWork& work) {
  kernels_for(effects, settings).trace_leaf(mesh, leaf, samples, times, settings, sink, work);
  // The next leaf sees the samples that this one covered.
  if (settings.depth != nullptr) sink.flush();
}

void test_cell_samples(const MicroMesh& mesh, std::size_t cell, std::span<const std::uint32_t> list,
                       const TileSamples& samples, RayEffects effects, const VisibilitySettings& settings,
                       HitSink& sink, VisibilityWork& work) {
  kernels_for(effects, settings).test_cell_samples(mesh, cell, list, samples, settings, sink, work);
}

}  // namespace tessera::tilecore

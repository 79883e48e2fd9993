#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "baselines/baseline_counters.h"
#include "baselines/tessellated_patch.h"
#include "baselines/triangle_setup.h"
#include "binner/tile_grid.h"
#include "frontend/bounds/sub_patch_bounder.h"
#include "gpu/configuration.h"
#include "tilecore/tile_job.h"

namespace tessera::baselines {

// A patch that the hull stage kept, and its triangles by tiles and by bins.
struct DrawnPatch {
  TessellatedPatch patch;
  TriangleList tiles, bins;
};

// The work of a patch that the hull stage kept, for time and energy.
struct PatchWork {
  std::uint32_t patch = 0;
  std::uint64_t vertices = 0, triangles = 0;  // shaded vertices; triangles that are culled or set up
};

// Counts of the stages before a binner of triangles.
struct GeometryCounts {
  BaselineCounters tiles, bins;          // hull stage and triangle setup, by the grid of tiles or of bins
  std::uint64_t vertices = 0;            // vertices of the patches that the hull stage kept
  std::uint64_t decoded_for_bounds = 0;  // elements of records that the hull stage decoded
  // Bursts of the pixel shader's part of records: for patches that the hull stage kept, and for the ones of
  // which setup kept a triangle.
  std::uint64_t attribute_bytes = 0, kept_attribute_bytes = 0;
  std::vector<PatchWork> patches;  // in the order of patches
};

// The stages before a binner of triangles, for all machines that have one.
//
//   hull stage: factor 0 for patches and clusters that lie outside the view or face away, by the bounds of whole patches
//   that the front end computes (frontend/), instances first -> tessellation -> domain shading -> setup
//
// Invariants (cited by the tests):
//   GP1  A patch that the hull stage drops has no triangle that setup would keep.
//   GP2  Patches reach `draw` in the order of their numbers, some at a time, on the calling thread.
//   GP3  Vertices of a draw with the same number have the same position, bit by bit.
GeometryCounts run_geometry(const tilecore::TileJob& job, const frontend::PyramidLibrary& pyramids,
                            const gpu::GpuConfiguration& gpu, const TriangleSetup& tiles, const TriangleSetup& bins,
                            const std::function<void(std::span<const DrawnPatch>)>& draw);

// Result of the hull stage; it also adds to counters.
struct HullStage {
  std::vector<std::uint8_t> kept;        // by patch, 1 or 0
  std::uint64_t decoded_for_bounds = 0;  // elements of the records that it reads
};
HullStage run_hull_stage(const tilecore::TileJob& job, const frontend::PyramidLibrary& pyramids,
                         const gpu::GpuConfiguration& gpu, BaselineCounters& counters);

// Tessellates a whole base patch as tile cores do.
TessellatedPatch tessellate_patch(const tilecore::TileJob& job, std::uint32_t number);

// The same machine without splits of patches.
gpu::GpuConfiguration patch_whole_machine(gpu::GpuConfiguration gpu);

}  // namespace tessera::baselines

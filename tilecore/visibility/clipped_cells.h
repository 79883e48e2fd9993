#pragma once

#include "scene/view.h"
#include "tilecore/visibility/sample_tests.h"
#include "tilecore/visibility/visibility_settings.h"

namespace tessera::tilecore {

// Cells with a vertex behind the near plane or outside the guard band, at either key: the few triangles for which no
// screen position exists. They are tested in homogeneous coordinates (Olano and Greer 1997), sample by sample inside
// bounds of their part beyond the near plane. The bounds are the method's: patch-bvh halves the shutter until the
// bounds of a part hold few samples, at last one time, and skips samples that see a nearer surface; the segment methods
// and interleaved bound each of their segments, the partitions a square of the tile. Edges between projected vertices
// are decided exactly as in the kernels, so no crack opens towards unclipped neighbours. Samples whose stencil value is
// outside `times` are skipped.
void test_clipped_cells(const MicroMesh& mesh, const TileSamples& samples, TimeRange times, RayEffects effects,
                        const scene::Projection& projection, const VisibilitySettings& settings,
                        const VisibilityMethodSettings& method, HitSink& sink, VisibilityWork& work);

}  // namespace tessera::tilecore

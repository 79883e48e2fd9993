#pragma once

#include "tilecore/tessellation/micro_mesh.h"
#include "tilecore/visibility/ray_effects.h"
#include "tilecore/visibility/visibility_settings.h"

namespace tessera::tilecore {

// Tests that the ways of patch-bvh are expected to take for a mesh, boxes and triangles together, for each sample
// of a pixel over the whole shutter. The unit is a box test; a triangle test is worth two.
//
//   class   every survivor of a leaf's box meets the boxes of all its cells, and both triangles of the cells whose box
//           holds it: sum over leaves of area(leaf) * cells + 4 sum over cells of area(cell), in the rest frame, where
//           boxes also hold what differs from the leaf's own motion
//   ray     every ray of the mesh visits about two nodes a level, and both triangles of the cells whose box at its time
//           holds it: kRaysPerSample area(mesh) (1 + 2 log2(cells)) + 4 sum over cells of area(cell), of the boxes on
//           screen at a time, mean of shutter open and close
//
//   brute   all samples in the pixels of a cell's whole motion meet both its triangles: 4 sum over cells of the area of
//           these pixels; not with a lens, whose reach would be all of it
//
// Boxes that move along with their leaf are tight where its cells nearly share their motion. Where they turn, come
// closer at different rates or deform, boxes that follow each cell are. Where cells move by less than they are wide,
// no boxes are worth their tests.
struct TestCosts {
  double by_class = 0, by_ray = 0, brute = 0;
};
TestCosts test_costs(const MicroMesh& mesh, RayEffects effects);

// `method` with what it leaves open (chooses()) settled for a mesh: the cheapest of the three, the first of equals. A
// function of the mesh alone.
VisibilityMethodSettings settled(VisibilityMethodSettings method, const TestCosts& costs, RayEffects effects);
VisibilityMethodSettings settled(VisibilityMethodSettings method, const MicroMesh& mesh, RayEffects effects);

}  // namespace tessera::tilecore

#pragma once

#include "tilecore/tessellation/micro_mesh.h"
#include "tilecore/visibility/ray_effects.h"
#include "tilecore/visibility/visibility_settings.h"

namespace tessera::tilecore {

// What the ways of patch-bvh are expected to take for a mesh. Tests, boxes and triangles together, for each sample of a
// pixel over the whole shutter; the unit is a box test, a triangle test is worth two.
//
//   class   every survivor of a leaf's box meets the boxes of all its cells, and both triangles of the cells whose box
//           holds it: sum over leaves of area(leaf) * cells + 4 sum over cells of area(cell), in the rest frame, where
//           boxes also hold what differs from the leaf's own motion
//   ray     every ray of the mesh visits about two nodes a level, and both triangles of the cells whose box at its time
//           holds it: kRaysPerSample area(mesh) (1 + 2 log2(cells)) + 4 sum over cells of area(cell), of the boxes on
//           screen at a time, mean of shutter open and close; a lens makes the mesh's as much wider as it is out of focus
//
//   brute   all samples in the pixels of a cell's whole motion meet both its triangles: 4 sum over cells of the area of
//           these pixels; not with a lens, whose reach would be all of it
//
// Boxes that move along with their leaf are tight where its cells nearly share their motion. Where they turn, come
// closer at different rates or deform, boxes that follow each cell are. Where cells move by less than they are wide,
// no boxes are worth their tests.
//
// Every tile that the mesh sweeps builds boxes again: those of cells and leaves by class, all nodes of a binary tree for
// rays, one a cell for brute; and the frustum of 4x4 pixels meets all nodes that cross them at any time. A far way with few samples of each tile on it
// does not pay for a tree.
struct TestCosts {
  double by_class = 0, by_ray = 0, brute = 0;
  double ray_visits = 0;                               // nodes, of a ray that may hit
  double cells = 0, leaves = 0, bundles = 0;           // bundles: of 4x4 pixels, that each cell crosses
  double width = 0, height = 0, way_x = 0, way_y = 0;  // pixels: the box on screen, mean of both keys; of its centre
  double lens_factor = 0;                              // largest of a leaf: what a lens point moves it by

  // How many tiles the box touches on its way, seen through a lens: of kChoiceTile pixels a side, whatever the machine's,
  // so that the choice and what it counts do not depend on them.
  static constexpr double kChoiceTile = 32;
  double tiles(double lens_scale) const;
};
TestCosts test_costs(const MicroMesh& mesh, RayEffects effects);

// What else the choice depends on.
struct ChoiceScale {
  int samples_per_pixel;
  double lens_scale;  // pixels; 0 without a lens
};

// `method` with what it leaves open (chooses()) settled for a mesh: the cheapest of the three, the first of equals. A
// function of these alone.
VisibilityMethodSettings settled(VisibilityMethodSettings method, const TestCosts& costs, RayEffects effects,
                                 const ChoiceScale& scale);

}  // namespace tessera::tilecore

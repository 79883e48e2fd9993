#pragma once

#include "tilecore/tessellation/micro_mesh.h"
#include "tilecore/visibility/ray_effects.h"
#include "tilecore/visibility/visibility_settings.h"

namespace tessera::tilecore {

// Expected costs of the ways of patch-bvh for a mesh: tests of boxes and triangles together, for each sample of a pixel
// over the whole shutter. The unit is a box test; a triangle test is worth two.
//
//   class   every survivor of a leaf's box meets the boxes of all its cells, and both triangles of the cells whose box
//           holds it: sum over leaves of area(leaf) * cells + 4 sum over cells of area(cell), in the rest frame, where
//           boxes also hold the difference from the leaf's own motion
//   ray     every ray of the mesh visits about two nodes a level, and both triangles of the cells whose box at its time
//           holds it: kRaysPerSample area(mesh) (1 + 2 log2(cells)) + 4 sum over cells of area(cell), of the boxes on
//           screen at a time, mean of shutter open and close; a lens makes the mesh's as much wider as it is out of focus
//
//   brute   all samples in the pixels of a cell's whole motion meet both its triangles: 4 sum over cells of the area of
//           these pixels; not with a lens, whose reach would be all of it
//
// Boxes that move with their leaf are tight if its cells nearly share their motion. If cells turn, approach at
// different rates or deform, boxes that follow each cell are tighter. If cells move by less than their width, no boxes
// are worth their tests.
//
// Every tile that the mesh sweeps builds boxes again: for class the boxes of cells and leaves, for rays all nodes of a
// binary tree, for brute one a cell; and the frustum of 4x4 pixels meets all nodes that cross them at any time. A long
// path with few samples in each tile does not pay for a tree.
struct TestCosts {
  double by_class = 0, by_ray = 0, brute = 0;
  double ray_visits = 0;                               // nodes that a ray which may hit visits
  double cells = 0, leaves = 0, bundles = 0;           // bundles: of 4x4 pixels that each cell crosses
  double width = 0, height = 0, way_x = 0, way_y = 0;  // pixels: the box on screen, mean of both keys; its motion
  double lens_factor = 0;                              // largest of a leaf: its displacement per lens point

  // Number of tiles that the box touches during its motion, seen through a lens. Tiles have kChoiceTile pixels a side,
  // whatever the machine's, so that the choice and its counts do not depend on the machine's tiles.
  static constexpr double kChoiceTile = 32;
  double tiles(double lens_scale) const;
};
TestCosts test_costs(const MicroMesh& mesh, RayEffects effects);

// Further inputs of the choice.
struct ChoiceScale {
  int samples_per_pixel;
  double lens_scale;  // pixels; 0 without a lens
};

// Replaces the open choice of `method` (chooses()) for a mesh by the cheapest of the three, the first among equals. A
// function of its arguments alone.
VisibilityMethodSettings settled(VisibilityMethodSettings method, const TestCosts& costs, RayEffects effects,
                                 const ChoiceScale& scale);

}  // namespace tessera::tilecore

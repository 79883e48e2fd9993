#pragma once

#include "frontend/bounds/sub_patch_bounder.h"

namespace tessera::frontend {

// Proves that no triangle of a sub-patch can face the camera, whatever the time, the lens point and the rounding of
// its vertices, so that the sub-patch need not be binned.
//
// Every triangle's normal is the cross product of two chords. A chord along u is a positive combination of control
// vectors, so that undisplaced chords lie in the two tangent cones, and all cross products in the cone of TPATCH. What
// else a chord holds (displacement: the slope of the heights along it and the turn of the normal; stitching: a piece
// of the other direction; rounding) tilts the cross product by at most its size against the least cross product. The
// cone so widened must see the back from the whole lens, at every corner of the moving box and hence everywhere in it,
// steeply enough that snapping vertices to the sub-pixel grid cannot turn a triangle over.
//
// Not decided, and so kept: double-sided materials, clusters, boxes that cross the near plane, and displaced
// sub-patches with vertices that other patches evaluate.
class BackFaceTest {
 public:
  explicit BackFaceTest(const scene::FrameGeometry& frame) : frame_(frame) {}

  void begin(std::uint32_t patch);

  // For the cells whose box() the bounder made last; `corners` are those of that box.
  bool culls(const SubPatchBounder& bounder, const PyramidLibrary& pyramids, const scene::CellRange& cells,
             const MovingCorners& corners) const;

 private:
  struct Spread;  // of the chords' cross products
  struct Extra {
    double u, v;          // added to a chord, per unit of parameter
    double vertex_error;  // of any vertex
  };
  std::optional<Extra> extra(const SubPatchBounder& bounder, const PyramidLibrary& pyramids) const;
  bool spread(const SubPatchBounder& bounder, const PyramidLibrary& pyramids, const scene::CellRange& cells,
              Spread& out) const;

  const scene::FrameGeometry& frame_;
  std::uint32_t patch_ = 0;
  bool applies_ = false;
  std::array<DMat4, 2> to_camera_;
  double stretch_ = 1;  // largest factor by which to_camera_ lengthens a vector
};

}  // namespace tessera::frontend

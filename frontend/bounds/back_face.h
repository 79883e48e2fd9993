#pragma once

#include "frontend/bounds/sub_patch_bounder.h"

namespace tessera::frontend {

// Proves that no triangle of a sub-patch can face the camera, at any time, from any lens point and for any rounding of
// its vertices, so that the sub-patch need not be binned.
//
// Every triangle's normal is the cross product of a chord along u and one along v that share a vertex. From a vertex at
// p + n h to one at p' + n' h' a chord is (p' - p) + (n' - n) h' + n (h' - h): a change of place, the normal's turn, and
// a step of the heights along the normal that both chords share. Let A and B be the parts that are no step of heights,
// and a and b the steps; the cross product is then A x B + b (A x n) + a (n x B). Each enters as a box in the frame of
// the corners: p' - p from the control vectors, n from its cone, a and b from the slopes of the filtered heights over
// the footprint. Vertices of other patches and rounding widen A, B, a and b. The box of the cross products must show
// its back to the whole lens, at every corner of the moving box and hence everywhere in it, steeply enough that
// snapping vertices to the sub-pixel grid cannot turn a triangle over.
//
// For a cluster at rest, cluster_faces_away() decides, as a whole.
//
// These are not decided, and so kept: double-sided materials, clusters that deform, boxes that cross the near plane,
// and displaced sub-patches that touch a collapsed edge or vertices of patches with other normals or texture
// coordinates.
class BackFaceTest {
 public:
  // `fetches`, unless null, gets every table entry that is read.
  explicit BackFaceTest(const scene::FrameGeometry& frame, HeightTableCache* fetches = nullptr)
      : frame_(frame), fetches_(fetches) {}

  void begin(std::uint32_t patch);

  // Tests the cells whose box() the bounder made last; `corners` are the corners of that box.
  bool culls(const SubPatchBounder& bounder, const PyramidLibrary& pyramids, const scene::CellRange& cells,
             const MovingCorners& corners) const;

 private:
  struct Chords;
  struct Corners;
  Corners look(const MovingCorners& corners) const;
  bool faces_away_at_middle(const SubPatchBounder& bounder, const Corners& corners) const;
  std::optional<Chords> chords(const SubPatchBounder& bounder, const PyramidLibrary& pyramids,
                               const scene::CellRange& cells) const;
  bool displace(const SubPatchBounder& bounder, const PyramidLibrary& pyramids, const scene::CellRange& cells,
                Chords& chords) const;
  void stitch(const scene::CellRange& cells, Chords& chords) const;

  const scene::FrameGeometry& frame_;
  HeightTableCache* fetches_;
  std::uint32_t patch_ = 0;
  bool applies_ = false;
  const scene::ClusterBound* cluster_ = nullptr;  // null unless the patch is a cluster that may be culled
  std::array<DMat4, 2> to_camera_;
  double stretch_ = 1;  // largest factor by which to_camera_ lengthens a vector
};

}  // namespace tessera::frontend

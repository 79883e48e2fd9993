#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "scene/subdivision/refined_cage.h"

namespace tessera::scene::subdivision {

// Weights that compute the control points of the patches from the points of the finest level. A control point is a
// weighted sum of the points around it, and the weights depend on topology and sharpness alone. So the same masks
// convert positions, differences of morph targets and skin influences.
//
// Control points are numbered: one per point (patch corner), two per edge, four per face. Patches refer to them by
// number.
//
// Invariants (cited by the tests):
//   LM1  Patches that share an edge or a corner share its control points, each evaluated once: equal bit by bit.
//   LM2  Where all four points of a face are regular (four faces; two on a boundary or crease; one at a sharp corner)
//        and its surroundings are smooth, the patch is the limit surface of Catmull and Clark.
//   LM3  Patch corners lie on the limit surface everywhere, and at smooth and crease points the control points next to
//        them lie in its tangent plane: normals agree at patch corners. A crease or boundary is its limit curve, a
//        cubic B-spline, or straight where both ends are corners.
//   LM4  The weights of a control point sum to 1.
//
// Limit positions and tangents: Halstead, Kass, DeRose 1993 and Biermann, Levin, Zorin 2000 (creases), in the form of
// Loop, Schaefer, Ni, Castano 2009, "Approximating subdivision surfaces with Gregory patches for hardware
// tessellation". Deviations: patches stay bicubic, with one inner point instead of a Gregory patch's two at each corner
// of a face at an extraordinary point. Across the edges that leave such a point the normal is therefore continuous at
// both ends but not quite between: by up to 0.7 degrees at a cube's corners after one level, half that after each
// further one [measured]. Sharpness that is left at the finest level counts as infinite.
class LimitMasks {
 public:
  explicit LimitMasks(const osd::TopologyLevel& level);

  std::size_t control_point_count() const { return masks_.size(); }
  std::size_t corner(int point) const { return static_cast<std::size_t>(point); }
  // The control point of an edge's curve next to `end` (0, 1: first, second point of the edge).
  std::size_t on_edge(int edge, int end) const { return static_cast<std::size_t>(points_ + 2 * edge + end); }
  std::size_t inside(int face, int face_corner) const {
    return static_cast<std::size_t>(points_ + 2 * edges_ + 4 * face + face_corner);
  }

  // Numbers of the 16 control points of a face's patch: 4 j + i is point i along u, j along v. u runs from the face's
  // first point to its second, v to its fourth.
  std::array<std::size_t, 16> patch(const osd::TopologyLevel& level, int face) const;

  // T has Clear() and AddWithWeight(const T&, double).
  template <class T>
  std::vector<T> apply(const std::vector<T>& values) const {
    std::vector<T> out(masks_.size());
    for (std::size_t m = 0; m < masks_.size(); ++m) {
      out[m].Clear();
      for (std::size_t t = masks_[m].first; t < masks_[m].first + masks_[m].count; ++t) {
        const int source = terms_[t].source;
        out[m].AddWithWeight(
            source >= 0 ? values[static_cast<std::size_t>(source)] : out[static_cast<std::size_t>(~source)],
            terms_[t].weight);
      }
    }
    return out;
  }

 private:
  struct Term {
    double weight;
    int source;  // a point of the finest level; ~c: control point c, which comes before this one
  };
  struct Mask {
    std::size_t first = 0, count = 0;  // of terms_
  };
  struct FaceSide {  // from corner `near` of a face to corner `far`
    int face, near, far, edge;
    double near_valence, far_valence;
  };
  struct Ring;

  void add_point(const osd::TopologyLevel& level, int point);
  void add_corner_masks(const Ring& ring);
  void add_crease_masks(const Ring& ring, std::size_t leading, std::size_t trailing);
  void add_sector_masks(const Ring& ring, std::size_t leading, std::size_t faces);
  void add_smooth_masks(const Ring& ring);
  void add_straight_edge(const Ring& ring, std::size_t i);
  void add_inner_masks(const osd::TopologyLevel& level, int face);
  void add_gregory_point(const osd::TopologyLevel& level, const FaceSide& side, double weight);
  void begin(std::size_t control_point) { open_ = control_point, masks_[open_] = {terms_.size(), 0}; }
  void add(int point, double weight) { terms_.push_back({weight, point}), ++masks_[open_].count; }
  void add_control_point(std::size_t control_point, double weight) { add(~static_cast<int>(control_point), weight); }

  int points_, edges_;
  std::vector<Mask> masks_;
  std::vector<Term> terms_;
  std::vector<std::array<double, 4>>
      sector_valence_;  // per face and corner: edges of the full turn of which its sector is half, or all
  std::size_t open_ = 0;
};

}  // namespace tessera::scene::subdivision

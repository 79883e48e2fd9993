#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "frontend/bounds/minmax_pyramid.h"
#include "frontend/bounds/normal_bounds.h"
#include "frontend/bounds/oriented_box.h"
#include "frontend/bounds/patch_net.h"
#include "frontend/bounds/sibling_boxes.h"
#include "frontend/settings.h"
#include "scene/frame_geometry.h"
#include "scene/patch_displacement.h"
#include "scene/procedure_patch.h"

namespace tessera::frontend {

// Pyramids of every displacement texture of a capture, with slopes and differences of levels where a single-sided
// material uses it, and of the alpha of the colour textures of masked materials; built once. The displacement pyramids
// lie back to back in a memory of their own.
class PyramidLibrary {
 public:
  explicit PyramidLibrary(const scene::Assembly& assembly);
  const MinMaxPyramid& of(const shaders::ScalarTexture& texture) const { return *pyramids_.at(&texture); }
  const SlopePyramid& slopes_of(const shaders::ScalarTexture& texture) const { return *slopes_.at(&texture); }
  const LevelDifferences& level_differences_of(const shaders::ScalarTexture& texture) const {
    return *level_differences_.at(&texture);
  }
  // Null for a texture whose alpha is 1 everywhere, and for textures of materials that do not mask.
  const MinMaxPyramid* alpha_of(const shaders::Texture& texture) const;

 private:
  std::map<const shaders::ScalarTexture*, std::unique_ptr<MinMaxPyramid>> pyramids_;
  std::map<const shaders::ScalarTexture*, std::unique_ptr<SlopePyramid>> slopes_;
  std::map<const shaders::ScalarTexture*, std::unique_ptr<LevelDifferences>> level_differences_;
  std::map<const shaders::Texture*, std::unique_ptr<MinMaxPyramid>> alphas_;
};

// A sub-patch's box in raster space at both motion keys, with the rounding margin that goes with it.
struct SubPatchBody {
  MovingCorners corners;
  RoundingMargin margin;
  // The same for the difference of a vertex's coordinates between the motion keys, as far as it comes from the vertex
  // itself and not from its transformation. For rigid drawables, whose vertex is the same at both keys.
  RoundingMargin motion_margin{};
  MovingBox box{};  // in object space
};

// Result of SubPatchBounder::bound() for one of several ranges, for use().
struct SiblingBound {
  scene::CellRange cells;
  bool bounded = false;  // otherwise use() computes the bound
  bool all_inner = true, foreign_boundary = false;
  scene::ParameterRange range{}, inner_range{};
  ValueRange offsets, foreign_offsets;
  MovingBox box;
  std::vector<std::uint64_t> fetched;
};

// Bounds the sub-patches of base patches, one base patch after another. A box holds every vertex that the machine
// computes for the cells: interior vertices, vertices that stitching moves, and vertices on shared displaced edges and
// corners, which the patches that own them evaluate with their own heights and normals.
//
// Invariants (cited by the tests):
//   SB1  A range has the same body, to the bit, whether it is bounded alone or with any others, on every SIMD target.
//   SB2  It makes the same fetches as alone, and makes them in use().
//
// For finite input it raises neither the invalid nor the divide-by-zero flag, except with kInterval, whose ends may be
// infinite. It owns scratch memory; one instance per thread.
class SubPatchBounder {
 public:
  // `fetches`, unless null, gets every table entry that is read, and every record but the base patch's own.
  SubPatchBounder(const scene::FrameGeometry& frame, const PyramidLibrary& pyramids, BoundMethod method,
                  HeightTableCache* fetches = nullptr)
      : frame_(frame), pyramids_(pyramids), method_(method), fetches_(fetches) {}

  // Chooses the base patch and computes the data that its sub-patches share.
  void begin(std::uint32_t patch);

  // Box of the cells in object space. A deforming drawable moves between its keys; a rigid one has the same at both.
  MovingBox box(const scene::CellRange& cells);
  // Bounds the cells. A cluster whose aligned box is out of view gets that box as its body: the boxes of groups and
  // instances of clusters hold the aligned boxes, but not the corners of turned boxes that stick out of them.
  SubPatchBody body(const scene::CellRange& cells);
  // Bounds up to kSiblings ranges of the base patch at once, each to the bit as body() does. Nothing is fetched or
  // counted before use(), which the caller may skip for some ranges.
  void bound(std::span<const scene::CellRange> cells, std::span<SiblingBound* const> out);
  void bound(std::span<const scene::CellRange> cells, std::span<SiblingBound> out);
  // The body of the bound's cells, as body() gives it.
  SubPatchBody use(const SiblingBound& bound);
  // Whether the last body() computed a second box.
  bool bounded_twice() const { return bounded_twice_; }

  // About the box() made last, for culling: the parameters, the restricted nets, and the displacement.
  const scene::ParameterRange& range() const { return range_; }
  std::span<const PatchNet> nets() const;
  bool displaced() const { return displaced_; }
  // Whether every offset that moves a vertex of the cells is exactly zero, including offsets of other patches on the
  // boundary.
  bool offsets_vanish() const;
  // Range of the patch's own displacement, over all of range().
  ValueRange offsets() const { return offset_range(displacement_, range_); }
  const scene::PatchDisplacement& displacement() const { return displacement_; }
  // The part of range() whose surface the box holds: without the strips next to vertices that other patches evaluate.
  const scene::ParameterRange& inner_range() const { return inner_range_; }

  // Largest distance, in object space, of the vertices that other patches evaluate from the places where this patch's
  // own evaluation puts them: along this patch's normal, and besides. nullopt if the patches' normals or texture
  // coordinates are unrelated. `tangents`: one for each of nets().
  struct ForeignError {
    double along_normal = 0, besides = 0;
  };
  std::optional<ForeignError> foreign_error(const scene::CellRange& cells,
                                            std::span<const TangentCones> tangents) const;
  // Whether a boundary vertex of the cells is evaluated by another patch's displacement.
  bool foreign_boundary() const { return foreign_boundary_; }
  const scene::PosedDrawable& drawable() const { return *drawable_; }
  double largest_coordinate() const { return largest_; }

 private:
  // An edge whose displaced vertices another edge's evaluation provides.
  struct ForeignEdge {
    bool active = false, collapsed = false;
    std::uint8_t owner_edge = 0;
    bool reversed = false;
    std::size_t corner = 0;  // of a collapsed edge: the corner with its vertices
    scene::PatchDisplacement displacement;
    std::array<std::array<DVec3, 4>, 2> points, across;  // [key]: of the owner
    double rounding = 0;
  };

  void begin_edges(std::uint32_t patch);
  void fetch_owner(std::uint32_t owner) const;
  void begin_inner(const scene::CellRange& cells);
  scene::CellRange inner_cells(const scene::CellRange& cells) const;
  // Parameters of the part [first, last] of an owner's edge.
  struct EdgePart {
    float first, last;
    scene::ParameterRange strip;
  };
  static EdgePart edge_part(const ForeignEdge& edge, std::size_t e, const scene::ParameterRange& range);
  struct SiblingScratch;
  void begin_sibling(SiblingBound& out, std::size_t lane, SiblingScratch& scratch) const;
  void touch_edges(SiblingBound& out, std::size_t lane, SiblingScratch& scratch) const;
  bool look_up(std::span<SiblingBound* const> out, SiblingScratch& scratch) const;
  void touch_corners(SiblingBound& out, std::size_t lane, SiblingScratch& scratch) const;
  static ValueRange offsets_of(const scene::PatchDisplacement& displacement, const ValueRange& heights);
  ValueRange offset_range(const scene::PatchDisplacement& displacement, const scene::ParameterRange& range) const;
  void bound_interior(const CornerFrame& frame, MovingBox& box);
  void bound_interval(MovingBox& box);
  void bound_foreign_edge(const ForeignEdge& edge, std::size_t e, MovingBox& box);
  void bound_foreign_vertices(const scene::CellRange& cells, MovingBox& box);
  std::array<bool, 4> touched_edges(const scene::CellRange& cells) const;
  static std::array<bool, 4> touched_corners(const scene::ParameterRange& range);
  std::optional<double> height_error(const ForeignEdge& edge, std::size_t e) const;
  std::optional<double> normal_error(const ForeignEdge& edge, std::size_t e,
                                     std::span<const TangentCones> tangents) const;
  ForeignError corner_error(std::size_t corner) const;
  MovingBox cluster_box() const;
  SubPatchBody body_of(const MovingBox& box) const;
  bool oriented() const { return method_ != BoundMethod::kAabb && method_ != BoundMethod::kInterval; }

  const scene::FrameGeometry& frame_;
  const PyramidLibrary& pyramids_;
  BoundMethod method_;
  HeightTableCache* fetches_;

  std::uint32_t patch_ = 0;
  const scene::PosedDrawable* drawable_ = nullptr;
  const scene::TessellationPattern* pattern_ = nullptr;  // of a Bezier patch
  bool bezier_ = false, displaced_ = false, foreign_boundary_ = false, bounded_twice_ = false;
  std::size_t keys_ = 1;
  double largest_ = 0;                      // largest coordinate of any control point used
  double rounding_ = 0;                     // of a float derivative
  std::array<DMat4, 2> to_raster_, way_;    // per key; way_: their difference, for both keys
  const MinMaxPyramid* heights_ = nullptr;  // of the material, which owners of edges share
  std::array<PatchNet, 2> base_;
  mutable std::array<PatchNet, 2> nets_;  // of range_, made on demand
  mutable bool nets_made_ = false;
  scene::PatchDisplacement displacement_;
  scene::ProcedurePatch procedure_patch_;
  std::array<ForeignEdge, 4> edges_;
  std::array<std::array<DVec3, 4>, 2> corners_;  // [key]: displaced as their owners evaluate them
  std::array<float, 4> corner_offsets_{};
  scene::ParameterRange range_{};
  // Without the rows of vertices that other patches evaluate; equal to range_ and nets_ if nothing displaces.
  scene::ParameterRange inner_range_{};
  std::array<PatchNet, 2> inner_nets_;
  bool all_inner_ = true;
  ValueRange offsets_{0, 0}, foreign_offsets_{0, 0};  // over inner_range_
};

}  // namespace tessera::frontend

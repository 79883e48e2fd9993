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
#include "frontend/settings.h"
#include "scene/frame_geometry.h"
#include "scene/patch_displacement.h"
#include "scene/procedure_patch.h"

namespace tessera::frontend {

// Pyramids of every displacement texture of a capture, and of the alpha of the colour textures of masked materials;
// built once.
class PyramidLibrary {
 public:
  explicit PyramidLibrary(const scene::Assembly& assembly);
  const MinMaxPyramid& of(const shaders::ScalarTexture& texture) const { return *pyramids_.at(&texture); }
  const SlopePyramid& slopes_of(const shaders::ScalarTexture& texture) const { return *slopes_.at(&texture); }
  // Null for a texture whose alpha is 1 everywhere, and for those of materials that do not mask.
  const MinMaxPyramid* alpha_of(const shaders::Texture& texture) const;

 private:
  std::map<const shaders::ScalarTexture*, std::unique_ptr<MinMaxPyramid>> pyramids_;
  std::map<const shaders::ScalarTexture*, std::unique_ptr<SlopePyramid>> slopes_;
  std::map<const shaders::Texture*, std::unique_ptr<MinMaxPyramid>> alphas_;
};

// A sub-patch's box in raster space at both motion keys, with the rounding margin that goes with it.
struct SubPatchBody {
  MovingCorners corners;
  RoundingMargin margin;
  // The same for the difference of a vertex's coordinates at both motion keys, as far as it comes from the vertex itself and
  // not from its transformation; of rigid drawables, whose vertex is the same at both.
  RoundingMargin way_margin{};
  MovingBox box{};  // in object space
};

// Bounds the sub-patches of one base patch after another. A box holds every vertex that the machine computes for the
// cells: those inside, those that stitching moves, and those on shared displaced edges and corners, which the patches
// that own them evaluate with their own heights and normals.
//
// For finite input raises neither the invalid nor the divide-by-zero flag (but kInterval, whose ends may be infinite).
// Has scratch memory; one instance per thread.
class SubPatchBounder {
 public:
  SubPatchBounder(const scene::FrameGeometry& frame, const PyramidLibrary& pyramids, BoundMethod method)
      : frame_(frame), pyramids_(pyramids), method_(method) {}

  // Chooses the base patch; what its sub-patches share is computed here.
  void begin(std::uint32_t patch);

  // Box of the cells in object space. A deforming drawable moves between its keys; a rigid one has the same at both.
  MovingBox box(const scene::CellRange& cells);
  SubPatchBody body(const scene::CellRange& cells);

  // About the box() made last, for culling: the parameters, the restricted nets, and what displaces them.
  const scene::ParameterRange& range() const { return range_; }
  std::span<const PatchNet> nets() const { return {nets_.data(), keys_}; }
  const ValueRange& offsets() const { return offsets_; }
  bool displaced() const { return displaced_; }
  // Whether every offset that moves a vertex of the cells is exactly zero, those of other patches on the boundary
  // included.
  bool offsets_vanish() const {
    return offsets_.low == 0 && offsets_.high == 0 && foreign_offsets_.low == 0 && foreign_offsets_.high == 0;
  }
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
    std::size_t corner = 0;  // where a collapsed edge's vertices are
    scene::PatchDisplacement displacement;
    std::array<std::array<DVec3, 4>, 2> points, across;  // [key]: of the owner
    double rounding = 0;
  };

  void begin_edges(std::uint32_t patch);
  ValueRange offset_range(const scene::PatchDisplacement& displacement, const scene::ParameterRange& range) const;
  void bound_interior(const CornerFrame& frame, MovingBox& box);
  void bound_interval(MovingBox& box);
  void bound_foreign_edge(const ForeignEdge& edge, std::size_t e, MovingBox& box);
  void bound_foreign_vertices(const scene::CellRange& cells, MovingBox& box);
  MovingBox cluster_box() const;

  const scene::FrameGeometry& frame_;
  const PyramidLibrary& pyramids_;
  BoundMethod method_;

  std::uint32_t patch_ = 0;
  const scene::PosedDrawable* drawable_ = nullptr;
  bool bezier_ = false, displaced_ = false, foreign_boundary_ = false;
  std::size_t keys_ = 1;
  double largest_ = 0;   // coordinate of any control point used
  double rounding_ = 0;  // of a float derivative
  std::array<PatchNet, 2> base_, nets_;
  scene::PatchDisplacement displacement_;
  scene::ProcedurePatch procedure_patch_;
  std::array<ForeignEdge, 4> edges_;
  std::array<std::array<DVec3, 4>, 2> corners_;  // [key]: displaced, as their owners evaluate them
  std::array<float, 4> corner_offsets_{};
  scene::ParameterRange range_{};
  ValueRange offsets_{0, 0}, foreign_offsets_{0, 0};
};

}  // namespace tessera::frontend

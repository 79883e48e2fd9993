// Several sub-patches of one base patch at once: first the lookups of each, one after another, then all boxes together.
#include <cmath>

#include "frontend/bounds/sub_patch_bounder.h"

namespace tessera::frontend {
namespace {

void set_lane(SiblingParameters& parameters, std::size_t lane, const scene::ParameterRange& r) {
  parameters.u0[lane] = static_cast<double>(r.u0);
  parameters.v0[lane] = static_cast<double>(r.v0);
  parameters.u1[lane] = static_cast<double>(r.u1);
  parameters.v1[lane] = static_cast<double>(r.v1);
}
// Whether it is finite.
bool set_lane(SiblingOffsets& offsets, std::size_t lane, const ValueRange& range) {
  offsets.low[lane] = static_cast<double>(range.low);
  offsets.high[lane] = static_cast<double>(range.high);
  return std::isfinite(range.low) && std::isfinite(range.high);
}

MovingBox box_of(const SiblingBoxes& boxes, std::size_t lane) {
  MovingBox box;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto& a = boxes.axes[axis];
    box.axes[axis] = {a[0][lane], a[1][lane], a[2][lane]};
    for (std::size_t key = 0; key < 2; ++key) {
      box.low[key][axis] = boxes.low[key][axis][lane];
      box.high[key][axis] = boxes.high[key][axis][lane];
    }
  }
  return box;
}

}  // namespace

struct SubPatchBounder::SiblingScratch {
  SiblingParts parts;
  std::array<SiblingEdge, 4> edges;
  std::array<SiblingCorner, 4> corners;
  std::array<bool, 4> edge_touched{}, corner_touched{};
  // The lookups of a lane: its own heights, then the heights of the edges that it touches.
  static constexpr std::size_t kOwn = 4, kMaxLookups = kSiblings * (1 + 4);
  static_assert(2 * kMaxLookups <= kMaxPlaces);
  std::array<HeightLookup, kMaxLookups> lookups;
  std::array<std::uint8_t, kMaxLookups> lane_of, edge_of;
  std::size_t lookup_count = 0;

  void add(const scene::PatchDisplacement& displacement, const scene::ParameterRange& range, std::size_t lane,
           std::size_t edge, SiblingBound& out) {
    const scene::PatchDisplacement::Footprint f = displacement.footprint(range);
    lookups[lookup_count] = {f.low, f.high, displacement.lod, &out.fetched};
    lane_of[lookup_count] = static_cast<std::uint8_t>(lane);
    edge_of[lookup_count++] = static_cast<std::uint8_t>(edge);
  }
};

// Adds the displacement by other patches' heights at each edge that the lane touches.
void SubPatchBounder::touch_edges(SiblingBound& out, std::size_t lane, SiblingScratch& scratch) const {
  const std::array<bool, 4> touches = touched_edges(out.cells);
  for (std::size_t e = 0; e < 4; ++e) {
    const ForeignEdge& edge = edges_[e];
    if (!touches[e] || !edge.active) continue;
    out.foreign_boundary = true;
    if (edge.collapsed) continue;
    SiblingEdge& lanes = scratch.edges[e];
    if (!scratch.edge_touched[e]) {
      scratch.edge_touched[e] = true;
      for (std::size_t key = 0; key < keys_; ++key)
        lanes.points[key] = &edge.points[key], lanes.across[key] = &edge.across[key];
      lanes.turned = edge.owner_edge < 2 ? 1 : -1;
      lanes.rounding = edge.rounding;
      lanes.first.fill(0), lanes.last.fill(1), lanes.touched.fill(0);
      lanes.offsets.low.fill(0), lanes.offsets.high.fill(0);
    }
    const EdgePart part = edge_part(edge, e, out.range);
    scratch.add(edge.displacement, part.strip, lane, e, out);
    lanes.first[lane] = static_cast<double>(part.first);
    lanes.last[lane] = static_cast<double>(part.last);
    lanes.touched[lane] = 1;
  }
}

void SubPatchBounder::touch_corners(SiblingBound& out, std::size_t lane, SiblingScratch& scratch) const {
  std::array<bool, 4> corner = touched_corners(out.range);
  const std::array<bool, 4> touches = touched_edges(out.cells);
  for (std::size_t e = 0; e < 4; ++e)
    if (touches[e] && edges_[e].active && edges_[e].collapsed) corner[edges_[e].corner] = true;
  for (std::size_t c = 0; c < 4; ++c) {
    if (!corner[c]) continue;
    out.foreign_boundary = true;
    out.foreign_offsets = out.foreign_offsets.hull({corner_offsets_[c], corner_offsets_[c]});
    SiblingCorner& lanes = scratch.corners[c];
    if (!scratch.corner_touched[c]) {
      scratch.corner_touched[c] = true;
      for (std::size_t key = 0; key < keys_; ++key) lanes.at[key] = corners_[key][c];
      lanes.touched.fill(0);
    }
    lanes.touched[lane] = 1;
  }
}

// Sets the ranges of a lane and collects its lookups.
void SubPatchBounder::begin_sibling(SiblingBound& out, std::size_t lane, SiblingScratch& scratch) const {
  const scene::TessellationPattern& pattern = *pattern_;
  const scene::CellRange inner = inner_cells(out.cells);
  out.range = out.inner_range = parameter_range(pattern, out.cells);
  out.all_inner = inner == out.cells;
  if (!out.all_inner) out.inner_range = parameter_range(pattern, inner);
  scratch.parts.all_inner = scratch.parts.all_inner && out.all_inner;
  set_lane(scratch.parts.whole, lane, out.range);
  set_lane(scratch.parts.inner, lane, out.inner_range);
  out.offsets = out.foreign_offsets = {0, 0};
  out.foreign_boundary = false;
  (void)set_lane(scratch.parts.offsets, lane, out.offsets);
  if (!displaced_) return;
  scratch.add(displacement_, out.inner_range, lane, SiblingScratch::kOwn, out);
  touch_edges(out, lane, scratch);
  touch_corners(out, lane, scratch);
}

// Heights of all lanes; false where one is not finite.
bool SubPatchBounder::look_up(std::span<SiblingBound* const> out, SiblingScratch& scratch) const {
  if (scratch.lookup_count == 0) return true;
  const std::span<HeightLookup> lookups(scratch.lookups.data(), scratch.lookup_count);
  heights_->query(displacement_.material->sampler, lookups, fetches_);
  bool finite = true;
  for (std::size_t k = 0; k < scratch.lookup_count; ++k) {
    const std::size_t lane = scratch.lane_of[k], e = scratch.edge_of[k];
    const bool own = e == SiblingScratch::kOwn;
    const ValueRange offsets = offsets_of(displacement_, scratch.lookups[k].heights);
    SiblingBound& bound = *out[lane];
    if (own)
      bound.offsets = offsets;
    else
      bound.foreign_offsets = bound.foreign_offsets.hull(offsets);
    finite = set_lane(own ? scratch.parts.offsets : scratch.edges[e].offsets, lane, offsets) && finite;
  }
  return finite;
}

void SubPatchBounder::bound(std::span<const scene::CellRange> cells, std::span<SiblingBound> out) {
  std::array<SiblingBound*, kSiblings> each{};
  for (std::size_t k = 0; k < cells.size(); ++k) each[k] = &out[k];
  bound(cells, each);
}

void SubPatchBounder::bound(std::span<const scene::CellRange> cells, std::span<SiblingBound* const> out) {
  for (std::size_t k = 0; k < cells.size(); ++k) {
    out[k]->cells = cells[k];
    out[k]->bounded = false;
    out[k]->fetched.clear();
  }
  if (!bezier_ || drawable_->procedure != nullptr || method_ == BoundMethod::kInterval) return;
  SiblingScratch scratch;
  SiblingParts& parts = scratch.parts;
  parts.keys = {base_.data(), keys_};
  parts.oriented = oriented();
  parts.all_inner = true;
  parts.normals = !displaced_                       ? NormalsBy::kNothing
                  : method_ == BoundMethod::kTpatch ? NormalsBy::kTangents
                  : method_ == BoundMethod::kNpatch ? NormalsBy::kNormals
                                                    : NormalsBy::kNothing;
  parts.rounding = rounding_;
  for (std::size_t k = 0; k < cells.size(); ++k) begin_sibling(*out[k], k, scratch);
  if (!look_up(out, scratch)) return;
  for (std::size_t k = cells.size(); k < kSiblings; ++k) {  // as the first, and not looked at
    set_lane(parts.whole, k, out[0]->range);
    set_lane(parts.inner, k, out[0]->inner_range);
    (void)set_lane(parts.offsets, k, out[0]->offsets);
  }
  std::size_t edges = 0, corners = 0;
  for (std::size_t e = 0; e < 4; ++e) {
    if (scratch.edge_touched[e]) scratch.edges[edges++] = scratch.edges[e];
    if (scratch.corner_touched[e]) scratch.corners[corners++] = scratch.corners[e];
  }
  parts.edges = {scratch.edges.data(), edges};
  parts.corners = {scratch.corners.data(), corners};
  SiblingBoxes boxes;
  bound_siblings(parts, boxes);
  for (std::size_t k = 0; k < cells.size(); ++k) {
    out[k]->box = box_of(boxes, k);
    out[k]->bounded = true;
  }
}

SubPatchBody SubPatchBounder::use(const SiblingBound& bound) {
  if (!bound.bounded) return body(bound.cells);
  bounded_twice_ = false;
  range_ = bound.range;
  inner_range_ = bound.inner_range;
  all_inner_ = bound.all_inner;
  foreign_boundary_ = bound.foreign_boundary;
  offsets_ = bound.offsets;
  foreign_offsets_ = bound.foreign_offsets;
  nets_made_ = false;
  for (const std::uint64_t address : bound.fetched) fetches_->fetch(address);
  return body_of(bound.box);
}

}  // namespace tessera::frontend

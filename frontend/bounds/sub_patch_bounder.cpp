#include "frontend/bounds/sub_patch_bounder.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "frontend/bounds/cluster_facing.h"
#include "frontend/bounds/drawable_box.h"
#include "frontend/bounds/enclosure.h"
#include "frontend/bounds/procedure_bounds.h"
#include "frontend/patch_record.h"
#include "scene/domain_shader.h"
#include "scene/limits.h"
#include "scene/subpixel.h"

namespace tessera::frontend {
namespace {

// Grows the box at a key by [low, high] along an axis. Negated comparisons: NaN enters and makes the box unusable
// rather than vanish.
void extend(MovingBox& box, std::size_t key, std::size_t axis, double low, double high) {
  if (!(low >= box.low[key][axis])) box.low[key][axis] = low;
  if (!(high <= box.high[key][axis])) box.high[key][axis] = high;
}

// Smallest and largest offset * normal component.
std::pair<double, double> product(const ValueRange& offset, double low, double high) {
  const double a = static_cast<double>(offset.low), b = static_cast<double>(offset.high);
  return std::minmax({a * low, a * high, b * low, b * high});
}

void extend_displaced(MovingBox& box, std::size_t key, const Extents& base, const ValueRange& offset,
                      const NormalRange& normals) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto [low, high] = product(offset, normals.low[axis], normals.high[axis]);
    extend(box, key, axis, base.low[axis] + low, base.high[axis] + high);
  }
}

Extents extents_of(const std::array<DVec3, 4>& points, const Frame& axes) {
  Extents e;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double a = glm::dot(points[0], axes[axis]), b = glm::dot(points[1], axes[axis]),
                 c = glm::dot(points[2], axes[axis]), d = glm::dot(points[3], axes[axis]);
    e.low[axis] = std::min(std::min(a, b), std::min(c, d));
    e.high[axis] = std::max(std::max(a, b), std::max(c, d));
  }
  return e;
}

// The domain shader over a box of parameters. The normal of a point where the derivatives may be parallel or vanish is
// any unit vector, up to the rounding of its normalisation.
//
// Control points are taken relative to the first: their common part would be multiplied by weights whose sum is 1,
// which enclosures do not see. The float rounding that it brings back is `rounding` in the derivatives, and the vertex
// margin in the position.
Vector3<Enclosure> domain_box(const PatchNet& net, const scene::ParameterRange& r, bool displaced,
                              const ValueRange& offset, double rounding) {
  const DVec3 origin = net.point(0);
  shaders::ControlPoints<Enclosure> c;
  for (std::size_t k = 0; k < 16; ++k) c[k] = {net.c[0][k] - origin.x, net.c[1][k] - origin.y, net.c[2][k] - origin.z};
  const auto u = Enclosure::first_parameter(static_cast<double>(r.u0), static_cast<double>(r.u1));
  const auto v = Enclosure::second_parameter(static_cast<double>(r.v0), static_cast<double>(r.v1));
  const auto p = shaders::bicubic_point<Enclosure>(shaders::bicubic_row(c, v), u);
  const Vector3<Enclosure> position = p.position + Vector3<Enclosure>{origin.x, origin.y, origin.z};
  if (!displaced) return position;
  const auto rounded = [&](const Vector3<Enclosure>& d) {
    return Vector3<Enclosure>{d.x.with_error(rounding), d.y.with_error(rounding), d.z.with_error(rounding)};
  };
  const auto regular = shaders::regular_normal(rounded(p.derivative_u), rounded(p.derivative_v));
  constexpr double kUnit = 1 + 0x1p-20;
  const auto unit = Enclosure::anything_in(-kUnit, kUnit);
  Vector3<Enclosure> n = {unit, unit, unit};
  const auto within = [&](const Enclosure& x) {
    return Enclosure::anything_in(std::max(x.low(), -kUnit), std::min(x.high(), kUnit));
  };
  if (regular.margin.low() > 0) n = {within(regular.normal.x), within(regular.normal.y), within(regular.normal.z)};
  return position + n * Enclosure::anything_in(static_cast<double>(offset.low), static_cast<double>(offset.high));
}

void extend(MovingBox& box, std::size_t key, const Vector3<Enclosure>& p) {
  extend(box, key, 0, p.x.low(), p.x.high());
  extend(box, key, 1, p.y.low(), p.y.high());
  extend(box, key, 2, p.z.low(), p.z.high());
}

double largest_of_net(const PatchNet& net) {
  double largest = 0;
  for (const auto& coordinate : net.c)
    for (const double x : coordinate) largest = std::max(largest, std::abs(x));
  return largest;
}

// Throws if the tables do not fit into the memory left after reading the capture: one table of values for each texture
// and, where a single-sided material uses it, one of slopes along each coordinate and one of differences of levels.
void check_tables(const scene::Assembly& assembly) {
  const scene::Capture& capture = *assembly.capture;
  scene::MemoryBudget budget(capture.max_bytes, capture.file.string(), assembly.charged_bytes());
  std::map<const void*, std::uint64_t> tables;
  const auto charge = [&](const void* texture, int width, int height, std::uint64_t wanted, const char* what) {
    std::uint64_t& have = tables[texture];
    if (wanted <= have) return;
    // All levels of detail together have a third more texels than the first.
    const std::uint64_t texels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) * 4 / 3 + 1;
    budget.charge(texels * (wanted - have), WindowTable::kMaxBytesPerTexel, what);
    have = wanted;
  };
  for (const scene::Material& material : assembly.materials) {
    if (material.displacement) {
      const shaders::ScalarTexture::Level& heights = material.displacement->texture->levels().front();
      charge(&heights, heights.width, heights.height, material.double_sided ? 1 : 4, "a table of heights");
    }
    const auto& color = material.base_color_texture.texture;
    if (material.alpha_mode == scene::AlphaMode::kMask && color != nullptr && !color->opaque())
      charge(color.get(), color->width(), color->height(), 1, "a table of alpha");
  }
}

}  // namespace

PyramidLibrary::PyramidLibrary(const scene::Assembly& assembly) {
  check_tables(assembly);
  std::uint64_t address = 0;
  for (const scene::Material& material : assembly.materials) {
    if (!material.displacement) continue;
    auto& slot = pyramids_[material.displacement->texture.get()];
    if (slot != nullptr) continue;
    slot = std::make_unique<MinMaxPyramid>(*material.displacement->texture);
    address = slot->place(address);
  }
  for (const scene::Material& material : assembly.materials) {
    if (!material.displacement || material.double_sided) continue;
    const shaders::ScalarTexture* texture = material.displacement->texture.get();
    if (slopes_[texture] != nullptr) continue;
    slopes_[texture] = std::make_unique<SlopePyramid>(*texture);
    level_differences_[texture] = std::make_unique<LevelDifferences>(*texture);
    address = level_differences_[texture]->place(slopes_[texture]->place(address));
  }
  for (const scene::Material& material : assembly.materials) {
    const auto& texture = material.base_color_texture.texture;
    if (material.alpha_mode != scene::AlphaMode::kMask || texture == nullptr || texture->opaque()) continue;
    auto& slot = alphas_[texture.get()];
    if (slot != nullptr) continue;
    std::vector<float> alpha;
    alpha.reserve(static_cast<std::size_t>(texture->width()) * static_cast<std::size_t>(texture->height()));
    for (int y = 0; y < texture->height(); ++y)
      for (int x = 0; x < texture->width(); ++x) alpha.push_back(texture->texel(0, x, y).w);
    slot =
        std::make_unique<MinMaxPyramid>(shaders::ScalarTexture(texture->width(), texture->height(), std::move(alpha)));
  }
}

const MinMaxPyramid* PyramidLibrary::alpha_of(const shaders::Texture& texture) const {
  const auto found = alphas_.find(&texture);
  return found == alphas_.end() ? nullptr : found->second.get();
}

void SubPatchBounder::begin(std::uint32_t patch) {
  patch_ = patch;
  drawable_ = &frame_.drawable_of(patch);
  bezier_ = drawable_->drawable->kind == scene::Primitive::Kind::kBezierPatches;
  displaced_ = bezier_ && drawable_->material->displacement.has_value();
  foreign_boundary_ = false;
  keys_ = drawable_->deforming ? 2 : 1;
  to_raster_ = {DMat4(drawable_->to_raster[0]), DMat4(drawable_->to_raster[1])};
  way_.fill(DMat4(drawable_->to_raster[1] - drawable_->to_raster[0]));
  largest_ = rounding_ = 0;
  offsets_ = foreign_offsets_ = {0, 0};
  if (drawable_->procedure != nullptr) procedure_patch_ = procedure_patch(frame_, patch);
  if (!bezier_) return;
  pattern_ = &frame_.pattern_of(patch);
  for (std::size_t key = 0; key < keys_; ++key) {
    base_[key] = make_net(frame_.control_points(*drawable_, patch, static_cast<int>(key)));
    largest_ = std::max(largest_, largest_of_net(base_[key]));
    rounding_ = std::max(rounding_, derivative_rounding(base_[key]));
  }
  if (!displaced_) return;
  displacement_ = patch_displacement(frame_, *drawable_, patch);
  heights_ = &pyramids_.of(*displacement_.material->texture);
  begin_edges(patch);
}

void SubPatchBounder::fetch_owner(std::uint32_t owner) const {
  if (fetches_ == nullptr || owner == patch_) return;
  fetches_->fetch_record(frame_.assembly->record_of(owner), patch_record_bytes(frame_, owner),
                         decoded_elements(*frame_.assembly, owner));
}

void SubPatchBounder::begin_edges(std::uint32_t patch) {
  const std::uint32_t first = drawable_->drawable->first_patch;
  const scene::PatchNeighbours& neighbours = frame_.assembly->neighbours[drawable_->drawable->geometry][patch - first];
  for (std::size_t c = 0; c < 4; ++c) {
    const scene::PatchNeighbours::CornerOwner& owner = neighbours.corners[c];
    const Vec2 at = scene::corner_parameters(owner.corner);
    const scene::PatchDisplacement displacement = patch_displacement(frame_, *drawable_, owner.patch + first);
    corner_offsets_[c] = displacement.offset(at.x, at.y);
    fetch_owner(owner.patch + first);
    if (fetches_ != nullptr)
      pyramids_.of(*displacement.material->texture)
          .fetch_texels(displacement.material->sampler, displacement.coordinate(at.x, at.y), displacement.lod,
                        *fetches_);
    for (std::size_t key = 0; key < keys_; ++key)
      corners_[key][c] = DVec3(domain_point(frame_, *drawable_, owner.patch + first, at.x, at.y, key));
  }
  for (std::size_t e = 0; e < 4; ++e) {
    const scene::PatchNeighbours::EdgeOwner& owner = neighbours.edges[e];
    ForeignEdge& edge = edges_[e];
    edge.collapsed = owner.collapsed;
    edge.active = owner.collapsed || owner.patch + first != patch || owner.edge != e;
    edge.corner = e == 1 ? 2 : e == 3 ? 1 : 0;
    if (!edge.active || edge.collapsed) continue;
    fetch_owner(owner.patch + first);
    edge.owner_edge = owner.edge;
    edge.reversed = owner.reversed;
    edge.displacement = patch_displacement(frame_, *drawable_, owner.patch + first);
    edge.rounding = 0;
    for (std::size_t key = 0; key < keys_; ++key) {
      const PatchNet net = make_net(frame_.control_points(*drawable_, owner.patch + first, static_cast<int>(key)));
      largest_ = std::max(largest_, largest_of_net(net));
      edge.rounding = std::max(edge.rounding, derivative_rounding(net));
      edge.points[key] = edge_points(net, owner.edge);
      edge.across[key] = edge_across(net, owner.edge);
    }
  }
}

ValueRange SubPatchBounder::offset_range(const scene::PatchDisplacement& d, const scene::ParameterRange& r) const {
  const scene::PatchDisplacement::Footprint f = d.footprint(r);
  return offsets_of(d, heights_->query(d.material->sampler, f.low, f.high, d.lod, fetches_));
}

ValueRange SubPatchBounder::offsets_of(const scene::PatchDisplacement& d, const ValueRange& heights) {
  const float a = d.material->scale * heights.low + d.material->bias,
              b = d.material->scale * heights.high + d.material->bias;
  return {std::min(a, b), std::max(a, b)};
}

void SubPatchBounder::bound_interior(const CornerFrame& frame, MovingBox& box) {
  const bool cones = displaced_ && (method_ == BoundMethod::kTpatch || method_ == BoundMethod::kNpatch);
  const scene::ParameterRange& r = inner_range_;
  const DerivativeError error{rounding_, static_cast<double>(r.u1) - static_cast<double>(r.u0),
                              static_cast<double>(r.v1) - static_cast<double>(r.v0)};
  for (std::size_t key = 0; key < keys_; ++key) {
    const PatchNet& net = all_inner_ ? nets()[key] : inner_nets_[key];
    if (!cones) {
      extend_displaced(box, key, measure_extents(net, frame.axes), offsets_, {});
      continue;
    }
    const NetMeasure measure = measure_net(net, frame.axes, frame.tangent_u, frame.tangent_v);
    std::optional<NormalCone> cone;
    if (const auto tangents = tangent_cones(measure, frame)) cone = tpatch_cone(*tangents, error);
    if (method_ == BoundMethod::kNpatch) cone = npatch_cone(net, measure, frame, cone, error);
    extend_displaced(box, key, measure.extents, offsets_, normal_range(cone));
  }
}

void SubPatchBounder::bound_interval(MovingBox& box) {
  for (std::size_t key = 0; key < keys_; ++key)
    extend(box, key, domain_box(base_[key], inner_range_, displaced_, offsets_, rounding_));
}

SubPatchBounder::EdgePart SubPatchBounder::edge_part(const ForeignEdge& edge, std::size_t e,
                                                     const scene::ParameterRange& range) {
  const bool along_u = e < 2;
  float a = along_u ? range.u0 : range.v0, b = along_u ? range.u1 : range.v1;
  if (edge.reversed) std::tie(a, b) = std::pair(1.0f - b, 1.0f - a);
  const float fixed = edge.owner_edge == 1 || edge.owner_edge == 3 ? 1.0f : 0.0f;
  return {a, b,
          edge.owner_edge < 2 ? scene::ParameterRange{a, fixed, b, fixed} : scene::ParameterRange{fixed, a, fixed, b}};
}

void SubPatchBounder::bound_foreign_edge(const ForeignEdge& edge, std::size_t e, MovingBox& box) {
  const EdgePart part = edge_part(edge, e, range_);
  const bool owner_along_u = edge.owner_edge < 2;
  const ValueRange offset = offset_range(edge.displacement, part.strip);
  foreign_offsets_ = foreign_offsets_.hull(offset);
  const double a = static_cast<double>(part.first), b = static_cast<double>(part.last), scale = b - a;
  const auto rows = cubic_restriction(a, b);
  const bool cones = method_ == BoundMethod::kTpatch || method_ == BoundMethod::kNpatch;
  for (std::size_t key = 0; key < keys_; ++key) {
    const std::array<DVec3, 4> points = restrict_cubic(edge.points[key], rows);
    NormalRange normals;
    if (cones) {
      const std::array<DVec3, 3> along = {points[1] - points[0], points[2] - points[1], points[3] - points[2]};
      normals = normal_range(
          edge_cone(along, restrict_cubic(edge.across[key], rows), !owner_along_u, box.axes[2], edge.rounding, scale));
    }
    extend_displaced(box, key, extents_of(points, box.axes), offset, normals);
  }
}

std::array<bool, 4> SubPatchBounder::touched_edges(const scene::CellRange& cells) const {
  const scene::TessellationPattern& pattern = *pattern_;
  return {cells.j0 == 0, cells.j1 == pattern.nv, cells.i0 == 0, cells.i1 == pattern.nu};
}

std::array<bool, 4> SubPatchBounder::touched_corners(const scene::ParameterRange& range) {
  std::array<bool, 4> corner{};
  for (std::size_t c = 0; c < 4; ++c)
    corner[c] =
        ((c & 1) != 0 ? range.u1 >= 1.0f : range.u0 <= 0.0f) && ((c & 2) != 0 ? range.v1 >= 1.0f : range.v0 <= 0.0f);
  return corner;
}

void SubPatchBounder::bound_foreign_vertices(const scene::CellRange& cells, MovingBox& box) {
  const std::array<bool, 4> touches = touched_edges(cells);
  std::array<bool, 4> corner = touched_corners(range_);
  for (std::size_t e = 0; e < 4; ++e) {
    if (!touches[e] || !edges_[e].active) continue;
    foreign_boundary_ = true;
    if (edges_[e].collapsed)
      corner[edges_[e].corner] = true;
    else
      bound_foreign_edge(edges_[e], e, box);
  }
  for (std::size_t c = 0; c < 4; ++c) {
    if (!corner[c]) continue;
    foreign_boundary_ = true;
    foreign_offsets_ = foreign_offsets_.hull({corner_offsets_[c], corner_offsets_[c]});
    for (std::size_t key = 0; key < keys_; ++key)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double s = glm::dot(corners_[key][c], box.axes[axis]);
        extend(box, key, axis, s, s);
      }
  }
}

MovingBox SubPatchBounder::cluster_box() const {
  const scene::ClusterBound* bound = resting_bound(frame_, patch_);
  if (bound != nullptr) return oriented() ? resting_box(*bound) : aligned_box(*bound);
  const scene::MeshClusters& clusters = frame_.assembly->clusters[drawable_->drawable->geometry];
  const scene::Cluster& cluster = clusters.clusters[patch_ - drawable_->drawable->first_patch];
  return point_box(drawable_->positions[0], drawable_->positions[1],
                   std::span(clusters.vertices).subspan(cluster.first_vertex, cluster.vertex_count));
}

// At an edge whose vertices belong to another patch, the patch's own net and heights only bound the vertices behind
// them; at a pole, whose net has no normal, all vertices but the pole.
scene::CellRange SubPatchBounder::inner_cells(const scene::CellRange& cells) const {
  if (!displaced_) return cells;
  const std::array<bool, 4> touches = touched_edges(cells);
  scene::CellRange inner = cells;
  const auto shrink = [](bool foreign, std::uint8_t& low, std::uint8_t& high, bool at_low) {
    if (foreign && high - low >= 2) at_low ? ++low : --high;
  };
  shrink(touches[0] && edges_[0].active, inner.j0, inner.j1, true);
  shrink(touches[1] && edges_[1].active, inner.j0, inner.j1, false);
  shrink(touches[2] && edges_[2].active, inner.i0, inner.i1, true);
  shrink(touches[3] && edges_[3].active, inner.i0, inner.i1, false);
  return inner;
}

void SubPatchBounder::begin_inner(const scene::CellRange& cells) {
  const scene::CellRange inner = inner_cells(cells);
  inner_range_ = range_;
  all_inner_ = inner == cells;
  if (!all_inner_) {
    inner_range_ = parameter_range(*pattern_, inner);
    for (std::size_t key = 0; key < keys_; ++key) inner_nets_[key] = restrict_net(base_[key], inner_range_);
  }
  if (displaced_) offsets_ = offset_range(displacement_, inner_range_);
}

std::span<const PatchNet> SubPatchBounder::nets() const {
  if (!nets_made_)
    for (std::size_t key = 0; key < keys_; ++key) nets_[key] = restrict_net(base_[key], range_);
  nets_made_ = true;
  return {nets_.data(), keys_};
}

bool SubPatchBounder::offsets_vanish() const {
  const auto zero = [](const ValueRange& range) { return range.low == 0 && range.high == 0; };
  return zero(offsets_) && zero(foreign_offsets_) && (all_inner_ || zero(offsets()));
}

MovingBox SubPatchBounder::box(const scene::CellRange& cells) {
  foreign_boundary_ = false;
  foreign_offsets_ = {0, 0};
  if (drawable_->procedure != nullptr) {
    range_ = parameter_range(frame_.pattern_of(patch_), cells);
    const MovingBox box = procedure_box(procedure_patch_, range_);
    for (std::size_t key = 0; key < keys_; ++key)
      for (std::size_t axis = 0; axis < 3; ++axis)
        largest_ = std::max({largest_, std::abs(box.low[key][axis]), std::abs(box.high[key][axis])});
    return box;
  }
  if (!bezier_) return cluster_box();
  range_ = parameter_range(*pattern_, cells);
  nets_made_ = false;
  begin_inner(cells);
  const CornerFrame frame = oriented() ? corner_frame(nets()) : CornerFrame{};
  MovingBox box = empty_box(frame.axes);
  if (method_ == BoundMethod::kInterval)
    bound_interval(box);
  else
    bound_interior(frame, box);
  if (displaced_) bound_foreign_vertices(cells, box);
  if (keys_ == 1) {
    box.low[1] = box.low[0];
    box.high[1] = box.high[0];
  }
  return box;
}

SubPatchBody SubPatchBounder::body_of(const MovingBox& box) const {
  const auto subpixels = static_cast<double>(frame_.request.subpixels());
  SubPatchBody body{
      corners_of_box(box, to_raster_), vertex_rounding_margin(box, largest_, to_raster_, subpixels), {}, box};
  if (!drawable_->moving) return body;
  // The vertex rule of kStillPixels leaves a vertex up to that far behind.
  body.margin.pixels += static_cast<double>(scene::kStillPixels);
  body.motion_margin = vertex_rounding_margin(box, largest_, way_, subpixels);
  return body;
}

SubPatchBody SubPatchBounder::body(const scene::CellRange& cells) {
  const scene::ClusterBound* bound = resting_bound(frame_, patch_);
  bounded_twice_ = false;
  if (bound != nullptr && bound->turned() && oriented()) {
    const SubPatchBody aligned = body_of(aligned_box(*bound));
    if (outside_view(aligned, frame_)) return aligned;
    bounded_twice_ = true;
  }
  return body_of(box(cells));
}

}  // namespace tessera::frontend

// Vertices on shared edges and corners, which the patches that own them evaluate: their largest distance from the place
// where a patch's own evaluation would put them.
#include <algorithm>
#include <cmath>

#include "frontend/bounds/sub_patch_bounder.h"
#include "scene/domain_shader.h"

namespace tessera::frontend {
namespace {

// A coordinate's float arithmetic rounds by less than this part of it.
constexpr float kCoordinateRounding = 0x1p-20f;

struct EdgeCorners {
  std::size_t first, last;
};
constexpr std::array<EdgeCorners, 4> kEdgeCorners = {{{0, 1}, {2, 3}, {0, 2}, {1, 3}}};

// Whole periods of a texture between two coordinates.
float periods(shaders::Wrap wrap, float difference) {
  if (wrap == shaders::Wrap::kClampToEdge || !std::isfinite(difference)) return 0;
  return wrap == shaders::Wrap::kRepeat ? std::round(difference) : 2 * std::round(difference / 2);
}

}  // namespace

std::optional<double> SubPatchBounder::height_error(const ForeignEdge& edge, std::size_t e) const {
  const scene::PatchDisplacement &own = displacement_, &owner = edge.displacement;
  const shaders::Sampler& sampler = own.material->sampler;
  EdgeCorners at = kEdgeCorners[edge.owner_edge];
  if (edge.reversed) std::swap(at.first, at.last);
  const Vec2 from = own.corner[kEdgeCorners[e].first], to = own.corner[kEdgeCorners[e].last];
  const Vec2 first = from - owner.corner[at.first], last = to - owner.corner[at.last];
  const Vec2 turns(periods(sampler.wrap_s, first.x), periods(sampler.wrap_t, first.y));
  // Where both patches read the same place this is rounding alone; the box of the lookup holds the segment between the
  // two places.
  const Vec2 apart = glm::max(glm::abs(first - turns), glm::abs(last - turns)) +
                     kCoordinateRounding * (glm::abs(turns) + glm::max(glm::abs(from), glm::abs(to)));
  if (!(apart.x < 0.01f && apart.y < 0.01f)) return std::nullopt;
  const scene::ParameterRange& r = range_;
  const scene::ParameterRange strips[] = {
      {r.u0, 0, r.u1, 0}, {r.u0, 1, r.u1, 1}, {0, r.v0, 0, r.v1}, {1, r.v0, 1, r.v1}};
  scene::PatchDisplacement::Footprint f = own.footprint(strips[e]);
  f.low -= apart, f.high += apart;
  const shaders::ScalarTexture& texture = *own.material->texture;
  const float levels =
      pyramids_.level_differences_of(texture).query(sampler, f.low, f.high, own.lod, owner.lod, fetches_);
  const HeightSlopes slopes = pyramids_.slopes_of(texture).query(sampler, f.low, f.high, owner.lod, fetches_);
  const float heights = levels + apart.x * slopes.along_s.largest() + apart.y * slopes.along_t.largest();
  return std::abs(static_cast<double>(own.material->scale)) * static_cast<double>(heights);
}

// Length of the difference of two unit normals on an edge, the owner's rounding included. Both are cross products of the
// edge's tangent p' with a derivative across it. With the owner's as w a + r of this patch's a, they are apart by no
// more than q / (1 - q), q = |p'| |r| / (w |p' x a|).
std::optional<double> SubPatchBounder::normal_error(const ForeignEdge& edge, std::size_t e,
                                                    std::span<const TangentCones> tangents) const {
  const bool along_u = e < 2, owner_along_u = edge.owner_edge < 2;
  const double a = static_cast<double>(along_u ? range_.u0 : range_.v0),
               b = static_cast<double>(along_u ? range_.u1 : range_.v1);
  const double turned = (along_u == owner_along_u ? 1.0 : -1.0) * (edge.reversed ? -1.0 : 1.0);
  const auto rows = cubic_restriction(a, b);
  double worst = 0;
  for (std::size_t key = 0; key < keys_; ++key) {
    const std::array<DVec3, 4> own = restrict_cubic(edge_across(base_[key], e), rows);
    std::array<DVec3, 4> whole = edge.across[key];
    if (edge.reversed) std::reverse(whole.begin(), whole.end());
    std::array<DVec3, 4> owner = restrict_cubic(whole, rows);
    double together = 0, length2 = 0, rest = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      owner[k] *= turned;
      together += glm::dot(own[k], owner[k]);
      length2 += glm::dot(own[k], own[k]);
    }
    const double weight = together / length2;
    if (!(weight > 0)) return std::nullopt;
    for (std::size_t k = 0; k < 4; ++k) rest = std::max(rest, glm::length(owner[k] - own[k] * weight));
    // Least lengths by the base patch's parameters, a third of the derivatives.
    const TangentCones& t = tangents[key];
    const double du = static_cast<double>(range_.u1) - static_cast<double>(range_.u0),
                 dv = static_cast<double>(range_.v1) - static_cast<double>(range_.v0);
    const double across = along_u ? t.min_length_v / dv : t.min_length_u / du,
                 along = along_u ? t.min_length_u / du : t.min_length_v / dv;
    const double q = rest / (weight * across * t.min_sine);
    if (!(q < 0.5)) return std::nullopt;
    // The owner's derivatives span no less than a third of the sine of this patch's.
    const double rounding =
        3 / t.min_sine * (edge.rounding * (1 / (3 * along) + 1 / (3 * across * weight * (1 - q))) + 32 * 0x1p-24);
    if (!(rounding < 0x1p-6)) return std::nullopt;
    worst = std::max(worst, q / (1 - q) + rounding);
  }
  return worst;
}

SubPatchBounder::ForeignError SubPatchBounder::corner_error(std::size_t corner) const {
  constexpr std::array<std::size_t, 4> kPoint = {0, 3, 12, 15};
  const Vec2 at = scene::corner_parameters(corner);
  if (fetches_ != nullptr)
    pyramids_.of(*displacement_.material->texture)
        .fetch_texels(displacement_.material->sampler, displacement_.coordinate(at.x, at.y), displacement_.lod,
                      *fetches_);
  ForeignError error;
  for (std::size_t key = 0; key < keys_; ++key) {
    const DVec3 apart = corners_[key][corner] - DVec3(domain_point(frame_, *drawable_, patch_, at.x, at.y, key));
    const PatchNet& net = base_[key];
    const std::size_t k = kPoint[corner], inner_u = (corner & 1) != 0 ? k - 1 : k + 1,
                      inner_v = (corner & 2) != 0 ? k - 4 : k + 4;
    const DVec3 n = glm::cross(net.point(inner_u) - net.point(k), net.point(inner_v) - net.point(k));
    const double length = glm::length(n);
    const DVec3 unit = length > 0 ? n / length : DVec3(0.0);
    const double along = glm::dot(apart, unit);
    error.along_normal = std::max(error.along_normal, std::abs(along));
    error.besides = std::max(error.besides, glm::length(apart - unit * along));
  }
  return error;
}

std::optional<SubPatchBounder::ForeignError> SubPatchBounder::foreign_error(
    const scene::CellRange& cells, std::span<const TangentCones> tangents) const {
  ForeignError error;
  const std::array<bool, 4> touches = touched_edges(cells), corners = touched_corners(range_);
  const double reach = static_cast<double>(offsets().largest());
  for (std::size_t e = 0; e < 4; ++e) {
    if (!touches[e] || !edges_[e].active) continue;
    if (edges_[e].collapsed) return std::nullopt;
    const auto heights = height_error(edges_[e], e);
    const auto normals = heights ? normal_error(edges_[e], e, tangents) : std::nullopt;
    if (!normals) return std::nullopt;
    error.along_normal = std::max(error.along_normal, *heights);
    error.besides = std::max(error.besides, *normals * (reach + *heights));
  }
  for (std::size_t c = 0; c < 4; ++c) {
    if (!corners[c]) continue;
    const ForeignError at = corner_error(c);
    error.along_normal = std::max(error.along_normal, at.along_normal);
    error.besides = std::max(error.besides, at.besides);
  }
  return error;
}

}  // namespace tessera::frontend

#include "tilecore/shading/surface.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/half_float.h"
#include "scene/patch_displacement.h"
#include "shaders_cpp/bicubic.h"
#include "tilecore/procedural/procedure_surface.h"

namespace tessera::tilecore {
namespace {

using scene::FrameGeometry;
using scene::PosedDrawable;

Vec3 glm_vector(const Vector3<float>& a) { return {a.x, a.y, a.z}; }

Vec3 unit_or(const Vec3& v, const Vec3& fallback) {
  const float length2 = glm::dot(v, v);
  return length2 > 1e-30f && std::isfinite(length2) ? v / std::sqrt(length2) : fallback;
}

// Value at time t of something that moves linearly between the keys.
template <class T>
T at_time(const T& open, const T& close, float t) {
  return open * (1.0f - t) + close * t;
}

// Inverse of the projection's Jacobian: how (p, q) change per pixel. `r` is the raster-space point.
glm::mat2 parameters_by_pixel(const Vec4& r, const Vec4& r_p, const Vec4& r_q, bool orthographic) {
  const float w = orthographic ? 1.0f : r.w;
  const auto screen = [&](const Vec4& d) {
    if (orthographic) return Vec2(d.x, d.y);
    return Vec2(d.x - r.x / w * d.w, d.y - r.y / w * d.w) / w;
  };
  const Vec2 by_p = screen(r_p), by_q = screen(r_q);
  const float det = by_p.x * by_q.y - by_p.y * by_q.x;
  if (!(std::abs(det) > 1e-20f) || !std::isfinite(1.0f / det)) return glm::mat2(0.0f);
  return glm::mat2(by_q.y, -by_p.y, -by_q.x, by_p.x) / det;
}

void set_raster(Surface& s, const Vec4& r, const Vec4& r_p, const Vec4& r_q, bool orthographic) {
  s.raster = r, s.raster_p = r_p, s.raster_q = r_q;
  s.parameters_by_pixel = parameters_by_pixel(r, r_p, r_q, orthographic);
}

// Weights of the attributes' corners.
void set_triangle_weights(Surface& s, const std::array<std::uint32_t, 3>& vertices, float b1, float b2) {
  s.corner_count = 3;
  for (std::size_t k = 0; k < 3; ++k) s.vertex[k] = vertices[k];
  s.weight = {1.0f - b1 - b2, b1, b2, 0.0f};
  s.weight_p = {-1.0f, 1.0f, 0.0f, 0.0f};
  s.weight_q = {-1.0f, 0.0f, 1.0f, 0.0f};
}

void set_bilinear_weights(Surface& s, std::uint32_t first_vertex, float u, float v) {
  s.corner_count = 4;
  s.vertex = {first_vertex, first_vertex + 3, first_vertex + 12, first_vertex + 15};
  s.weight = {(1.0f - u) * (1.0f - v), u * (1.0f - v), (1.0f - u) * v, u * v};
  s.weight_p = {v - 1.0f, 1.0f - v, -v, v};
  s.weight_q = {u - 1.0f, -u, 1.0f - u, u};
}

// ---- Bezier patches ---------------------------------------------------------------------------------------------

// (u, v) of a triangle's point, from the parameters of its grid vertices.
Vec2 patch_parameters(const scene::TessellationPattern& pattern, const SurfaceLocation& at) {
  if (at.triangle >= SurfaceLocation::kLine) return {at.b1, at.b2};
  const int cell = static_cast<int>(at.triangle / 2), i = cell % pattern.nu, j = cell / pattern.nu;
  const auto vertex = [&](int di, int dj) { return Vec2(pattern.u(i + di, j + dj), pattern.v(i + di, j + dj)); };
  const Vec2 a = vertex(0, 0), c = vertex(1, 1);
  // Triangles (a, b, c) and (a, c, d).
  const Vec2 second = at.triangle % 2 == 0 ? vertex(1, 0) : c, third = at.triangle % 2 == 0 ? c : vertex(0, 1);
  return a * (1.0f - at.b1 - at.b2) + second * at.b1 + third * at.b2;
}

// Position, tangents and normal of the (displaced) patch in object space at one key.
struct ObjectPoint {
  Vec3 position, derivative_u, derivative_v, normal;
};

ObjectPoint bezier_point(const FrameGeometry& frame, const PosedDrawable& drawable, std::uint32_t patch, Vec2 uv,
                         std::size_t key) {
  shaders::ControlPoints<float> c;
  const auto points = frame.control_points(drawable, patch, static_cast<int>(key));
  for (std::size_t i = 0; i < 16; ++i) c[i] = {points[i].x, points[i].y, points[i].z};
  const shaders::SurfacePoint<float> p = shaders::bicubic_point<float>(shaders::bicubic_row(c, uv.y), uv.x);
  const Vec3 normal = glm_vector(shaders::bicubic_normal(c, uv.x, uv.y, p));
  ObjectPoint out{glm_vector(p.position), glm_vector(p.derivative_u), glm_vector(p.derivative_v), normal};
  if (!drawable.material->displacement) return out;

  // d = p + n h: tangents p_u + n_u h + n h_u with n_u from the second derivatives (Weingarten).
  const scene::PatchDisplacement displacement = scene::patch_displacement(frame, drawable, patch);
  const Vec2 st = displacement.coordinate(uv.x, uv.y);
  const auto gradient =
      displacement.material->texture->sample_gradient(displacement.material->sampler, st, displacement.lod);
  const float scale = displacement.material->scale, h = scale * gradient.height + displacement.material->bias;
  const auto& k = displacement.corner;
  const Vec2 st_u = (k[1] - k[0]) * (1.0f - uv.y) + (k[3] - k[2]) * uv.y,
             st_v = (k[2] - k[0]) * (1.0f - uv.x) + (k[3] - k[1]) * uv.x;
  const float h_u = scale * (gradient.d_s * st_u.x + gradient.d_t * st_u.y),
              h_v = scale * (gradient.d_s * st_v.x + gradient.d_t * st_v.y);
  const shaders::SecondDerivatives<float> second = shaders::bicubic_second_derivatives(c, uv.x, uv.y);
  const Vec3 cross = glm::cross(out.derivative_u, out.derivative_v);
  const float length = glm::length(cross);
  const auto normal_change = [&](const Vec3& du_change, const Vec3& dv_change) {
    if (!(length > 1e-20f)) return Vec3(0.0f);
    const Vec3 change = glm::cross(du_change, out.derivative_v) + glm::cross(out.derivative_u, dv_change);
    return (change - normal * glm::dot(normal, change)) / length;
  };
  const Vec3 n_u = normal_change(glm_vector(second.uu), glm_vector(second.uv)),
             n_v = normal_change(glm_vector(second.uv), glm_vector(second.vv));
  out.position += normal * h;
  out.derivative_u += n_u * h + normal * h_u;
  out.derivative_v += n_v * h + normal * h_v;
  out.normal = unit_or(glm::cross(out.derivative_u, out.derivative_v), normal);
  return out;
}

void fill_bezier(const FrameGeometry& frame, const SurfaceLocation& at, Surface& s) {
  const PosedDrawable& drawable = *s.drawable;
  const Vec2 uv = patch_parameters(frame.pattern_of(at.patch), at);
  set_bilinear_weights(s, 16 * (at.patch - drawable.drawable->first_patch), uv.x, uv.y);
  std::array<ObjectPoint, 2> point;
  point[0] = bezier_point(frame, drawable, at.patch, uv, 0);
  point[1] = drawable.deforming ? bezier_point(frame, drawable, at.patch, uv, 1) : point[0];
  const auto mix = [&](auto&& value) { return at_time(value(0), value(1), at.t); };
  s.position = mix([&](std::size_t k) { return Vec3(drawable.to_world[k] * Vec4(point[k].position, 1.0f)); });
  s.position_p = mix([&](std::size_t k) { return Mat3(drawable.to_world[k]) * point[k].derivative_u; });
  s.position_q = mix([&](std::size_t k) { return Mat3(drawable.to_world[k]) * point[k].derivative_v; });
  s.normal = unit_or(mix([&](std::size_t k) { return drawable.normal_to_world[k] * point[k].normal; }), Vec3(0, 0, 1));
  s.geometric_normal = s.normal;
  const Vec4 r = mix([&](std::size_t k) { return drawable.to_raster[k] * Vec4(point[k].position, 1.0f); });
  const Vec4 r_p = mix([&](std::size_t k) { return drawable.to_raster[k] * Vec4(point[k].derivative_u, 0.0f); });
  const Vec4 r_q = mix([&](std::size_t k) { return drawable.to_raster[k] * Vec4(point[k].derivative_v, 0.0f); });
  set_raster(s, r, r_p, r_q, frame.projection.orthographic);
}

// ---- Clusters ---------------------------------------------------------------------------------------------------

std::array<std::uint32_t, 3> cluster_triangle(const FrameGeometry& frame, const PosedDrawable& drawable,
                                              const SurfaceLocation& at) {
  const scene::MeshClusters& clusters = frame.assembly->clusters[drawable.drawable->geometry];
  const scene::Cluster& cluster = clusters.clusters[at.patch - drawable.drawable->first_patch];
  const auto& corner = clusters.cells[cluster.first_cell + at.triangle / 2].corner;
  const auto vertex = [&](std::size_t k) { return clusters.vertices[cluster.first_vertex + corner[k]]; };
  if (at.triangle % 2 == 0) return {vertex(0), vertex(1), vertex(2)};
  return {vertex(0), vertex(2), vertex(3)};
}

// Where a cluster's triangle with these vertices is on screen; its weights are known.
void set_cluster_raster(const FrameGeometry& frame, const std::array<std::uint32_t, 3>& v, float t, Surface& s) {
  const PosedDrawable& drawable = *s.drawable;
  std::array<Vec4, 3> raster;
  for (std::size_t k = 0; k < 3; ++k)
    raster[k] = at_time(drawable.to_raster[0] * Vec4(drawable.positions[0][v[k]], 1.0f),
                        drawable.to_raster[1] * Vec4(drawable.positions[1][v[k]], 1.0f), t);
  const Vec4 r = raster[0] * s.weight[0] + raster[1] * s.weight[1] + raster[2] * s.weight[2];
  set_raster(s, r, raster[1] - raster[0], raster[2] - raster[0], frame.projection.orthographic);
}

void fill_cluster(const FrameGeometry& frame, const SurfaceLocation& at, Surface& s) {
  const PosedDrawable& drawable = *s.drawable;
  const std::array<std::uint32_t, 3> v = cluster_triangle(frame, drawable, at);
  set_triangle_weights(s, v, at.b1, at.b2);
  std::array<Vec3, 3> world;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec4 p0(drawable.positions[0][v[k]], 1.0f), p1(drawable.positions[1][v[k]], 1.0f);
    world[k] = at_time(Vec3(drawable.to_world[0] * p0), Vec3(drawable.to_world[1] * p1), at.t);
  }
  // Without the translation: far from the world's origin differences of positions are coarse.
  const auto side = [&](std::size_t k) {
    const auto edge = [&](std::size_t key) {
      return Mat3(drawable.to_world[key]) * (drawable.positions[key][v[k]] - drawable.positions[key][v[0]]);
    };
    return at_time(edge(0), edge(1), at.t);
  };
  s.position_p = side(1);
  s.position_q = side(2);
  s.position = world[0] * s.weight[0] + world[1] * s.weight[1] + world[2] * s.weight[2];
  const float winding = drawable.mirrored ? -1.0f : 1.0f;
  s.geometric_normal = unit_or(glm::cross(s.position_p, s.position_q) * winding, Vec3(0, 0, 1));
  s.normal = s.geometric_normal;
  if (!drawable.normals[0].empty()) {
    Vec3 sum(0.0f);
    for (std::size_t k = 0; k < 3; ++k)
      sum += at_time(drawable.normal_to_world[0] * drawable.normals[0][v[k]],
                     drawable.normal_to_world[1] * drawable.normals[1][v[k]], at.t) *
             s.weight[k];
    s.normal = unit_or(sum, s.geometric_normal);
  }
  set_cluster_raster(frame, v, at.t, s);
}

// Attribute weights only.
Surface attribute_weights(const FrameGeometry& frame, const SurfaceLocation& at) {
  Surface s;
  s.drawable = &frame.drawable_of(at.patch);
  if (has_grid(*s.drawable)) {
    const Vec2 uv = patch_parameters(frame.pattern_of(at.patch), at);
    set_bilinear_weights(s, 16 * (at.patch - s.drawable->drawable->first_patch), uv.x, uv.y);
  } else {
    set_triangle_weights(s, cluster_triangle(frame, *s.drawable, at), at.b1, at.b2);
  }
  s.half_attributes = frame.request.half_attributes;
  return s;
}

template <class T>
T interpolate(const Surface& s, const std::vector<T>& values, const std::array<float, 4>& weights) {
  T sum = values[s.vertex[0]] * weights[0];
  for (int k = 1; k < s.corner_count; ++k)
    sum += values[s.vertex[static_cast<std::size_t>(k)]] * weights[static_cast<std::size_t>(k)];
  return sum;
}

// As the pixel shader gets it.
template <class T>
T attribute(const Surface& s, T value) {
  if (!s.half_attributes) return value;
  for (int c = 0; c < T::length(); ++c) value[c] = round_to_half(value[c]);
  return value;
}

}  // namespace

SegmentLocation in_segment(const FrameGeometry& frame, const SurfaceLocation& at) {
  const FrameGeometry::Moment moment = frame.moment(at.patch, at.t);
  return {moment.frame, {at.patch, at.triangle, at.b1, at.b2, moment.t}};
}

void take_quad_differences(Surface& s, int partner_x, int partner_y, bool orthographic) {
  const float w = orthographic ? 1.0f : s.raster.w, x = s.raster.x / w, y = s.raster.y / w;
  // (dp, dq) that move the point by (dx, dy) pixels: r + r_p dp + r_q dq is projected to (x + dx, y + dy).
  const auto step = [&](float dx, float dy) {
    const auto row = [&](float from, float to, std::size_t axis) {
      const auto at = [&](const Vec4& d) { return d[static_cast<int>(axis)] - (orthographic ? 0.0f : to * d.w); };
      return Vec3(at(s.raster_p), at(s.raster_q), (to - from) * w);
    };
    const Vec3 a = row(x, x + dx, 0), b = row(y, y + dy, 1);
    const float det = a.x * b.y - a.y * b.x;
    if (!(std::abs(det) > 1e-20f) || !std::isfinite(1.0f / det)) return Vec2(0.0f);
    return Vec2(a.z * b.y - b.z * a.y, a.x * b.z - b.x * a.z) / det;
  };
  const auto way_x = static_cast<float>(partner_x), way_y = static_cast<float>(partner_y);
  s.parameters_by_pixel = glm::mat2(step(way_x, 0.0f) * way_x, step(0.0f, way_y) * way_y);
}

std::array<std::uint64_t, 3> triangle_vertices(const FrameGeometry& frame, std::uint32_t patch,
                                               std::uint32_t triangle) {
  const PosedDrawable& drawable = frame.drawable_of(patch);
  if (!has_grid(drawable)) {
    const auto v = cluster_triangle(frame, drawable, {patch, triangle, 0, 0, 0});
    return {v[0], v[1], v[2]};
  }
  // By their parameters: where an edge has fewer vertices than the grid, several grid points are one vertex.
  const scene::TessellationPattern& pattern = frame.pattern_of(patch);
  const int cell = static_cast<int>(triangle / 2), i = cell % pattern.nu, j = cell / pattern.nu;
  const auto vertex = [&](int di, int dj) {
    return std::uint64_t{std::bit_cast<std::uint32_t>(pattern.u(i + di, j + dj))} << 32 |
           std::bit_cast<std::uint32_t>(pattern.v(i + di, j + dj));
  };
  if (triangle % 2 == 0) return {vertex(0, 0), vertex(1, 0), vertex(1, 1)};
  return {vertex(0, 0), vertex(1, 1), vertex(0, 1)};
}

Surface::Texcoord Surface::texcoord(int set, const shaders::TextureTransform& transform) const {
  const std::vector<Vec2>& values = drawable->primitive->vertices.texcoords[static_cast<std::size_t>(set)];
  Texcoord out;
  out.value = transform.apply(attribute(*this, interpolate(*this, values, weight)));
  out.by_p = transform.matrix * interpolate(*this, values, weight_p);
  out.by_q = transform.matrix * interpolate(*this, values, weight_q);
  out.by_x = out.by_p * parameters_by_pixel[0][0] + out.by_q * parameters_by_pixel[0][1];
  out.by_y = out.by_p * parameters_by_pixel[1][0] + out.by_q * parameters_by_pixel[1][1];
  return out;
}

Vec4 Surface::color() const {
  const std::vector<Vec4>& colors = drawable->primitive->vertices.colors;
  return colors.empty() ? Vec4(1.0f) : attribute(*this, interpolate(*this, colors, weight));
}

Surface evaluate_surface(const FrameGeometry& shutter, const SurfaceLocation& seen) {
  const auto [frame, at] = in_segment(shutter, seen);
  Surface s;
  s.drawable = &frame.drawable_of(at.patch);
  if (s.drawable->procedure != nullptr)
    fill_procedure(frame, at.patch, patch_parameters(frame.pattern_of(at.patch), at), at.t, s);
  else if (has_grid(*s.drawable))
    fill_bezier(frame, at, s);
  else
    fill_cluster(frame, at, s);
  s.half_attributes = frame.request.half_attributes;
  if (s.half_attributes) s.normal = unit_or(attribute(s, s.normal), s.normal);
  return s;
}

bool has_grid(const PosedDrawable& drawable) { return scene::has_grid(*drawable.drawable); }

Vec2 surface_parameters(const FrameGeometry& frame, const SurfaceLocation& at) {
  return has_grid(frame.drawable_of(at.patch)) ? patch_parameters(frame.pattern_of(at.patch), at) : Vec2(at.b1, at.b2);
}

Vec4 surface_raster(const FrameGeometry& frame, const SurfaceLocation& at, Vec2 parameters, int key_number) {
  const PosedDrawable& drawable = frame.drawable_of(at.patch);
  const auto key = static_cast<std::size_t>(key_number);
  if (drawable.procedure != nullptr) {
    Surface s;
    s.drawable = &drawable;
    fill_procedure(frame, at.patch, parameters, static_cast<float>(key), s);
    return s.raster;
  }
  if (has_grid(drawable))
    return drawable.to_raster[key] * Vec4(bezier_point(frame, drawable, at.patch, parameters, key).position, 1.0f);
  const std::array<std::uint32_t, 3> v = cluster_triangle(frame, drawable, at);
  const auto& p = drawable.positions[key];
  const Vec3 point = p[v[0]] * (1.0f - parameters.x - parameters.y) + p[v[1]] * parameters.x + p[v[2]] * parameters.y;
  return drawable.to_raster[key] * Vec4(point, 1.0f);
}

Surface::Texcoord surface_texcoord(const FrameGeometry& shutter, const SurfaceLocation& seen, int set,
                                   const shaders::TextureTransform& transform) {
  const auto [frame, at] = in_segment(shutter, seen);
  Surface s = attribute_weights(frame, at);
  if (has_grid(*s.drawable))
    fill_bezier(frame, at, s);
  else
    set_cluster_raster(frame, cluster_triangle(frame, *s.drawable, at), at.t, s);
  return s.texcoord(set, transform);
}

float surface_alpha(const FrameGeometry& frame, const SurfaceLocation& at) {
  return attribute_weights(frame, at).color().w;
}

}  // namespace tessera::tilecore

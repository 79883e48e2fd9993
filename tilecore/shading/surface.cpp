#include "tilecore/shading/surface.h"

#include <bit>

#include "tilecore/procedural/procedure_surface.h"
#include "tilecore/shading/scalar_lanes.h"

namespace tessera::tilecore {
namespace {

using one_lane::LaneInputs;
using one_lane::LaneSurface;
using scene::FrameGeometry;
using scene::PosedDrawable;

Vec3 glm_vector(const Vector3<float>& a) { return {a.x, a.y, a.z}; }
Vector3<float> plain(const Vec3& a) { return {a.x, a.y, a.z}; }
Vec4 glm_vector(const one_lane::Point4<float>& a) { return {a.x, a.y, a.z, a.w}; }
one_lane::Point4<float> plain(const Vec4& a) { return {a.x, a.y, a.z, a.w}; }

// The inputs that say where in a grid a location is.
void set_grid(const scene::TessellationPattern& pattern, const SurfaceLocation& at, LaneInputs<float>& in) {
  in.vertex[1] = pattern.nu | pattern.nv << 8;
  in.vertex[2] = static_cast<std::int32_t>(std::uint32_t{pattern.edge[0]} | std::uint32_t{pattern.edge[1]} << 8 |
                                           std::uint32_t{pattern.edge[2]} << 16 | std::uint32_t{pattern.edge[3]} << 24);
  in.triangle = static_cast<std::int32_t>(at.triangle);
  in.p = at.b1, in.q = at.b2;
}

// (u, v) of a triangle's point, from the parameters of its grid vertices.
Vec2 patch_parameters(const scene::TessellationPattern& pattern, const SurfaceLocation& at) {
  LaneInputs<float> in{};
  set_grid(pattern, at, in);
  one_lane::set_grid_parameters(in);
  return {in.p, in.q};
}

std::array<std::uint32_t, 3> cluster_triangle(const FrameGeometry& frame, const PosedDrawable& drawable,
                                              const SurfaceLocation& at) {
  const scene::MeshClusters& clusters = frame.assembly->clusters[drawable.drawable->geometry];
  const scene::Cluster& cluster = clusters.clusters[at.patch - drawable.drawable->first_patch];
  const auto& corner = clusters.cells[cluster.first_cell + at.triangle / 2].corner;
  const auto vertex = [&](std::size_t k) { return clusters.vertices[cluster.first_vertex + corner[k]]; };
  if (at.triangle % 2 == 0) return {vertex(0), vertex(1), vertex(2)};
  return {vertex(0), vertex(2), vertex(3)};
}

void take_weights(const LaneSurface<float>& from, Surface& s) {
  s.corner_count = from.corners;
  for (std::size_t k = 0; k < static_cast<std::size_t>(from.corners); ++k) {
    s.vertex[k] = static_cast<std::uint32_t>(from.vertex[k]);
    s.weight[k] = from.weight[k], s.weight_p[k] = from.weight_p[k], s.weight_q[k] = from.weight_q[k];
  }
}

}  // namespace

SegmentLocation in_segment(const FrameGeometry& frame, const SurfaceLocation& at) {
  const FrameGeometry::Moment moment = frame.moment(at.patch, at.t);
  return {moment.frame, {at.patch, at.triangle, at.b1, at.b2, moment.t}};
}

DrawConstants draw_constants(const FrameGeometry& frame, const PosedDrawable& drawable) {
  DrawConstants draw;
  draw.drawable = &drawable;
  draw.material = drawable.material;
  draw.grid = has_grid(drawable);
  draw.half_attributes = frame.request.half_attributes;
  const scene::Projection& p = frame.projection;
  const DMat4 &open = frame.views[0].camera_to_world, &close = frame.views[1].camera_to_world;
  draw.orthographic = p.orthographic;
  draw.camera_moves = open != close;
  draw.camera_to_world = Mat3(DMat3(open));
  draw.eye_open = p.orthographic ? glm::normalize(Vec3(DVec3(open[2]))) : Vec3(DVec3(open[3]));
  draw.eye_close = Vec3(DVec3(close[3]));
  draw.center_x = static_cast<float>(p.center_x), draw.center_y = static_cast<float>(p.center_y);
  draw.scale = static_cast<float>(p.scale);
  return draw;
}

LaneInputs<float> lane_inputs(const FrameGeometry& frame, const PosedDrawable& drawable, const SurfaceLocation& at) {
  LaneInputs<float> in{};
  in.t = at.t;
  if (!has_grid(drawable)) {
    const std::array<std::uint32_t, 3> v = cluster_triangle(frame, drawable, at);
    for (std::size_t k = 0; k < 3; ++k) in.vertex[k] = static_cast<std::int32_t>(v[k]);
    in.p = at.b1, in.q = at.b2;
    return in;
  }
  const std::uint32_t number = at.patch - drawable.drawable->first_patch, grid = drawable.drawable->first_grid + number;
  set_grid(frame.patterns[grid], at, in);
  in.vertex[0] = static_cast<std::int32_t>(16 * number);
  if (drawable.material->displacement) in.lod = frame.displacement_lod[grid];
  return in;
}

LaneSurface<float> one_lane_surface(const Surface& s) {
  LaneSurface<float> out{};
  out.position = plain(s.position), out.geometric_normal = plain(s.geometric_normal), out.normal = plain(s.normal);
  out.position_p = plain(s.position_p), out.position_q = plain(s.position_q);
  out.raster = plain(s.raster), out.raster_p = plain(s.raster_p), out.raster_q = plain(s.raster_q);
  out.p_by_x = s.parameters_by_pixel[0][0], out.q_by_x = s.parameters_by_pixel[0][1];
  out.p_by_y = s.parameters_by_pixel[1][0], out.q_by_y = s.parameters_by_pixel[1][1];
  out.corners = s.corner_count;
  for (std::size_t k = 0; k < static_cast<std::size_t>(s.corner_count); ++k) {
    out.vertex[k] = static_cast<std::int32_t>(s.vertex[k]);
    out.weight[k] = s.weight[k], out.weight_p[k] = s.weight_p[k], out.weight_q[k] = s.weight_q[k];
  }
  return out;
}

void take_quad_differences(Surface& s, int partner_x, int partner_y, bool orthographic) {
  LaneSurface<float> lane = one_lane_surface(s);
  one_lane::take_differences(orthographic, static_cast<float>(partner_x), static_cast<float>(partner_y), lane);
  s.parameters_by_pixel = glm::mat2(lane.p_by_x, lane.q_by_x, lane.p_by_y, lane.q_by_y);
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
  const auto vertex = [&](std::size_t k) {
    const auto [i, j] = scene::grid_corner(pattern, triangle, k);
    return std::uint64_t{std::bit_cast<std::uint32_t>(pattern.u(i, j))} << 32 |
           std::bit_cast<std::uint32_t>(pattern.v(i, j));
  };
  return {vertex(0), vertex(1), vertex(2)};
}

Surface::Texcoord Surface::texcoord(int set, const shaders::TextureTransform& transform) const {
  DrawConstants draw;
  draw.drawable = drawable;
  draw.half_attributes = half_attributes;
  const one_lane::LaneTexcoord<float> at = one_lane::lane_texcoord(draw, one_lane_surface(*this), set, transform);
  return {{at.u, at.v}, {at.u_x, at.v_x}, {at.u_y, at.v_y}, {at.u_p, at.v_p}, {at.u_q, at.v_q}};
}

Surface evaluate_surface(const FrameGeometry& shutter, const SurfaceLocation& seen) {
  const auto [frame, at] = in_segment(shutter, seen);
  Surface s;
  s.drawable = &frame.drawable_of(at.patch);
  s.half_attributes = frame.request.half_attributes;
  if (s.drawable->procedure != nullptr) {
    fill_procedure(frame, at.patch, patch_parameters(frame.pattern_of(at.patch), at), at.t, s);
    return s;
  }
  LaneInputs<float> in = lane_inputs(frame, *s.drawable, at);
  const LaneSurface<float> lane = one_lane::lane_surface(draw_constants(frame, *s.drawable), in);
  s.position = glm_vector(lane.position);
  s.geometric_normal = glm_vector(lane.geometric_normal), s.normal = glm_vector(lane.normal);
  s.position_p = glm_vector(lane.position_p), s.position_q = glm_vector(lane.position_q);
  s.raster = glm_vector(lane.raster);
  s.raster_p = glm_vector(lane.raster_p), s.raster_q = glm_vector(lane.raster_q);
  s.parameters_by_pixel = glm::mat2(lane.p_by_x, lane.q_by_x, lane.p_by_y, lane.q_by_y);
  take_weights(lane, s);
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
  LaneInputs<float> in = lane_inputs(frame, drawable, at);
  if (has_grid(drawable)) {
    in.p = parameters.x, in.q = parameters.y;
    const one_lane::PatchPoint<float> p = one_lane::patch_point(draw_constants(frame, drawable), in, key);
    return drawable.to_raster[key] * Vec4(glm_vector(p.position), 1.0f);
  }
  const auto point = [&](std::size_t k) { return drawable.positions[key][static_cast<std::size_t>(in.vertex[k])]; };
  return drawable.to_raster[key] *
         Vec4(point(0) * (1.0f - parameters.x - parameters.y) + point(1) * parameters.x + point(2) * parameters.y,
              1.0f);
}

}  // namespace tessera::tilecore

#include "scene/domain_shader.h"

namespace tessera::scene {

shaders::ControlPoints<float> shader_control_points(const FrameGeometry& frame, const PosedDrawable& drawable,
                                                    std::uint32_t patch, std::size_t key) {
  shaders::ControlPoints<float> c;
  const auto points = frame.control_points(drawable, patch, static_cast<int>(key));
  for (std::size_t i = 0; i < 16; ++i) c[i] = {points[i].x, points[i].y, points[i].z};
  return c;
}

Vec3 domain_point(const FrameGeometry& frame, const PosedDrawable& drawable, std::uint32_t patch, float u, float v,
                  std::size_t key, bool displaced) {
  const auto c = shader_control_points(frame, drawable, patch, key);
  const shaders::BicubicRow<float> row = shaders::bicubic_row(c, v);
  const shaders::SurfacePoint<float> p = shaders::bicubic_point<float>(row, u);
  if (!displaced || !drawable.material->displacement) return {p.position.x, p.position.y, p.position.z};
  const Vector3<float> n = shaders::bicubic_normal(c, u, v, p);
  const float offset = patch_displacement(frame, drawable, patch).offset(u, v);
  const Vector3<float> moved = p.position + n * offset;
  return {moved.x, moved.y, moved.z};
}

OwnedVertex boundary_vertex(const TessellationPattern& pattern, const PatchNeighbours& neighbours, int i, int j) {
  // Edge and number of the vertex on it.
  const bool along_u = j == 0 || j == pattern.nv;
  const std::size_t edge = along_u ? (j == 0 ? 0u : 1u) : (i == 0 ? 2u : 3u);
  const int factor = pattern.edge[edge];
  int k = along_u ? TessellationPattern::edge_vertex(i, pattern.nu, factor)
                  : TessellationPattern::edge_vertex(j, pattern.nv, factor);
  const PatchNeighbours::EdgeOwner& owner = neighbours.edges[edge];
  if (k == 0 || k == factor || owner.collapsed) {
    const bool far = k == factor && !owner.collapsed;
    const std::size_t corner = along_u ? (far ? 1u : 0u) + (j == 0 ? 0u : 2u) : (far ? 2u : 0u) + (i == 0 ? 0u : 1u);
    const PatchNeighbours::CornerOwner& at = neighbours.corners[corner];
    const Vec2 parameters = corner_parameters(at.corner);
    return {at.patch, parameters.x, parameters.y};
  }
  if (owner.reversed) k = factor - k;
  const float s = static_cast<float>(k) / static_cast<float>(factor);
  switch (owner.edge) {
    case 0:
      return {owner.patch, s, 0.0f};
    case 1:
      return {owner.patch, s, 1.0f};
    case 2:
      return {owner.patch, 0.0f, s};
    default:
      return {owner.patch, 1.0f, s};
  }
}

}  // namespace tessera::scene

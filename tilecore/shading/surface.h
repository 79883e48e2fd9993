#pragma once

#include <array>
#include <cstdint>

#include "scene/frame_geometry.h"

namespace tessera::tilecore {

// A point on a base patch in the form that visibility reports: the triangle of the patch's grid or cluster, the weights
// of its second and third corner, and the time. With triangle kWholePatch, for patches with a grid only, b1 and b2 are
// (u, v).
struct SurfaceLocation {
  static constexpr std::uint32_t kWholePatch = 0xFFFFFFFFu;
  static constexpr std::uint32_t kLine = 0xFFFFFFFEu;  // the same, on a line drawn along a procedure's parameters
  std::uint32_t patch = 0, triangle = 0;
  float b1 = 0, b2 = 0;
  float t = 0;
};

// A location and the frame by which its patch moves at that time, if a shutter with curved motion has several.
struct SegmentLocation {
  const scene::FrameGeometry& frame;
  SurfaceLocation at;  // its time counts within the segment
};
SegmentLocation in_segment(const scene::FrameGeometry& frame, const SurfaceLocation& at);

// The surface at that point: everything the pixel shader reads. Parameters (p, q) are (u, v) of a patch with a grid or
// (b1, b2) of a cluster's triangle.
struct Surface {
  const scene::PosedDrawable* drawable = nullptr;
  Vec3 position;                           // world
  Vec3 geometric_normal;                   // world, unit, on the front side
  Vec3 normal;                             // world, unit, interpolated or displaced
  Vec3 position_p, position_q;             // world derivatives
  Vec4 raster;                             // (xh, yh, depth, w)
  Vec3 object{0.0f}, object_normal{0.0f};  // procedures: object space, for their textures
  // Derivatives of (p, q) by pixel x and y: columns d/dx, d/dy. Zero if the surface is seen edge-on, and for
  // procedures, whose textures blur over the width of a pixel instead.
  glm::mat2 parameters_by_pixel{0.0f};
  Vec4 raster_p{0.0f}, raster_q{0.0f};  // derivatives of raster

  bool half_attributes = false;  // interpolated attributes, except for places, are rounded to half precision
  // Vertices that attributes are interpolated from (numbers within the primitive), with weights and their derivatives.
  int corner_count = 3;
  std::array<std::uint32_t, 4> vertex{};
  std::array<float, 4> weight{}, weight_p{}, weight_q{};

  // An attribute and its derivatives by pixel.
  struct Texcoord {
    Vec2 value, by_x, by_y, by_p, by_q;
  };
  Texcoord texcoord(int set, const shaders::TextureTransform& transform) const;
};

Surface evaluate_surface(const scene::FrameGeometry& frame, const SurfaceLocation& at);

// Sets parameters_by_pixel to the differences in a quad of 2x2 invocations: between the surface's point in this pixel
// and its points in the neighbours, `partner_x` and `partner_y` (each 1 or -1) pixels away, on the plane of its
// tangents.
void take_quad_differences(Surface& s, int partner_x, int partner_y, bool orthographic);

// Names of a triangle's vertices within its base patch: triangles with two names in common share an edge with all its
// attributes. `triangle` is a number of a grid or of a cluster.
std::array<std::uint64_t, 3> triangle_vertices(const scene::FrameGeometry& frame, std::uint32_t patch,
                                               std::uint32_t triangle);

// Whether a drawable's patches have parametric grids (Bezier patches, procedures); else it consists of clusters.
bool has_grid(const scene::PosedDrawable& drawable);

// (p, q) of a location.
Vec2 surface_parameters(const scene::FrameGeometry& frame, const SurfaceLocation& at);

// (xh, yh, depth, w) of a point at a motion key of the shutter, from its parameters alone: `frame` may be another pose
// of the assembly than the one in which `at` was seen.
Vec4 surface_raster(const scene::FrameGeometry& frame, const SurfaceLocation& at, Vec2 parameters, int key);

}  // namespace tessera::tilecore

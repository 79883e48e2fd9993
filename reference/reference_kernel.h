#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "reference/reference_scene.h"

namespace tessera::reference {

// Sixteen neighbouring rays and their hits.
struct RayPacket {
  static constexpr std::size_t kRays = 16;
  static constexpr std::int64_t kNothing = -1;
  using Numbers = std::array<double, kRays>;

  // Input: (x, y) = origin + depth * direction, at time t. All sixteen must be filled; unused ones repeat another.
  alignas(64) Numbers origin_x, origin_y, direction_x, direction_y, t;
  // Output: depth, and weights of the second and third corner, of the nearest opaque triangle.
  alignas(64) Numbers depth, b1, b2;
  alignas(64) std::array<std::int64_t, kRays> triangle;  // number in ReferenceScene::triangles, or kNothing

  // Output: hits of triangles that are not opaque, in no particular order; some may lie behind the opaque hit.
  struct Crossing {
    std::size_t ray;
    std::int64_t triangle;
    double depth, b1, b2;
  };
  std::vector<Crossing> crossings;
};

// Finds the hits of the rays with the scene's tree. Every instruction set gives the same bits: the kernel has no
// fused operations. At equal depths the triangle with the lower number wins.
void trace_packet(const ReferenceScene& scene, RayPacket& packet);
// The same without the tree: tests all triangles, one by one. Tests compare trace_packet with it.
void trace_packet_without_tree(const ReferenceScene& scene, RayPacket& packet);

// Sixteen shadow rays: lines in any direction through a scene of casters.
//
// Each line is a function of the coordinate along one axis of the space, which all sixteen share. With axis 2 this is
// RayPacket's (x, y) = origin + depth * direction; with 0 it is (y, depth) over x, and with 1 (depth, x) over y.
struct ShadowPacket {
  static constexpr std::size_t kRays = RayPacket::kRays;
  using Numbers = RayPacket::Numbers;

  // Input. `light_above`: the light lies at larger coordinates, so it sees the sides that a camera at the other end
  // does not. A hit counts where from < depth < to; both may be infinite. A ray never hits the triangle that it
  // starts on (`patch`, `triangle`: as in SurfaceLocation).
  int axis = 2;
  bool light_above = false;
  alignas(64) Numbers origin_x, origin_y, direction_x, direction_y, from, to, t;
  alignas(64) std::array<std::uint32_t, kRays> patch, triangle;
  // Output: whether an opaque triangle blocks the ray.
  alignas(64) std::array<std::int64_t, kRays> blocked;
  // Output: hits of triangles that are not opaque, in no particular order; includes hits found before a ray was blocked.
  std::vector<RayPacket::Crossing> crossings;
};

// Finds the casters that block the rays, by the scene's tree. Every instruction set gives the same bits.
void trace_shadows(const ReferenceScene& casters, ShadowPacket& packet);
// The same without the tree.
void trace_shadows_without_tree(const ReferenceScene& casters, ShadowPacket& packet);

}  // namespace tessera::reference

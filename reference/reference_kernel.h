#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "reference/reference_scene.h"

namespace tessera::reference {

// Sixteen rays that are near each other, and what they hit.
struct RayPacket {
  static constexpr std::size_t kRays = 16;
  static constexpr std::int64_t kNothing = -1;
  using Numbers = std::array<double, kRays>;

  // In: (x, y) = origin + depth * direction, at time t. All sixteen are filled; what is not wanted repeats another.
  alignas(64) Numbers origin_x, origin_y, direction_x, direction_y, t;
  // Out: depth and weights of the second and third corner of the nearest opaque triangle.
  alignas(64) Numbers depth, b1, b2;
  alignas(64) std::array<std::int64_t, kRays> triangle;  // of ReferenceScene::triangles, or kNothing

  // Out: hits of triangles that are not opaque, in no particular order; some may be behind what is.
  struct Crossing {
    std::size_t ray;
    std::int64_t triangle;
    double depth, b1, b2;
  };
  std::vector<Crossing> crossings;
};

// Finds what the rays hit, with the scene's tree. The same result on every instruction set: the kernel has no fused
// operations. Equal depths: the triangle with the lower number.
void trace_packet(const ReferenceScene& scene, RayPacket& packet);
// The same without the tree: all triangles, one by one. What trace_packet is tested against.
void trace_packet_without_tree(const ReferenceScene& scene, RayPacket& packet);

// Sixteen shadow rays: lines that may run anywhere, through a scene of casters.
//
// A line is a function of the coordinate along one of the space's three axes, which is the same one for all sixteen: with
// axis 2 that is RayPacket's (x, y) = origin + depth * direction, with 0 (y, depth) of x, and with 1 (depth, x) of y.
struct ShadowPacket {
  static constexpr std::size_t kRays = RayPacket::kRays;
  using Numbers = RayPacket::Numbers;

  // In. `light_above`: the light is where the coordinate is larger, so that it sees the sides that a camera at the other
  // end does not. A hit counts where from < depth < to; either may be infinite. A ray never hits the triangle that it
  // starts on (`patch`, `triangle`: as in SurfaceLocation).
  int axis = 2;
  bool light_above = false;
  alignas(64) Numbers origin_x, origin_y, direction_x, direction_y, from, to, t;
  alignas(64) std::array<std::uint32_t, kRays> patch, triangle;
  // Out: whether an opaque triangle blocks the ray.
  alignas(64) std::array<std::int64_t, kRays> blocked;
  // Out: hits of triangles that are not opaque, in no particular order, of rays that are not blocked or were not yet.
  std::vector<RayPacket::Crossing> crossings;
};

// Finds the casters that block the rays, by the scene's tree. Every instruction set gives the same bits.
void trace_shadows(const ReferenceScene& casters, ShadowPacket& packet);
// The same without the tree.
void trace_shadows_without_tree(const ReferenceScene& casters, ShadowPacket& packet);

}  // namespace tessera::reference

#include "reference/reference_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "reference/reference_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

HWY_BEFORE_NAMESPACE();
namespace tessera::reference::HWY_NAMESPACE {

// Plain loops over the sixteen rays, which the compiler turns into this target's vectors: no operation depends on
// another ray, none is fused, so the bits are the same everywhere.
constexpr std::size_t kRays = RayPacket::kRays;
using Floats = std::array<float, kRays>;

// What the walk through the tree needs, in single precision; boxes have room for the rounding.
struct WalkRays {
  alignas(64) Floats origin_x, origin_y, direction_x, direction_y, t, farthest;
};

// Whether any ray may touch the box: its stretch between the box's depths, and before what it already hit, against the
// box's sides.
HWY_INLINE bool any_touches(const ReferenceScene::Node& node, const WalkRays& rays, float near) {
  const ReferenceScene::Box &a = node.box[0], &b = node.box[1];
  std::int32_t any = 0;
  if (!node.moving) {
    const float z0 = a.low[2] > near ? a.low[2] : near, z1 = a.high[2];
    for (std::size_t r = 0; r < kRays; ++r) {
      const float end = rays.farthest[r] < z1 ? rays.farthest[r] : z1;
      const float xa = rays.origin_x[r] + z0 * rays.direction_x[r], xb = rays.origin_x[r] + end * rays.direction_x[r];
      const float ya = rays.origin_y[r] + z0 * rays.direction_y[r], yb = rays.origin_y[r] + end * rays.direction_y[r];
      const float x_high = xa > xb ? xa : xb, x_low = xa < xb ? xa : xb, y_high = ya > yb ? ya : yb,
                  y_low = ya < yb ? ya : yb;
      any |= static_cast<std::int32_t>(end >= z0) & static_cast<std::int32_t>(x_high >= a.low[0]) &
             static_cast<std::int32_t>(x_low <= a.high[0]) & static_cast<std::int32_t>(y_high >= a.low[1]) &
             static_cast<std::int32_t>(y_low <= a.high[1]);
    }
    return any != 0;
  }
  for (std::size_t r = 0; r < kRays; ++r) {
    const float t = rays.t[r], s = 1.0f - t;
    const float z_low = s * a.low[2] + t * b.low[2], z_high = s * a.high[2] + t * b.high[2];
    const float z0 = z_low > near ? z_low : near, end = rays.farthest[r] < z_high ? rays.farthest[r] : z_high;
    const float xa = rays.origin_x[r] + z0 * rays.direction_x[r], xb = rays.origin_x[r] + end * rays.direction_x[r];
    const float ya = rays.origin_y[r] + z0 * rays.direction_y[r], yb = rays.origin_y[r] + end * rays.direction_y[r];
    const float x_high = xa > xb ? xa : xb, x_low = xa < xb ? xa : xb, y_high = ya > yb ? ya : yb,
                y_low = ya < yb ? ya : yb;
    any |= static_cast<std::int32_t>(end >= z0) & static_cast<std::int32_t>(x_high >= s * a.low[0] + t * b.low[0]) &
           static_cast<std::int32_t>(x_low <= s * a.high[0] + t * b.high[0]) &
           static_cast<std::int32_t>(y_high >= s * a.low[1] + t * b.low[1]) &
           static_cast<std::int32_t>(y_low <= s * a.high[1] + t * b.high[1]);
  }
  return any != 0;
}

// A leaf's vertices as every ray sees them: x, y from the ray at the vertex's depth (the shear of Woop et al. 2013,
// which needs no permutation of axes here), z the depth.
struct SeenVertices {
  alignas(64) std::array<std::array<double, kRays>, ReferenceScene::kLeafVertices> x, y, z;
};

HWY_INLINE void see_vertices(const ReferenceScene& scene, const ReferenceScene::Leaf& leaf, const RayPacket& rays,
                             SeenVertices& seen) {
  for (std::size_t v = 0; v < leaf.vertex_count; ++v) {
    const std::array<double, 6>& p = scene.vertices[leaf.first_vertex + v];
    if (!leaf.moving) {
      for (std::size_t r = 0; r < kRays; ++r) {
        seen.z[v][r] = p[2];
        seen.x[v][r] = p[0] - (rays.origin_x[r] + p[2] * rays.direction_x[r]);
        seen.y[v][r] = p[1] - (rays.origin_y[r] + p[2] * rays.direction_y[r]);
      }
      continue;
    }
    for (std::size_t r = 0; r < kRays; ++r) {
      const double t = rays.t[r], s = 1.0 - t, z = s * p[2] + t * p[5];
      seen.z[v][r] = z;
      seen.x[v][r] = (s * p[0] + t * p[3]) - (rays.origin_x[r] + z * rays.direction_x[r]);
      seen.y[v][r] = (s * p[1] + t * p[4]) - (rays.origin_y[r] + z * rays.direction_y[r]);
    }
  }
}

// Tests one triangle. Edge functions of a shared edge are each other's exact negatives, and zero counts as inside on
// both sides: nothing falls between two triangles.
HWY_INLINE void test_triangle(const ReferenceScene& scene, std::size_t number, const SeenVertices& seen,
                              RayPacket& rays, WalkRays& walk) {
  const ReferenceScene::Triangle& triangle = scene.triangles[number];
  const std::size_t a = triangle.corner[0], b = triangle.corner[1], c = triangle.corner[2];
  alignas(64) std::array<double, kRays> ea, eb, ec;
  alignas(64) std::array<std::int64_t, kRays> inside;
  const std::int64_t positive = triangle.keep_positive ? 1 : 0, negative = triangle.keep_negative ? 1 : 0;
  std::int64_t any = 0;
  for (std::size_t r = 0; r < kRays; ++r) {
    ea[r] = seen.x[b][r] * seen.y[c][r] - seen.y[b][r] * seen.x[c][r];
    eb[r] = seen.x[c][r] * seen.y[a][r] - seen.y[c][r] * seen.x[a][r];
    ec[r] = seen.x[a][r] * seen.y[b][r] - seen.y[a][r] * seen.x[b][r];
  }
  for (std::size_t r = 0; r < kRays; ++r) {
    const std::int64_t up = static_cast<std::int64_t>(ea[r] >= 0.0) & static_cast<std::int64_t>(eb[r] >= 0.0) &
                            static_cast<std::int64_t>(ec[r] >= 0.0) & positive;
    const std::int64_t down = static_cast<std::int64_t>(ea[r] <= 0.0) & static_cast<std::int64_t>(eb[r] <= 0.0) &
                              static_cast<std::int64_t>(ec[r] <= 0.0) & negative;
    inside[r] = up | down;
    any |= inside[r];
  }
  if (any == 0) return;
  for (std::size_t r = 0; r < kRays; ++r) {
    if (inside[r] == 0) continue;
    const double sum = ea[r] + eb[r] + ec[r];
    if (sum == 0.0) continue;
    const double b1 = eb[r] / sum, b2 = ec[r] / sum,
                 depth = (ea[r] * seen.z[a][r] + eb[r] * seen.z[b][r] + ec[r] * seen.z[c][r]) / sum;
    if (!(depth >= scene.near && depth <= scene.far) || depth > rays.depth[r]) continue;
    if (!triangle.opaque) {
      rays.crossings.push_back({r, static_cast<std::int64_t>(number), depth, b1, b2});
      continue;
    }
    if (depth == rays.depth[r] && static_cast<std::int64_t>(number) >= rays.triangle[r]) continue;
    rays.depth[r] = depth;
    rays.b1[r] = b1;
    rays.b2[r] = b2;
    rays.triangle[r] = static_cast<std::int64_t>(number);
    // Not nearer than the hit, whatever the rounding.
    walk.farthest[r] = static_cast<float>(depth) * 1.000001f;
  }
}

HWY_INLINE void test_leaf(const ReferenceScene& scene, const ReferenceScene::Leaf& leaf, SeenVertices& seen,
                          RayPacket& rays, WalkRays& walk) {
  see_vertices(scene, leaf, rays, seen);
  for (std::size_t k = 0; k < leaf.triangle_count; ++k) test_triangle(scene, leaf.first_triangle + k, seen, rays, walk);
}

HWY_INLINE void begin(const RayPacket& rays, WalkRays& walk) {
  for (std::size_t r = 0; r < kRays; ++r) {
    walk.origin_x[r] = static_cast<float>(rays.origin_x[r]);
    walk.origin_y[r] = static_cast<float>(rays.origin_y[r]);
    walk.direction_x[r] = static_cast<float>(rays.direction_x[r]);
    walk.direction_y[r] = static_cast<float>(rays.direction_y[r]);
    walk.t[r] = static_cast<float>(rays.t[r]);
    walk.farthest[r] = std::numeric_limits<float>::infinity();
  }
}

void TracePacket(const ReferenceScene& scene, RayPacket& rays) {
  WalkRays walk;
  begin(rays, walk);
  SeenVertices seen;
  // A tree of n leaves that is split in the middle at worst here and there stays far below this depth; see the check.
  std::array<std::int32_t, 256> stack;
  std::size_t depth = 0;
  stack[depth++] = 0;
  const float near = static_cast<float>(scene.near) * 0.999999f;
  while (depth > 0) {
    const ReferenceScene::Node& node = scene.nodes[static_cast<std::size_t>(stack[--depth])];
    if (!any_touches(node, walk, near)) continue;
    if (node.left < 0) {
      test_leaf(scene, scene.leaves[static_cast<std::size_t>(node.right)], seen, rays, walk);
      continue;
    }
    const ReferenceScene::Node &left = scene.nodes[static_cast<std::size_t>(node.left)],
                               &right = scene.nodes[static_cast<std::size_t>(node.right)];
    const bool left_first = left.box[0].low[2] + left.box[1].low[2] <= right.box[0].low[2] + right.box[1].low[2];
    if (depth + 2 > stack.size()) HWY_ABORT("the reference's tree is too deep");
    stack[depth++] = left_first ? node.right : node.left;
    stack[depth++] = left_first ? node.left : node.right;
  }
}

void TraceAll(const ReferenceScene& scene, RayPacket& rays) {
  WalkRays walk;
  begin(rays, walk);
  SeenVertices seen;
  for (const ReferenceScene::Leaf& leaf : scene.leaves) test_leaf(scene, leaf, seen, rays, walk);
}

}  // namespace tessera::reference::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::reference {
namespace {

void forget(RayPacket& packet) {
  packet.depth.fill(std::numeric_limits<double>::infinity());
  packet.triangle.fill(RayPacket::kNothing);
  packet.crossings.clear();
}

}  // namespace

HWY_EXPORT(TracePacket);
HWY_EXPORT(TraceAll);

void trace_packet(const ReferenceScene& scene, RayPacket& packet) {
  forget(packet);
  if (!scene.nodes.empty()) HWY_DYNAMIC_DISPATCH(TracePacket)(scene, packet);
}

void trace_packet_without_tree(const ReferenceScene& scene, RayPacket& packet) {
  forget(packet);
  HWY_DYNAMIC_DISPATCH(TraceAll)(scene, packet);
}

}  // namespace tessera::reference
#endif

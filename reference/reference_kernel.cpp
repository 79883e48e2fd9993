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

// Rays in single precision for the walk through the tree; boxes have a margin for the rounding.
struct WalkRays {
  alignas(64) Floats origin_x, origin_y, direction_x, direction_y, t, farthest;
};

// Whether any ray may touch the box: its stretch between the box's depths and in front of its nearest hit is tested
// against the box's sides.
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

// A leaf's vertices relative to every ray: x, y from the ray at the vertex's depth (the shear of Woop et al. 2013,
// which needs no permutation of axes here), z the depth.
struct SeenVertices {
  alignas(64) std::array<std::array<double, kRays>, ReferenceScene::kLeafVertices> x, y, z;
};

// kAxis: the coordinate that rays are functions of; it becomes z.
template <int kAxis, class Rays>
HWY_INLINE void see_vertices(const ReferenceScene& scene, const ReferenceScene::Leaf& leaf, const Rays& rays,
                             SeenVertices& seen) {
  constexpr std::size_t kX = (kAxis + 1) % 3, kY = (kAxis + 2) % 3, kZ = kAxis;
  for (std::size_t v = 0; v < leaf.vertex_count; ++v) {
    const std::array<double, 6>& p = scene.vertices[leaf.first_vertex + v];
    if (!leaf.moving) {
      for (std::size_t r = 0; r < kRays; ++r) {
        seen.z[v][r] = p[kZ];
        seen.x[v][r] = p[kX] - (rays.origin_x[r] + p[kZ] * rays.direction_x[r]);
        seen.y[v][r] = p[kY] - (rays.origin_y[r] + p[kZ] * rays.direction_y[r]);
      }
      continue;
    }
    for (std::size_t r = 0; r < kRays; ++r) {
      const double t = rays.t[r], s = 1.0 - t, z = s * p[kZ] + t * p[3 + kZ];
      seen.z[v][r] = z;
      seen.x[v][r] = (s * p[kX] + t * p[3 + kX]) - (rays.origin_x[r] + z * rays.direction_x[r]);
      seen.y[v][r] = (s * p[kY] + t * p[3 + kY]) - (rays.origin_y[r] + z * rays.direction_y[r]);
    }
  }
}

// Edge functions of a triangle for every ray.
struct Edges {
  alignas(64) std::array<double, kRays> a, b, c;
  alignas(64) std::array<std::int64_t, kRays> inside;
  // Twice the area of the triangle as the ray sees it; 0 when seen edge-on.
  double sum(std::size_t r) const { return a[r] + b[r] + c[r]; }
  double depth(const SeenVertices& seen, const ReferenceScene::Triangle& triangle, std::size_t r) const {
    const auto& corner = triangle.corner;
    return (a[r] * seen.z[corner[0]][r] + b[r] * seen.z[corner[1]][r] + c[r] * seen.z[corner[2]][r]) / sum(r);
  }
};

// Whether any ray is inside. Edge functions of a shared edge are each other's exact negatives, and zero counts as inside
// on both sides: nothing falls between two triangles.
HWY_INLINE bool find_edges(const ReferenceScene::Triangle& triangle, bool keep_positive, bool keep_negative,
                           const SeenVertices& seen, Edges& edges) {
  const std::size_t a = triangle.corner[0], b = triangle.corner[1], c = triangle.corner[2];
  const std::int64_t positive = keep_positive ? 1 : 0, negative = keep_negative ? 1 : 0;
  std::int64_t any = 0;
  for (std::size_t r = 0; r < kRays; ++r) {
    edges.a[r] = seen.x[b][r] * seen.y[c][r] - seen.y[b][r] * seen.x[c][r];
    edges.b[r] = seen.x[c][r] * seen.y[a][r] - seen.y[c][r] * seen.x[a][r];
    edges.c[r] = seen.x[a][r] * seen.y[b][r] - seen.y[a][r] * seen.x[b][r];
  }
  for (std::size_t r = 0; r < kRays; ++r) {
    const std::int64_t up = static_cast<std::int64_t>(edges.a[r] >= 0.0) &
                            static_cast<std::int64_t>(edges.b[r] >= 0.0) &
                            static_cast<std::int64_t>(edges.c[r] >= 0.0) & positive;
    const std::int64_t down = static_cast<std::int64_t>(edges.a[r] <= 0.0) &
                              static_cast<std::int64_t>(edges.b[r] <= 0.0) &
                              static_cast<std::int64_t>(edges.c[r] <= 0.0) & negative;
    edges.inside[r] = up | down;
    any |= edges.inside[r];
  }
  return any != 0;
}

HWY_INLINE void test_triangle(const ReferenceScene& scene, std::size_t number, const SeenVertices& seen,
                              RayPacket& rays, WalkRays& walk) {
  const ReferenceScene::Triangle& triangle = scene.triangles[number];
  Edges edges;
  if (!find_edges(triangle, triangle.keep_positive, triangle.keep_negative, seen, edges)) return;
  for (std::size_t r = 0; r < kRays; ++r) {
    if (edges.inside[r] == 0) continue;
    const double sum = edges.sum(r);
    if (sum == 0.0) continue;
    const double b1 = edges.b[r] / sum, b2 = edges.c[r] / sum, depth = edges.depth(seen, triangle, r);
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
    // The limit must not be nearer than the hit, whatever the rounding.
    walk.farthest[r] = static_cast<float>(depth) * 1.000001f;
  }
}

HWY_INLINE void test_leaf(const ReferenceScene& scene, const ReferenceScene::Leaf& leaf, SeenVertices& seen,
                          RayPacket& rays, WalkRays& walk) {
  see_vertices<2>(scene, leaf, rays, seen);
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

// Calls at_leaf(leaf) for each leaf for which enters(node) is true, also for all nodes above it. `left_first(left,
// right)` chooses the child that comes first.
template <class Enters, class AtLeaf, class LeftFirst>
HWY_INLINE void walk_tree(const ReferenceScene& scene, const Enters& enters, const AtLeaf& at_leaf,
                          const LeftFirst& left_first) {
  // A tree of n leaves stays far below this depth, as bad splits fall back to the middle; see the check.
  std::array<std::int32_t, 256> stack;
  std::size_t depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const ReferenceScene::Node& node = scene.nodes[static_cast<std::size_t>(stack[--depth])];
    if (!enters(node)) continue;
    if (node.left < 0) {
      at_leaf(scene.leaves[static_cast<std::size_t>(node.right)]);
      continue;
    }
    const bool left =
        left_first(scene.nodes[static_cast<std::size_t>(node.left)], scene.nodes[static_cast<std::size_t>(node.right)]);
    if (depth + 2 > stack.size()) HWY_ABORT("the reference's tree is too deep");
    stack[depth++] = left ? node.right : node.left;
    stack[depth++] = left ? node.left : node.right;
  }
}

void TracePacket(const ReferenceScene& scene, RayPacket& rays) {
  WalkRays walk;
  begin(rays, walk);
  SeenVertices seen;
  const float near = static_cast<float>(scene.near) * 0.999999f;
  walk_tree(
      scene, [&](const ReferenceScene::Node& node) HWY_ATTR { return any_touches(node, walk, near); },
      [&](const ReferenceScene::Leaf& leaf) HWY_ATTR { test_leaf(scene, leaf, seen, rays, walk); },
      [](const ReferenceScene::Node& left, const ReferenceScene::Node& right)
          HWY_ATTR { return left.box[0].low[2] + left.box[1].low[2] <= right.box[0].low[2] + right.box[1].low[2]; });
}

void TraceAll(const ReferenceScene& scene, RayPacket& rays) {
  WalkRays walk;
  begin(rays, walk);
  SeenVertices seen;
  for (const ReferenceScene::Leaf& leaf : scene.leaves) test_leaf(scene, leaf, seen, rays, walk);
}

// ---- Shadow rays ------------------------------------------------------------------------------------------------

// The stretch of every ray on which hits count; empty once the ray is blocked.
struct Stretches {
  alignas(64) std::array<double, kRays> from, to;
};

HWY_INLINE void begin(ShadowPacket& rays, Stretches& left) {
  left.from = rays.from, left.to = rays.to;
  rays.blocked.fill(0);
  rays.crossings.clear();
}

// Whether any ray may touch the box; see any_touches().
template <int kAxis>
HWY_INLINE bool any_passes(const ReferenceScene::Node& node, const ShadowPacket& rays, const Stretches& left) {
  constexpr std::size_t kX = (kAxis + 1) % 3, kY = (kAxis + 2) % 3, kZ = kAxis;
  const ReferenceScene::Box &a = node.box[0], &b = node.box[1];
  std::array<double, 3> low, high, low_by_t{}, high_by_t{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    low[axis] = static_cast<double>(a.low[axis]), high[axis] = static_cast<double>(a.high[axis]);
    if (!node.moving) continue;
    low_by_t[axis] = static_cast<double>(b.low[axis]) - low[axis];
    high_by_t[axis] = static_cast<double>(b.high[axis]) - high[axis];
  }
  std::int32_t any = 0;
  for (std::size_t r = 0; r < kRays; ++r) {
    const double t = rays.t[r], z_low = low[kZ] + t * low_by_t[kZ], z_high = high[kZ] + t * high_by_t[kZ];
    const double z0 = left.from[r] > z_low ? left.from[r] : z_low, z1 = left.to[r] < z_high ? left.to[r] : z_high;
    const double xa = rays.origin_x[r] + z0 * rays.direction_x[r], xb = rays.origin_x[r] + z1 * rays.direction_x[r];
    const double ya = rays.origin_y[r] + z0 * rays.direction_y[r], yb = rays.origin_y[r] + z1 * rays.direction_y[r];
    const double x_high = xa > xb ? xa : xb, x_low = xa < xb ? xa : xb, y_high = ya > yb ? ya : yb,
                 y_low = ya < yb ? ya : yb;
    any |= static_cast<std::int32_t>(z1 >= z0) & static_cast<std::int32_t>(x_high >= low[kX] + t * low_by_t[kX]) &
           static_cast<std::int32_t>(x_low <= high[kX] + t * high_by_t[kX]) &
           static_cast<std::int32_t>(y_high >= low[kY] + t * low_by_t[kY]) &
           static_cast<std::int32_t>(y_low <= high[kY] + t * high_by_t[kY]);
  }
  return any != 0;
}

HWY_INLINE void test_caster(const ReferenceScene& scene, std::size_t number, const SeenVertices& seen,
                            ShadowPacket& rays, Stretches& left) {
  const ReferenceScene::Triangle& triangle = scene.triangles[number];
  const bool positive = rays.light_above ? triangle.keep_negative : triangle.keep_positive,
             negative = rays.light_above ? triangle.keep_positive : triangle.keep_negative;
  Edges edges;
  if (!find_edges(triangle, positive, negative, seen, edges)) return;
  for (std::size_t r = 0; r < kRays; ++r) {
    if (edges.inside[r] == 0) continue;
    const double sum = edges.sum(r);
    if (sum == 0.0 || (triangle.patch == rays.patch[r] && triangle.triangle == rays.triangle[r])) continue;
    const double depth = edges.depth(seen, triangle, r);
    if (!(depth > left.from[r] && depth < left.to[r])) continue;
    if (!triangle.opaque) {
      rays.crossings.push_back({r, static_cast<std::int64_t>(number), depth, edges.b[r] / sum, edges.c[r] / sum});
      continue;
    }
    rays.blocked[r] = 1;
    left.to[r] = -std::numeric_limits<double>::infinity();
  }
}

template <int kAxis>
HWY_INLINE void test_casters(const ReferenceScene& scene, const ReferenceScene::Leaf& leaf, SeenVertices& seen,
                             ShadowPacket& rays, Stretches& left) {
  see_vertices<kAxis>(scene, leaf, rays, seen);
  for (std::size_t k = 0; k < leaf.triangle_count; ++k) test_caster(scene, leaf.first_triangle + k, seen, rays, left);
}

template <int kAxis>
void trace_along(const ReferenceScene& scene, ShadowPacket& rays) {
  Stretches left;
  begin(rays, left);
  SeenVertices seen;
  walk_tree(
      scene, [&](const ReferenceScene::Node& node) HWY_ATTR { return any_passes<kAxis>(node, rays, left); },
      [&](const ReferenceScene::Leaf& leaf) HWY_ATTR { test_casters<kAxis>(scene, leaf, seen, rays, left); },
      [](const ReferenceScene::Node&, const ReferenceScene::Node&) HWY_ATTR { return true; });
}

template <int kAxis>
void trace_all_along(const ReferenceScene& scene, ShadowPacket& rays) {
  Stretches left;
  begin(rays, left);
  SeenVertices seen;
  for (const ReferenceScene::Leaf& leaf : scene.leaves) test_casters<kAxis>(scene, leaf, seen, rays, left);
}

void TraceShadows(const ReferenceScene& scene, ShadowPacket& rays) {
  if (rays.axis == 0)
    trace_along<0>(scene, rays);
  else if (rays.axis == 1)
    trace_along<1>(scene, rays);
  else
    trace_along<2>(scene, rays);
}

void TraceAllShadows(const ReferenceScene& scene, ShadowPacket& rays) {
  if (rays.axis == 0)
    trace_all_along<0>(scene, rays);
  else if (rays.axis == 1)
    trace_all_along<1>(scene, rays);
  else
    trace_all_along<2>(scene, rays);
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
HWY_EXPORT(TraceShadows);
HWY_EXPORT(TraceAllShadows);

void trace_packet(const ReferenceScene& scene, RayPacket& packet) {
  forget(packet);
  if (!scene.nodes.empty()) HWY_DYNAMIC_DISPATCH(TracePacket)(scene, packet);
}

void trace_packet_without_tree(const ReferenceScene& scene, RayPacket& packet) {
  forget(packet);
  HWY_DYNAMIC_DISPATCH(TraceAll)(scene, packet);
}

void trace_shadows(const ReferenceScene& casters, ShadowPacket& packet) {
  packet.blocked.fill(0);
  packet.crossings.clear();
  if (!casters.nodes.empty()) HWY_DYNAMIC_DISPATCH(TraceShadows)(casters, packet);
}

void trace_shadows_without_tree(const ReferenceScene& casters, ShadowPacket& packet) {
  HWY_DYNAMIC_DISPATCH(TraceAllShadows)(casters, packet);
}

}  // namespace tessera::reference
#endif

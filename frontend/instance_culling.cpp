#include "frontend/instance_culling.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/check.h"
#include "base/parallel.h"
#include "frontend/bounds/drawable_box.h"
#include "scene/subpixel.h"

namespace tessera::frontend {
namespace {

using scene::FrameGeometry;
using scene::InstancedNode;
using scene::InstanceGroup;

double reach(float low, float high) {
  return std::max(std::abs(static_cast<double>(low)), std::abs(static_cast<double>(high)));
}

// Box that holds the mesh's box as placed by every instance of the group, in node space.
MovingBox placed_box(const InstanceGroup& group, const MovingBox& box) {
  MovingBox placed = empty_box(box.axes);
  for (std::size_t key = 0; key < 2; ++key)
    for (std::size_t row = 0; row < 3; ++row) {
      double low = static_cast<double>(group.origin_low[row]), high = static_cast<double>(group.origin_high[row]);
      for (std::size_t column = 0; column < 3; ++column) {
        const double a = static_cast<double>(group.linear_low[row][column]),
                     b = static_cast<double>(group.linear_high[row][column]), c = box.low[key][column],
                     d = box.high[key][column];
        const auto [least, most] = std::minmax({a * c, a * d, b * c, b * d});
        low += least, high += most;
      }
      const double slack = (std::abs(low) + std::abs(high)) * 0x1p-40;  // double precision is not exact either
      placed.low[key][row] = low - slack;
      placed.high[key][row] = high + slack;
    }
  return placed;
}

// Largest coordinate in node space of any step on the way of a vertex there: its error in object space goes along.
double placed_reach(const InstanceGroup& group, double object_reach) {
  double largest = 0;
  for (std::size_t row = 0; row < 3; ++row) {
    double sum = reach(group.origin_low[row], group.origin_high[row]);
    for (std::size_t column = 0; column < 3; ++column)
      sum += reach(group.linear_low[row][column], group.linear_high[row][column]) * object_reach;
    largest = std::max(largest, sum);
  }
  return largest;
}

// Whether any of the node's instances moves by this frame's poses.
bool any_moves_here(const FrameGeometry& frame, const InstancedNode& node) {
  if (frame.part.whole() && frame.segments.empty()) return true;
  const auto* first = &frame.drawables[node.first_drawable];
  const std::size_t instances = node.order.size();
  return std::any_of(first, first + instances * node.primitives,
                     [&](const scene::PosedDrawable& drawable) { return frame.moves_here(drawable); });
}

struct CulledInstances {
  InstanceCounters counters;
  PreviousDepthCounters previous_depth;
  std::vector<OcclusionCandidate> deferred;
};

std::uint64_t patches_of(const FrameGeometry& frame, std::uint32_t first_drawable, std::uint32_t drawables) {
  std::uint64_t patches = 0;
  for (std::uint32_t d = first_drawable; d < first_drawable + drawables; ++d)
    patches += frame.drawables[d].drawable->patch_count;
  return patches;
}

// Whether `depth` hides an instance, which is then deferred.
bool hidden(const FrameGeometry& frame, const InstancedNode& node, std::uint32_t instance, const ScreenBounds& bounds,
            const CoarseDepth* depth, CulledInstances& out) {
  const std::uint32_t first = node.first_drawable + instance * node.primitives;
  if (depth == nullptr || !frame.moves_here(frame.drawables[first])) return false;
  const BlockFootprint footprint = depth->footprint(bounds);
  if (!depth->hides(footprint, out.previous_depth.blocks_tested)) return false;
  ++out.previous_depth.groups_culled;
  out.previous_depth.patches_culled += patches_of(frame, first, node.primitives);
  out.deferred.push_back({OcclusionCandidate::kInstance, 0, 0, first, footprint});
  return true;
}

// Tests one group and, unless it is outside, its instances; `read` has the node's drawables.
CulledInstances cull_group(const FrameGeometry& frame, const InstancedNode& node, const MovingBox& box,
                           const InstanceGroup& group, const CoarseDepth* depth, std::uint8_t* read) {
  CulledInstances out;
  InstanceCounters& counters = out.counters;
  counters.instances = group.count;
  counters.groups_tested = 1;
  const bool none = outside_view(group_body(frame, node, box, group), frame);
  if (!none) counters.instances_tested = group.count;
  for (std::uint32_t k = group.first; k < group.first + group.count; ++k) {
    const std::uint32_t instance = node.order[k];
    const std::optional<ScreenBounds> bounds =
        none ? std::nullopt : bounds_in_view(instance_body(frame, node, box, instance), frame);
    counters.instances_culled += bounds ? 0 : 1;
    const bool kept = bounds && !hidden(frame, node, instance, *bounds, depth, out);
    std::fill_n(read + instance * node.primitives, node.primitives, static_cast<std::uint8_t>(kept ? 1 : 0));
  }
  return out;
}

}  // namespace

MovingBox instanced_box(const FrameGeometry& frame, const InstancedNode& node, const PyramidLibrary& pyramids) {
  MovingBox box = empty_box({DVec3(1, 0, 0), DVec3(0, 1, 0), DVec3(0, 0, 1)});
  for (std::uint32_t p = 0; p < node.primitives; ++p) {
    const scene::PosedDrawable& drawable = frame.drawables[node.first_drawable + p];
    const double offset = largest_offset(drawable, pyramids);
    for (std::size_t key = 0; key < 2; ++key)
      for (const Vec3& point : drawable.positions[key])
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const auto at = static_cast<double>(point[static_cast<int>(axis)]);
          box.low[key][axis] = std::min(box.low[key][axis], at - offset);
          box.high[key][axis] = std::max(box.high[key][axis], at + offset);
        }
  }
  return box;
}

SubPatchBody instance_body(const FrameGeometry& frame, const InstancedNode& node, const MovingBox& box,
                           std::uint32_t instance) {
  const scene::PosedDrawable& drawable = frame.drawables[node.first_drawable + instance * node.primitives];
  return box_body(frame, drawable, box);
}

SubPatchBody group_body(const FrameGeometry& frame, const InstancedNode& node, const MovingBox& box,
                        const InstanceGroup& group) {
  std::array<DMat4, 2> to_raster;
  for (std::size_t key = 0; key < 2; ++key)
    to_raster[key] = frame.projections[key].matrix() * frame.views[key].world_to_camera *
                     frame.poses[key].world[static_cast<std::size_t>(node.node)];
  const MovingBox placed = placed_box(group, box);
  // Vertices are computed from matrices in single precision: one rounding more a term, and the margin has far more.
  const double object_reach = largest_coordinate(box) * std::sqrt(3.0);
  SubPatchBody body{corners_of_box(placed, to_raster),
                    vertex_rounding_margin(placed, placed_reach(group, object_reach),
                                           std::array<Mat4, 2>{Mat4(to_raster[0]), Mat4(to_raster[1])},
                                           static_cast<double>(frame.request.subpixels())),
                    {}};
  body.margin.pixels += static_cast<double>(scene::kStillPixels);
  return body;
}

InstanceCulling cull_instances(const FrameGeometry& frame, const std::vector<MovingBox>& boxes,
                               const FrontEndSpec& spec, const CoarseDepth* depth) {
  InstanceCulling result;
  const scene::Assembly& assembly = *frame.assembly;
  if (assembly.instanced_nodes.empty()) return result;
  result.read.assign(assembly.drawables.size(), 1);
  for (std::size_t n = 0; n < boxes.size(); ++n) {
    const InstancedNode& node = assembly.instanced_nodes[n];
    if (!frame.drawables[node.first_drawable].visible || !any_moves_here(frame, node)) continue;
    std::vector<CulledInstances> groups(node.groups.size());
    parallel_for(groups.size(), [&](std::size_t g) {
      groups[g] = cull_group(frame, node, boxes[n], node.groups[g], depth, &result.read[node.first_drawable]);
    });
    for (const CulledInstances& group : groups) {
      merge(result.counters, group.counters);
      merge(result.previous_depth, group.previous_depth);
      result.deferred.insert(result.deferred.end(), group.deferred.begin(), group.deferred.end());
    }
  }
  const auto charge = [&](std::uint64_t records, std::uint64_t bytes) {
    result.ledger.read(memory::Unit::kFrontend, memory::Purpose::kPatchData,
                       records * memory::burst_bytes(0, bytes, spec.burst_bytes));
  };
  charge(result.counters.groups_tested, kInstanceGroupBytes);
  charge(result.counters.instances_tested, kInstanceRecordBytes);
  return result;
}

InstanceCulling cull_instances(const FrameGeometry& frame, const PyramidLibrary& pyramids, const FrontEndSpec& spec,
                               const CoarseDepth* depth) {
  std::vector<MovingBox> boxes;
  for (const InstancedNode& node : frame.assembly->instanced_nodes)
    boxes.push_back(instanced_box(frame, node, pyramids));
  return cull_instances(frame, boxes, spec, depth);
}

std::uint32_t instance_drawables(const scene::Assembly& assembly, std::uint32_t first_drawable) {
  const auto node = std::find_if(assembly.instanced_nodes.begin(), assembly.instanced_nodes.end(), [&](const auto& n) {
    return first_drawable >= n.first_drawable && first_drawable - n.first_drawable < n.order.size() * n.primitives;
  });
  TESSERA_CHECK(node != assembly.instanced_nodes.end(), "an instance belongs to a node");
  return node->primitives;
}

}  // namespace tessera::frontend

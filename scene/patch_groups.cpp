#include "scene/patch_groups.h"

#include <algorithm>
#include <limits>

#include "base/parallel.h"
#include "scene/clusters.h"

namespace tessera::scene {
namespace {

PatchGroups::Box empty_group_box() {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  return {{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
}

void add_point(const Vec3& point, PatchGroups::Box& box) {
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    box.low[a] = std::min(box.low[a], point[axis]);
    box.high[a] = std::max(box.high[a], point[axis]);
  }
}

// `add_patch(p, box)` widens a box by patch p.
template <class AddPatch>
PatchGroups group_patches(std::size_t patches, const AddPatch& add_patch) {
  PatchGroups groups;
  if (patches <= kPatchesPerGroup) return groups;
  const auto count = [](std::size_t parts) { return (parts + kPatchesPerGroup - 1) / kPatchesPerGroup; };
  std::vector<PatchGroups::Box>& lowest = groups.levels.emplace_back(count(patches), empty_group_box());
  parallel_for(lowest.size(), [&](std::size_t g) {
    const std::size_t end = std::min(patches, (g + 1) * kPatchesPerGroup);
    for (std::size_t p = g * kPatchesPerGroup; p < end; ++p) add_patch(p, lowest[g]);
  });
  while (groups.levels.back().size() > kPatchesPerGroup) {
    const std::vector<PatchGroups::Box>& below = groups.levels.back();
    std::vector<PatchGroups::Box> level(count(below.size()), empty_group_box());
    for (std::size_t b = 0; b < below.size(); ++b)
      for (std::size_t a = 0; a < 3; ++a) {
        PatchGroups::Box& box = level[b / kPatchesPerGroup];
        box.low[a] = std::min(box.low[a], below[b].low[a]);
        box.high[a] = std::max(box.high[a], below[b].high[a]);
      }
    groups.levels.push_back(std::move(level));
  }
  return groups;
}

}  // namespace

std::size_t PatchGroups::box_count() const {
  std::size_t count = 0;
  for (const std::vector<Box>& level : levels) count += level.size();
  return count;
}

PatchGroups group_clusters(const Primitive& primitive, const MeshClusters& clusters) {
  return group_patches(clusters.clusters.size(), [&](std::size_t p, PatchGroups::Box& box) {
    const Cluster& cluster = clusters.clusters[p];
    for (std::uint32_t v = 0; v < cluster.vertex_count; ++v)
      add_point(primitive.vertices.positions[clusters.vertices[cluster.first_vertex + v]], box);
  });
}

PatchGroups group_bezier_patches(const Vertices& control_points) {
  return group_patches(control_points.count() / 16, [&](std::size_t p, PatchGroups::Box& box) {
    for (std::size_t k = 0; k < 16; ++k) add_point(control_points.positions[16 * p + k], box);
  });
}

}  // namespace tessera::scene

#include "frontend/front_end.h"

#include <algorithm>
#include <array>

#include "base/parallel.h"
#include "frontend/bounds/oriented_box.h"
#include "frontend/patch_displacement.h"

namespace tessera::frontend {
namespace {

constexpr std::uint64_t kHeaderBytes = 32;  // [assumed] material, pattern, neighbours, state

// Heights that vertices of the range may be displaced by: its own footprint, and on shared edges and corners that of
// the patch that owns them.
ValueRange displacement_range(const FrameGeometry& frame, const PyramidLibrary& pyramids, const PosedDrawable& drawable,
                              std::uint32_t patch, const CellRange& cells, const ParameterRange& range) {
  const auto heights = [&](std::uint32_t p, const ParameterRange& r) {
    const PatchDisplacement d = patch_displacement(frame, drawable, p);
    // The coordinates are bilinear: over a box of parameters they lie in the hull of its corners.
    Vec2 low = d.coordinate(r.u0, r.v0), high = low;
    for (const Vec2& c : {d.coordinate(r.u1, r.v0), d.coordinate(r.u0, r.v1), d.coordinate(r.u1, r.v1)}) {
      low = glm::min(low, c);
      high = glm::max(high, c);
    }
    return pyramids.of(*d.material->texture).query(d.material->sampler, low, high, d.lod);
  };
  ValueRange all = heights(patch, range);
  const TessellationPattern& pattern = frame.patterns[patch];
  const std::uint32_t first = drawable.drawable->first_patch;
  const PatchNeighbours& neighbours = frame.assembly->neighbours[drawable.drawable->geometry][patch - first];
  const std::array<bool, 4> touches = {cells.j0 == 0, cells.j1 == pattern.nv, cells.i0 == 0, cells.i1 == pattern.nu};
  for (std::size_t e = 0; e < 4; ++e) {
    if (!touches[e]) continue;
    const PatchNeighbours::EdgeOwner& owner = neighbours.edges[e];
    const ParameterRange edge = {owner.edge == 3 ? 1.0f : 0.0f, owner.edge == 1 ? 1.0f : 0.0f, owner.edge == 2 ? 0.0f : 1.0f,
                                 owner.edge == 0 ? 0.0f : 1.0f};
    if (owner.patch + first != patch) all = all.hull(heights(owner.patch + first, edge));
  }
  for (const PatchNeighbours::CornerOwner& owner : neighbours.corners) {
    const float u = (owner.corner & 1) != 0 ? 1.0f : 0.0f, v = (owner.corner & 2) != 0 ? 1.0f : 0.0f;
    if (owner.patch + first != patch) all = all.hull(heights(owner.patch + first, {u, v, u, v}));
  }
  const Displacement& material = *drawable.material->displacement;
  const float a = material.scale * all.low + material.bias, b = material.scale * all.high + material.bias;
  return {std::min(a, b), std::max(a, b)};
}

MovingBox bezier_body(const FrameGeometry& frame, const PyramidLibrary& pyramids, const PosedDrawable& drawable,
                      std::uint32_t patch, const CellRange& cells) {
  const ParameterRange range = parameter_range(frame.patterns[patch], cells);
  std::array<ControlNet, 2> nets;
  for (std::size_t key = 0; key < 2; ++key) {
    const auto points = frame.control_points(drawable, patch, static_cast<int>(key));
    for (std::size_t i = 0; i < 16; ++i) nets[key][i] = DVec3(points[i]);
    nets[key] = sub_net(nets[key], range);
  }
  ValueRange displacement{0, 0};
  if (drawable.material->displacement) displacement = displacement_range(frame, pyramids, drawable, patch, cells, range);
  return bezier_box(nets, displacement);
}

MovingBox cluster_body(const FrameGeometry& frame, const PosedDrawable& drawable, std::uint32_t patch) {
  const MeshClusters& clusters = frame.assembly->clusters[drawable.drawable->geometry];
  const Cluster& cluster = clusters.clusters[patch - drawable.drawable->first_patch];
  return point_box(drawable.positions[0], drawable.positions[1],
                   std::span(clusters.vertices).subspan(cluster.first_vertex, cluster.vertex_count));
}

bool outside_frame(const ScreenBounds& bounds, int width, int height) {
  return bounds.x1 < 0 || bounds.y1 < 0 || bounds.x0 > static_cast<float>(width) || bounds.y0 > static_cast<float>(height);
}

void cut(const CellRange& range, int max_cells, std::vector<CellRange>& out) {
  const int width = range.i1 - range.i0, height = range.j1 - range.j0;
  if (width <= max_cells && height <= max_cells) {
    out.push_back(range);
    return;
  }
  CellRange first = range, second = range;
  if (width >= height) first.i1 = second.i0 = static_cast<std::uint8_t>(range.i0 + width / 2);
  else first.j1 = second.j0 = static_cast<std::uint8_t>(range.j0 + height / 2);
  cut(first, max_cells, out);
  cut(second, max_cells, out);
}

}  // namespace

PyramidLibrary::PyramidLibrary(const Assembly& assembly) {
  for (const Material& material : assembly.materials) {
    if (!material.displacement) continue;
    auto& slot = pyramids_[material.displacement->texture.get()];
    if (slot == nullptr) slot = std::make_unique<MinMaxPyramid>(*material.displacement->texture);
  }
}

std::uint64_t patch_record_bytes(const FrameGeometry& frame, std::uint32_t patch) {
  const PosedDrawable& drawable = frame.drawable_of(patch);
  const std::uint64_t keys = drawable.deforming ? 2 : 1;
  if (drawable.drawable->kind == Primitive::Kind::kBezierPatches) return kHeaderBytes + 16 * sizeof(Vec3) * keys;
  const Cluster& cluster =
      frame.assembly->clusters[drawable.drawable->geometry].clusters[patch - drawable.drawable->first_patch];
  return kHeaderBytes + cluster.vertex_count * sizeof(Vec3) * keys + cluster.cell_count * sizeof(ClusterCell);
}

SubPatchBody sub_patch_body(const FrameGeometry& frame, const PyramidLibrary& pyramids, std::uint32_t patch, const CellRange& range) {
  const PosedDrawable& drawable = frame.drawable_of(patch);
  const MovingBox box = drawable.drawable->kind == Primitive::Kind::kBezierPatches
                            ? bezier_body(frame, pyramids, drawable, patch, range)
                            : cluster_body(frame, drawable, patch);
  return {box_corners(box, drawable.to_raster), vertex_rounding_margin(box, drawable.to_raster)};
}

std::vector<CellRange> cut_patch(const FrameGeometry& frame, std::uint32_t patch, int max_cells) {
  const PosedDrawable& drawable = frame.drawable_of(patch);
  std::vector<CellRange> out;
  if (drawable.drawable->kind == Primitive::Kind::kBezierPatches) {
    cut({0, 0, frame.patterns[patch].nu, frame.patterns[patch].nv}, max_cells, out);
  } else {
    const Cluster& cluster =
        frame.assembly->clusters[drawable.drawable->geometry].clusters[patch - drawable.drawable->first_patch];
    out.push_back({0, 0, static_cast<std::uint8_t>(cluster.cell_count), 1});
  }
  return out;
}

FrontEndResult run_front_end(const FrameGeometry& frame, const PyramidLibrary& pyramids, const hardware::GpuConfiguration& gpu) {
  // Blocks of patches in parallel, joined in order.
  constexpr std::size_t kBlock = 64;
  const std::size_t patch_count = frame.assembly->patch_count(), block_count = (patch_count + kBlock - 1) / kBlock;
  std::vector<FrontEndResult> blocks(block_count);
  parallel_for(block_count, [&](std::size_t b) {
    FrontEndResult& result = blocks[b];
    for (std::size_t p = b * kBlock; p < std::min(patch_count, (b + 1) * kBlock); ++p) {
      const auto patch = static_cast<std::uint32_t>(p);
      ++result.counters.base_patches;
      result.ledger.read(hardware::Unit::kFrontend, hardware::Purpose::kPatchData,
                         hardware::burst_bytes(0, patch_record_bytes(frame, patch), static_cast<std::uint64_t>(gpu.memory_burst_bytes)));
      for (const CellRange& range : cut_patch(frame, patch, static_cast<int>(gpu.tessellator_sub_patch_cells))) {
        const SubPatchBody body = sub_patch_body(frame, pyramids, patch, range);
        ++result.counters.bounds_computed;
        const std::optional<ScreenBounds> bounds = screen_bounds(body.corners, frame.projection, body.margin);
        if (!bounds || outside_frame(*bounds, frame.request.width, frame.request.height)) {
          ++result.counters.culled_frustum;
          continue;
        }
        ++result.counters.sub_patches;
        result.sub_patches.push_back({patch, range, *bounds, body.corners});
      }
    }
  });
  FrontEndResult all;
  for (const FrontEndResult& block : blocks) {
    all.sub_patches.insert(all.sub_patches.end(), block.sub_patches.begin(), block.sub_patches.end());
    hardware::merge(all.counters, block.counters);
    all.ledger += block.ledger;
  }
  return all;
}

}  // namespace tessera::frontend

#include "tilecore/tessellation/vertex_groups.h"

#include <algorithm>
#include <cmath>

#include "base/check.h"

namespace tessera::tilecore {
namespace {

constexpr int kEverywhere = 1 << 29;
constexpr IntRect kPlane = {-kEverywhere, -kEverywhere, kEverywhere, kEverywhere};

IntRect joined(const IntRect& a, const IntRect& b) {
  if (a.empty()) return b;
  if (b.empty()) return a;
  return {std::min(a.x0, b.x0), std::min(a.y0, b.y0), std::max(a.x1, b.x1), std::max(a.y1, b.y1)};
}

// Hull of a leaf's moving box over the shutter and the lens. The margin covers the rounding allowance of the frustum
// test.
IntRect hull(const MicroMesh::Leaf& leaf, float lens_scale) {
  if (!(leaf.x_low <= leaf.x_high) || !(leaf.y_low <= leaf.y_high)) return {};
  const float lens = std::abs(leaf.lens_factor) * lens_scale;
  const auto margin = [&](float low, float high) {
    return lens + 0.0625f + 1e-5f * std::max(std::abs(low), std::abs(high));
  };
  const float x_low = leaf.x_low + std::min(leaf.drift_x, 0.0f), x_high = leaf.x_high + std::max(leaf.drift_x, 0.0f),
              y_low = leaf.y_low + std::min(leaf.drift_y, 0.0f), y_high = leaf.y_high + std::max(leaf.drift_y, 0.0f);
  const auto whole = [](float pixels) {
    return static_cast<int>(std::clamp(pixels, -static_cast<float>(kEverywhere), static_cast<float>(kEverywhere)));
  };
  return {whole(std::floor(x_low - margin(x_low, x_high))), whole(std::floor(y_low - margin(y_low, y_high))),
          whole(std::floor(x_high + margin(x_low, x_high))) + 1, whole(std::floor(y_high + margin(y_low, y_high))) + 1};
}

std::vector<VertexGroup> grid_groups(const scene::TessellationPattern& pattern, const scene::CellRange& range,
                                     const MicroMesh& mesh, float lens_scale) {
  constexpr int kSide = VertexGroup::kSide, kLeafSide = 4;  // leaves of the tessellator
  const int patch_columns = pattern.nu / kSide + 1;
  const int first_i = range.i0 / kSide, columns = range.i1 / kSide - first_i + 1, first_j = range.j0 / kSide,
            rows = range.j1 / kSide - first_j + 1;
  std::vector<VertexGroup> groups(static_cast<std::size_t>(columns * rows));
  const auto group = [&](int gi, int gj) -> VertexGroup& {
    return groups[static_cast<std::size_t>((gj - first_j) * columns + gi - first_i)];
  };
  for (int gj = first_j; gj < first_j + rows; ++gj)
    for (int gi = first_i; gi < first_i + columns; ++gi) {
      VertexGroup& g = group(gi, gj);
      g.number = static_cast<std::uint16_t>(gj * patch_columns + gi);
      g.room = static_cast<std::uint8_t>(std::min(kSide, pattern.nu + 1 - gi * kSide) *
                                         std::min(kSide, pattern.nv + 1 - gj * kSide));
      for (int j = std::max<int>(range.j0, gj * kSide); j <= std::min<int>(range.j1, gj * kSide + kSide - 1); ++j)
        for (int i = std::max<int>(range.i0, gi * kSide); i <= std::min<int>(range.i1, gi * kSide + kSide - 1); ++i)
          g.vertices |= std::uint64_t{1} << (j % kSide * kSide + i % kSide);
      if (!mesh.clipped_cells.empty()) g.pixels = kPlane;
    }
  if (!mesh.clipped_cells.empty()) return groups;
  std::size_t leaf = 0;
  for (int lj = range.j0; lj < range.j1; lj += kLeafSide)
    for (int li = range.i0; li < range.i1; li += kLeafSide, ++leaf) {
      const IntRect pixels = hull(mesh.leaves[leaf], lens_scale);
      const int end_i = std::min<int>(li + kLeafSide, range.i1), end_j = std::min<int>(lj + kLeafSide, range.j1);
      for (int gj = lj / kSide; gj <= end_j / kSide; ++gj)
        for (int gi = li / kSide; gi <= end_i / kSide; ++gi)
          group(gi, gj).pixels = joined(group(gi, gj).pixels, pixels);
    }
  return groups;
}

// A cluster has no more vertices than a group holds.
VertexGroup cluster_group(const MicroMesh& mesh, float lens_scale) {
  TESSERA_CHECK(mesh.vertex_count > 0 && mesh.vertex_count <= VertexGroup::kVertices, "clusters fit a group");
  VertexGroup group;
  group.room = static_cast<std::uint8_t>(mesh.vertex_count);
  group.vertices = ~std::uint64_t{0} >> (VertexGroup::kVertices - mesh.vertex_count);
  for (const MicroMesh::Leaf& leaf : mesh.leaves) group.pixels = joined(group.pixels, hull(leaf, lens_scale));
  if (!mesh.clipped_cells.empty()) group.pixels = kPlane;
  return group;
}

}  // namespace

std::vector<VertexGroup> vertex_groups(const scene::FrameGeometry& frame, std::uint32_t patch,
                                       const scene::CellRange& range, const MicroMesh& mesh, float lens_scale) {
  if (scene::has_grid(*frame.drawable_of(patch).drawable))
    return grid_groups(frame.pattern_of(patch), range, mesh, lens_scale);
  return {cluster_group(mesh, lens_scale)};
}

}  // namespace tessera::tilecore

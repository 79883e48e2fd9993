#include "baselines/meshlets.h"

#include <algorithm>
#include <utility>

#include "base/check.h"

namespace tessera::baselines {
namespace {

int parts_of(int cells, int each) { return (cells + each - 1) / each; }

}  // namespace

MeshletCells meshlet_cells(int columns, int rows) {
  MeshletCells best{0, 0};
  std::pair<int, int> least{0, 0};  // number of parts, then of their vertices
  for (int a = 1; a <= std::min(columns, kMeshletSegments); ++a)
    for (int b = 1; b <= std::min(rows, kMeshletSegments); ++b) {
      if (static_cast<std::size_t>((a + 1) * (b + 1)) > kMeshletVertices ||
          static_cast<std::size_t>(2 * a * b) > kMeshletTriangles)
        continue;
      const int across = parts_of(columns, a), down = parts_of(rows, b);
      const std::pair<int, int> of{across * down, (columns + across) * (rows + down)};
      if (best.columns == 0 || of < least) best = {a, b}, least = of;
    }
  return best;
}

std::vector<Meshlet> cut_into_meshlets(const TessellatedPatch& patch) {
  std::vector<Meshlet> meshlets(1);
  MeshletCells cells{1, 1};
  int across = 1;
  if (patch.columns > 0) {
    cells = meshlet_cells(patch.columns, patch.rows);
    across = parts_of(patch.columns, cells.columns);
    meshlets.resize(static_cast<std::size_t>(across * parts_of(patch.rows, cells.rows)));
  }
  for (std::uint32_t t = 0; t < patch.triangles.size(); ++t) {
    std::size_t of = 0;
    if (patch.columns > 0) {
      const int cell = static_cast<int>(patch.triangle_numbers[t] / 2);
      of = static_cast<std::size_t>(cell / patch.columns / cells.rows * across + cell % patch.columns / cells.columns);
    }
    meshlets[of].numbers.push_back(t);
  }
  for (Meshlet& meshlet : meshlets) {
    meshlet.part = meshlets.size() > 1;
    for (const std::uint32_t t : meshlet.numbers)
      meshlet.vertices.insert(meshlet.vertices.end(), patch.triangles[t].begin(), patch.triangles[t].end());
    std::sort(meshlet.vertices.begin(), meshlet.vertices.end());
    meshlet.vertices.erase(std::unique(meshlet.vertices.begin(), meshlet.vertices.end()), meshlet.vertices.end());
    TESSERA_CHECK(meshlet.vertices.size() <= kMeshletVertices && meshlet.numbers.size() <= kMeshletTriangles,
                  "a meshlet keeps its limits");
    for (const std::uint32_t t : meshlet.numbers) {
      BlockTriangle& triangle = meshlet.triangles.emplace_back();
      for (std::size_t k = 0; k < 3; ++k)
        triangle[k] = static_cast<std::uint8_t>(
            std::lower_bound(meshlet.vertices.begin(), meshlet.vertices.end(), patch.triangles[t][k]) -
            meshlet.vertices.begin());
    }
  }
  return meshlets;
}

std::vector<Meshlet> TaskShader::run(const TessellatedPatch& patch, const TriangleList& list) {
  std::vector<Meshlet> meshlets = cut_into_meshlets(patch);
  if (meshlets.size() > 1) counts_.parts += meshlets.size();
  std::erase_if(meshlets, [&](const Meshlet& meshlet) {
    const auto kept = [&](std::uint32_t t) { return list.fates[t] == TriangleFate::kKept; };
    if (std::none_of(meshlet.numbers.begin(), meshlet.numbers.end(), kept)) return true;
    ++counts_.lookups;
    const auto extent = setup_.extent(patch, meshlet.vertices);
    const bool hidden = extent && depths_.hides(*extent);
    counts_.hidden += hidden ? 1 : 0;
    return hidden;
  });
  return meshlets;
}

}  // namespace tessera::baselines

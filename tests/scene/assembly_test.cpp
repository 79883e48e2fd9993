#include "scene/assembly.h"
#include "tests/support/tests.h"

namespace tessera::scene::assembly_test {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

// The smallest rotation of a triangle: equal for triangles that wind alike.
Triangle canonical(Triangle t) {
  while (t[0] != *std::min_element(t.begin(), t.end())) std::rotate(t.begin(), t.begin() + 1, t.end());
  return t;
}

Primitive grid_mesh(int n, Random& random) {
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> indices;
  for (int y = 0; y <= n; ++y)
    for (int x = 0; x <= n; ++x)
      positions.emplace_back(static_cast<float>(x), static_cast<float>(y), random.uniform(0, 1));
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x) {
      const auto a = static_cast<std::uint32_t>(y * (n + 1) + x), row = static_cast<std::uint32_t>(n + 1);
      for (const std::uint32_t i : {a, a + 1, a + row + 1, a, a + row + 1, a + row}) indices.push_back(i);
    }
  return test::triangles(positions, indices);
}

std::multiset<Triangle> triangles_of(const MeshClusters& clusters) {
  std::multiset<Triangle> out;
  for (const Cluster& cluster : clusters.clusters)
    for (std::uint32_t c = 0; c < cluster.cell_count; ++c) {
      const ClusterCell& cell = clusters.cells[cluster.first_cell + c];
      const auto vertex = [&](std::size_t k) { return clusters.vertices[cluster.first_vertex + cell.corner[k]]; };
      out.insert(canonical({vertex(0), vertex(1), vertex(2)}));
      if (!cell.single()) out.insert(canonical({vertex(0), vertex(2), vertex(3)}));
    }
  return out;
}

TEST(Clusters, HoldEveryTriangleOnceWithItsWinding) {
  Random random(1);
  for (const int n : {1, 2, 9, 30}) {
    const Primitive mesh = grid_mesh(n, random);
    std::multiset<Triangle> expected;
    for (std::size_t t = 0; t < mesh.indices.size(); t += 3)
      expected.insert(canonical({mesh.indices[t], mesh.indices[t + 1], mesh.indices[t + 2]}));
    EXPECT_EQ(triangles_of(build_clusters(mesh)), expected);
  }
}

TEST(Clusters, StayWithinTheLimitsOfAMeshShader) {
  Random random(2);
  const MeshClusters clusters = build_clusters(grid_mesh(40, random));
  for (const Cluster& cluster : clusters.clusters) {
    EXPECT_LE(cluster.vertex_count, kMaxClusterVertices);
    EXPECT_LE(cluster.triangle_count, kMaxClusterTriangles);
  }
}

TEST(Clusters, PairMostTrianglesOfAGridIntoQuads) {
  Random random(3);
  const MeshClusters clusters = build_clusters(grid_mesh(20, random));
  const auto singles =
      std::count_if(clusters.cells.begin(), clusters.cells.end(), [](const ClusterCell& c) { return c.single(); });
  EXPECT_LT(static_cast<double>(singles), 0.1 * static_cast<double>(clusters.cells.size()));
}

TEST(Clusters, OfAnEmptyPrimitiveAreNone) {
  EXPECT_TRUE(build_clusters(test::triangles({{0, 0, 0}}, {})).clusters.empty());
}

TEST(Neighbours, SharedEdgesHaveOneOwnerAndTheRightDirection) {
  // Two patches side by side: edge u=1 of the first is edge u=0 of the second.
  auto points = test::flat_patch({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  const auto second = test::flat_patch({1, 0, 0}, {1, 0, 0}, {0, 1, 0});
  points.insert(points.end(), second.begin(), second.end());
  const auto n = find_neighbours(test::patches(points).vertices);
  EXPECT_EQ(n[1].edges[2].patch, 0u);
  EXPECT_EQ(n[1].edges[2].edge, 3);
  EXPECT_FALSE(n[1].edges[2].reversed);
  EXPECT_EQ(n[0].edges[3].patch, 0u);
  EXPECT_EQ(n[1].edges[3].patch, 1u);
  EXPECT_EQ(n[1].corners[0].patch, 0u);
  EXPECT_EQ(n[1].corners[0].corner, 1);
}

TEST(Neighbours, AnEdgeThatRunsTheOtherWayIsMarkedReversed) {
  auto points = test::flat_patch({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  auto second = test::flat_patch({1, 0, 0}, {1, 0, 0}, {0, 1, 0});
  std::vector<Vec3> turned(16);  // v runs down
  for (std::size_t j = 0; j < 4; ++j)
    for (std::size_t i = 0; i < 4; ++i) turned[4 * j + i] = second[4 * (3 - j) + i];
  points.insert(points.end(), turned.begin(), turned.end());
  const auto n = find_neighbours(test::patches(points).vertices);
  EXPECT_EQ(n[1].edges[2].patch, 0u);
  EXPECT_TRUE(n[1].edges[2].reversed);
}

TEST(Neighbours, PointsThatMoveApartAreNotShared) {
  auto points = test::flat_patch({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  const auto second = test::flat_patch({1, 0, 0}, {1, 0, 0}, {0, 1, 0});
  points.insert(points.end(), second.begin(), second.end());
  Primitive primitive = test::patches(points);
  MorphTarget target;
  target.positions.assign(32, Vec3(0.0f));
  for (std::size_t i = 16; i < 32; ++i) target.positions[i] = {0, 0, 1};
  primitive.vertices.morph_targets.push_back(target);
  EXPECT_EQ(find_neighbours(primitive.vertices)[1].edges[2].patch, 1u);
}

TEST(Neighbours, CollapsedEdgesAreMarked) {
  auto points = test::flat_patch({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  for (std::size_t i = 0; i < 4; ++i) points[12 + i] = {0.5f, 1, 0};
  const auto n = find_neighbours(test::patches(points).vertices);
  EXPECT_TRUE(n[0].edges[1].collapsed);
  EXPECT_FALSE(n[0].edges[0].collapsed);
  EXPECT_EQ(n[0].corners[2].corner, 2);
  EXPECT_EQ(n[0].corners[3].corner, 2);  // both corners are one point
}

TEST(Neighbours, EveryEdgeOfAClosedSurfaceIsSharedByTwoPatches) {
  const auto n = find_neighbours(test::closed_patches(kNone).vertices);
  std::multiset<std::pair<std::uint32_t, int>> owners;
  for (const auto& patch : n)
    for (const auto& edge : patch.edges) owners.emplace(edge.patch, edge.edge);
  for (const auto& owner : owners) EXPECT_EQ(owners.count(owner), 2u);
}

TEST(Assembly, NumbersBasePatchesOfAllNodesThatDrawAMesh) {
  Capture capture;
  test::add_node(capture, test::closed_patches(kNone));
  Random random(4);
  test::add_node(capture, grid_mesh(12, random));
  Node again;
  again.mesh = 0;
  capture.nodes.push_back(again);
  capture.roots.push_back(2);
  Node hidden = again;  // not in the scene
  capture.nodes.push_back(hidden);
  const Assembly assembly = assemble(capture);
  ASSERT_EQ(assembly.drawables.size(), 3u);
  EXPECT_EQ(assembly.drawables[0].geometry, assembly.drawables[2].geometry);
  std::uint32_t next = 0;
  for (std::size_t d = 0; d < 3; ++d) {
    EXPECT_EQ(assembly.drawables[d].first_patch, next);
    for (std::uint32_t p = 0; p < assembly.drawables[d].patch_count; ++p) EXPECT_EQ(assembly.patch_drawable[next++], d);
  }
  EXPECT_EQ(assembly.patch_count(), next);
  EXPECT_EQ(assembly.materials.size(), 1u);  // the default material
}

}  // namespace
}  // namespace tessera::scene::assembly_test

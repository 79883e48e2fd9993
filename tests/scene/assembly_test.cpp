#include "scene/assembly.h"
#include "tests/support/tests.h"

namespace tessera::scene::assembly_test {
namespace {

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
  test::add_node(capture, test::wavy_grid(12, 4));
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

// Leaves whose cells are said to form a grid: the kernels fetch each vertex once. Against the same leaves without.
#include "base/simd_targets.h"
#include "tests/support/tests.h"
#include "tests/tilecore/visibility/method_mesh.h"
#include "tilecore/tessellation/mesh_store.h"
#include "tilecore/visibility/method_choice.h"

namespace tessera::tilecore::leaf_grid_test {
namespace {

std::size_t grids_of(const MicroMesh& mesh) {
  std::size_t grids = 0;
  for (const MicroMesh::Leaf& leaf : mesh.leaves) grids += leaf.grid.columns != 0 ? 1 : 0;
  return grids;
}

struct Traced {
  std::set<HitSet::Key> hits;
  std::uint64_t box_tests, triangle_tests, sample_hits;
  bool operator==(const Traced&) const = default;
};

Traced trace(const MethodMesh& m) {
  HitSet sink;
  VisibilityWork work;
  if (m.effects.motion || m.effects.lens) {
    std::vector<TimeRange> times(m.mesh.leaves.size());
    touching_times(m.mesh.leaves, m.samples.pixels, m.effects.motion, m.samples.lens_scale, times);
    trace_leaves(m.mesh, times, m.samples, m.effects, m.settings, sink, work);
  } else {
    raster_mesh(m.mesh, m.samples, m.settings, sink, work);
  }
  sink.flush();
  return {sink.hits, work.box_tests, work.triangle_tests, work.sample_hits};
}

MethodMesh random_grid(test::Random& random, int trial) {
  MeshOptions options;
  options.effects = {(trial & 1) != 0, (trial & 2) != 0};
  options.orthographic = (trial & 4) != 0;
  options.spp = random.coin() ? 4 : 16;
  return random_mesh(random, options);
}

TEST(LeafGrid, HitsAndCountsAreTheSameWithoutItOnEveryInstructionSet) {
  test::Random random(81);
  std::size_t hits = 0;
  for (int trial = 0; trial < 32; ++trial) {
    const MethodMesh mesh = random_grid(random, trial);
    EXPECT_GT(grids_of(mesh.mesh), 0u);
    MethodMesh cells = mesh;
    for (MicroMesh::Leaf& leaf : cells.mesh.leaves) leaf.grid = {};
    const Traced expected = trace(cells);
    EXPECT_EQ(expected.hits, all_pairs(cells));
    hits += expected.hits.size();
    for (const std::string& target : simd_target_names()) {
      force_simd_target(target);
      EXPECT_TRUE(trace(mesh) == expected) << target << ", trial " << trial;
      EXPECT_TRUE(trace(cells) == expected) << target << ", trial " << trial;
    }
    force_simd_target("");
  }
  EXPECT_GT(hits, 1000u);
}

TEST(LeafGrid, AWrongOneIsCaught) {
  test::Random random(82);
  std::size_t caught = 0;
  for (int trial = 0; trial < 8; ++trial) {
    const MethodMesh mesh = random_grid(random, 1);
    MethodMesh wrong = mesh;
    for (MicroMesh::Leaf& leaf : wrong.mesh.leaves) --leaf.grid.stride;
    const Traced expected = trace(mesh);
    caught += !expected.hits.empty() && trace(wrong).hits != expected.hits ? 1 : 0;
  }
  EXPECT_GT(caught, 4u);
}

TEST(LeafGrid, ACellThatLosesATriangleEndsIt) {
  for (const bool degenerate : {false, true}) {
    MethodMesh mesh;
    mesh.resize(36);
    for (std::size_t v = 0; v < 36; ++v) mesh.place(v, 2 * static_cast<float>(v % 6), 2 * static_cast<float>(v / 6), 2);
    if (degenerate) mesh.place(1, 0, 0, 2);  // onto vertex 0
    mesh.add_grid_cells(5);
    mesh.finish({0, 0, 16, 16}, 4);
    EXPECT_EQ(grids_of(mesh.mesh), degenerate ? 3u : 4u);
    EXPECT_EQ(trace(mesh).hits, all_pairs(mesh));
  }
}

// The corners of the cells are where the grid says.
TEST(LeafGrid, NamesTheCornersOfTessellatedCells) {
  test::Random random(83);
  const MethodMesh mesh = random_grid(random, 1);
  for (std::size_t l = 0; l < mesh.mesh.leaves.size(); ++l) {
    const MicroMesh::Leaf& leaf = mesh.mesh.leaves[l];
    for (std::size_t cell = 0; cell < leaf.cell_count && leaf.grid.columns != 0; ++cell) {
      const auto k = static_cast<std::int32_t>(cell);
      const std::int32_t a = leaf.grid.first + k / leaf.grid.columns * leaf.grid.stride + k % leaf.grid.columns;
      const std::array<std::int32_t, 4> expected = {a, a + 1, a + 1 + leaf.grid.stride, a + leaf.grid.stride};
      for (std::size_t c = 0; c < 4; ++c) EXPECT_EQ(mesh.mesh.corner[c][l * kLeafCells + cell], expected[c]);
    }
  }
}

// A store that has room for one mesh makes the second in the arrays of the first; its costs are its own.
TEST(LeafGrid, AStoredMeshHasCostsOfItsOwn) {
  TestFrame test;
  std::vector<Vec3> small = {{-1, -1, -3}, {1, -1, -3}, {0, 1, -3}}, large = {{-3, -3, -4}, {3, -3, -4}, {0, 3, -4}};
  for (auto* corners : {&small, &large}) {
    const int node = test::add_node(*test.capture, test::triangles(*corners, {0, 1, 2}));
    test::add_motion(*test.capture, node, {1, 0, 0});
  }
  test::add_camera(*test.capture, {0, 0, 0}, {});
  test.pose();
  MeshStore store(1);
  std::vector<double> costs;
  for (const std::uint32_t patch : {0u, 1u, 0u}) {
    const MeshStore::Item& item = store.get(*test.frame, patch, whole_patch(*test.frame, patch), {true, false});
    EXPECT_EQ(item.costs({true, false}).by_class, test_costs(item.mesh, {true, false}).by_class);
    costs.push_back(item.costs({true, false}).by_class);
  }
  EXPECT_NE(costs[0], costs[1]);
  EXPECT_EQ(costs[0], costs[2]);
}

}  // namespace
}  // namespace tessera::tilecore::leaf_grid_test

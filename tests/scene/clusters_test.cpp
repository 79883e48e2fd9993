// Clusters, also clusters that are cut off triangles in the order of clusters.
#include "scene/clusters.h"
#include "scene/limits.h"
#include "tests/support/captures.h"
#include "tests/support/read_asset.h"
#include "tests/support/tests.h"

namespace tessera::scene::clusters_test {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

Triangle smallest_rotation(const Triangle& t) {
  return std::min({t, Triangle{t[1], t[2], t[0]}, Triangle{t[2], t[0], t[1]}});
}

// Any triangles over some vertices: edges with many triangles. `proper`: no corner comes twice in a triangle.
Primitive tangle(std::size_t triangles, int vertices, std::uint32_t seed, bool proper = true) {
  Random random(seed);
  std::vector<Vec3> positions;
  for (int v = 0; v < vertices; ++v) positions.push_back(random.in_box(1));
  std::vector<std::uint32_t> indices;
  while (indices.size() < 3 * triangles) {
    const auto corner = [&] { return static_cast<std::uint32_t>(random.integer(0, vertices - 1)); };
    const Triangle t = {corner(), corner(), corner()};
    if (!proper || (t[0] != t[1] && t[1] != t[2] && t[2] != t[0])) indices.insert(indices.end(), t.begin(), t.end());
  }
  return test::triangles(positions, indices);
}

// The triangles of each cluster, in no order.
std::vector<std::multiset<Triangle>> contents(const MeshClusters& clusters) {
  std::vector<std::multiset<Triangle>> out;
  for (const Cluster& cluster : clusters.clusters) {
    std::multiset<Triangle>& triangles = out.emplace_back();
    for (std::uint32_t c = 0; c < cluster.cell_count; ++c) {
      const ClusterCell& cell = clusters.cells[cluster.first_cell + c];
      const auto vertex = [&](std::size_t k) { return clusters.vertices[cluster.first_vertex + cell.corner[k]]; };
      triangles.insert(smallest_rotation({vertex(0), vertex(1), vertex(2)}));
      if (!cell.single()) triangles.insert(smallest_rotation({vertex(0), vertex(2), vertex(3)}));
    }
  }
  return out;
}

Primitive in_order(Primitive primitive) {
  primitive.indices = cluster_order(primitive);
  primitive.in_cluster_order = true;
  return primitive;
}

// The first corner of each triangle moved on, as codecs of triangles do.
Primitive turned(Primitive primitive) {
  for (std::size_t t = 0; t + 2 < primitive.indices.size(); t += 3)
    std::rotate(primitive.indices.begin() + static_cast<std::ptrdiff_t>(t),
                primitive.indices.begin() + static_cast<std::ptrdiff_t>(t + 1 + t / 3 % 2),
                primitive.indices.begin() + static_cast<std::ptrdiff_t>(t + 3));
  return primitive;
}

// Squares of the largest floats are infinite; meshoptimizer then finds no clusters at all.
TEST(Clusters, DoNotDependOnTheSizeOfTheMesh) {
  Primitive mesh = test::wavy_grid(40, 3);
  const std::vector<std::multiset<Triangle>> small = contents(build_clusters(mesh));
  for (const int exponent : {-120, -60, 47, 49, 90, 120}) {
    Primitive large = mesh;
    for (Vec3& p : large.vertices.positions) p *= std::ldexp(1.0f, exponent);
    const std::vector<std::multiset<Triangle>> found = contents(build_clusters(large));
    std::size_t triangles = 0;
    for (const auto& cluster : found) triangles += cluster.size();
    EXPECT_EQ(triangles, mesh.indices.size() / 3) << exponent;
    if (exponent > 0) {
      EXPECT_EQ(found, small) << exponent;
    }
  }
}

TEST(Clusters, HoldEveryTriangleOnceWithItsWinding) {
  for (const int n : {1, 2, 9, 30}) {
    const Primitive mesh = test::wavy_grid(n, 1);
    std::multiset<Triangle> expected, found;
    for (std::size_t t = 0; t < mesh.indices.size(); t += 3)
      expected.insert(smallest_rotation({mesh.indices[t], mesh.indices[t + 1], mesh.indices[t + 2]}));
    for (const std::multiset<Triangle>& cluster : contents(build_clusters(mesh)))
      found.insert(cluster.begin(), cluster.end());
    EXPECT_EQ(found, expected);
  }
}

TEST(Clusters, StayWithinTheLimitsOfAMeshShader) {
  for (const Cluster& cluster : build_clusters(test::wavy_grid(40, 2)).clusters) {
    EXPECT_LE(cluster.vertex_count, kMaxClusterVertices);
    EXPECT_LE(cluster.triangle_count, kMaxClusterTriangles);
  }
}

TEST(Clusters, PairMostTrianglesOfAGridIntoQuads) {
  const MeshClusters clusters = build_clusters(test::wavy_grid(20, 3));
  const auto singles =
      std::count_if(clusters.cells.begin(), clusters.cells.end(), [](const ClusterCell& c) { return c.single(); });
  EXPECT_LT(static_cast<double>(singles), 0.1 * static_cast<double>(clusters.cells.size()));
}

TEST(Clusters, AnEmptyPrimitiveHasNone) {
  EXPECT_TRUE(build_clusters(test::triangles({{0, 0, 0}}, {})).clusters.empty());
}

TEST(ClusterOrder, CutsIntoTheClustersThatWereFound) {  // CO2
  for (const Primitive& mesh : {test::wavy_grid(1, 1), test::wavy_grid(9, 2), test::wavy_grid(60, 3),
                                tangle(3000, 900, 4), tangle(500, 9, 5), test::wavy_grid(300, 6)}) {
    const auto found = contents(build_clusters(mesh));
    EXPECT_TRUE(contents(build_clusters(in_order(mesh))) == found);
    EXPECT_TRUE(contents(build_clusters(turned(in_order(mesh)))) == found);
  }
}

TEST(ClusterOrder, OfTrianglesWhoseCornersComeTwiceCutsIntoClustersOfTheSameSizes) {  // CO2
  for (const Primitive& mesh : {tangle(3000, 900, 4, false), tangle(500, 9, 5, false), tangle(2000, 80, 6, false)}) {
    const auto sizes = [](const MeshClusters& clusters) {
      std::vector<std::uint32_t> out;
      for (const Cluster& cluster : clusters.clusters) out.push_back(cluster.triangle_count);
      return out;
    };
    EXPECT_EQ(sizes(build_clusters(in_order(mesh))), sizes(build_clusters(mesh)));
  }
}

TEST(ClusterOrder, OfAMeshOfSeveralRangesCutsIntoTheSameClusters) {  // CO2
  const Primitive mesh = test::wavy_grid(400, 7);
  ASSERT_GT(mesh.indices.size(), 2 * 3 * kClusterRangeTriangles);
  EXPECT_TRUE(contents(build_clusters(in_order(mesh))) == contents(build_clusters(mesh)));
}

// The twin: triangles in another order are cut into other clusters, more of them.
TEST(ClusterOrder, OfAWrongClaimGivesSoundClustersThatAreWorse) {  // CO1, CO3
  Primitive mesh = test::wavy_grid(60, 8);
  std::vector<std::size_t> order(mesh.indices.size() / 3);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::mt19937 engine(1);
  std::shuffle(order.begin(), order.end(), engine);
  Primitive shuffled = mesh;
  for (std::size_t t = 0; t < order.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) shuffled.indices[3 * t + k] = mesh.indices[3 * order[t] + k];
  shuffled.in_cluster_order = true;
  for (const Primitive& claimed : {shuffled, tangle(4000, 3000, 9), tangle(4000, 3, 10), tangle(1, 3, 11)}) {
    Primitive wrong = claimed;
    wrong.in_cluster_order = true;
    const MeshClusters clusters = build_clusters(wrong);
    std::multiset<Triangle> all, expected;
    for (const auto& cluster : contents(clusters)) all.insert(cluster.begin(), cluster.end());
    for (std::size_t i = 0; i + 2 < wrong.indices.size(); i += 3)
      expected.insert(smallest_rotation({wrong.indices[i], wrong.indices[i + 1], wrong.indices[i + 2]}));
    EXPECT_TRUE(all == expected);
    EXPECT_LE(clusters.clusters.size(), cluster_count_bound(wrong.indices.size()));
    for (const Cluster& cluster : clusters.clusters) {
      EXPECT_LE(cluster.vertex_count, kMaxClusterVertices);
      EXPECT_LE(cluster.triangle_count, kMaxClusterTriangles);
      EXPECT_GT(cluster.triangle_count, 0u);
    }
  }
  EXPECT_GT(build_clusters(shuffled).clusters.size(), 2 * build_clusters(mesh).clusters.size());
}

// Each triangle with the next free neighbour, by comparing it with all that follow.
std::size_t pairs_by_comparing(const std::vector<LocalTriangle>& triangles, std::vector<ClusterCell>& cells) {
  std::vector<bool> used(triangles.size(), false);
  std::size_t pairs = 0;
  for (std::size_t s = 0; s < triangles.size(); ++s) {
    if (used[s]) continue;
    const LocalTriangle& p = triangles[s];
    ClusterCell cell{{p[0], p[1], p[2], p[2]}};
    bool found = false;
    for (std::size_t t = s + 1; t < triangles.size() && !found; ++t)
      for (std::size_t i = 0; i < 3 && !used[t] && !found; ++i)
        for (std::size_t j = 0; j < 3 && !found; ++j) {
          const LocalTriangle& q = triangles[t];
          if (q[j] != p[i] || q[(j + 1) % 3] != p[(i + 2) % 3] || q[(j + 2) % 3] == p[(i + 1) % 3]) continue;
          cell = {{p[i], p[(i + 1) % 3], p[(i + 2) % 3], q[(j + 2) % 3]}};
          found = used[t] = true;
          ++pairs;
        }
    cells.push_back(cell);
  }
  return pairs;
}

TEST(Clusters, PairTrianglesAsComparingEachWithAllDoes) {
  Random random(12);
  std::size_t pairs = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const int vertices = random.integer(1, 64), count = random.integer(1, 124);
    std::vector<LocalTriangle> triangles;
    for (int t = 0; t < count; ++t) {
      // Every other time as in a strip, so that edges have one or two triangles.
      const auto corner = [&](int k) {
        return static_cast<std::uint8_t>(trial % 2 == 0 ? random.integer(0, vertices - 1)
                                                        : (t + (t % 2 == 0 ? k : 2 - k)) % vertices);
      };
      triangles.push_back({corner(0), corner(1), corner(2)});
    }
    std::vector<ClusterCell> cells, expected;
    pair_triangles(triangles, cells);
    pairs += pairs_by_comparing(triangles, expected);
    ASSERT_EQ(cells.size(), expected.size());
    for (std::size_t c = 0; c < cells.size(); ++c) ASSERT_EQ(cells[c].corner, expected[c].corner) << trial;
  }
  EXPECT_GT(pairs, 1000u);
}

// ---- The extension ----------------------------------------------------------------------------------------------

Capture with_claim(const json& claim) {
  test::GltfAsset asset = test::everything_asset();
  asset.document["meshes"][0]["primitives"][0]["extensions"]["TESSERA_clusters"] = claim;
  asset.document["extensionsUsed"].push_back("TESSERA_clusters");
  return test::read_asset(asset);
}

TEST(ClusterClaims, CountOnlyWithTheLimitsOfThisReader) {
  const json ours = {
      {"maxVertices", kMaxClusterVertices}, {"maxTriangles", kMaxClusterTriangles}, {"range", kClusterRangeTriangles}};
  EXPECT_TRUE(with_claim(ours).meshes[0].primitives[0].in_cluster_order);
  for (const char* member : {"maxVertices", "maxTriangles", "range"})
    for (const json& value : {json(3), json(2000000), json(63 + 65.0)}) {
      json other = ours;
      other[member] = value;
      const Capture capture = with_claim(other);
      EXPECT_FALSE(capture.meshes[0].primitives[0].in_cluster_order) << other;
      EXPECT_TRUE(capture.notices.empty());
    }
  EXPECT_TRUE(with_claim(ours).notices.empty());
}

TEST(ClusterClaims, ThatAreNoneAreRefused) {
  for (const json& claim : {json::object(), json(3), json{{"maxVertices", 64}, {"maxTriangles", 124}},
                            json{{"maxVertices", 2}, {"maxTriangles", 124}, {"range", 131072}},
                            json{{"maxVertices", 64}, {"maxTriangles", 0}, {"range", 131072}},
                            json{{"maxVertices", 64}, {"maxTriangles", 124}, {"range", "all"}}})
    EXPECT_THROW(with_claim(claim), InputError) << claim;
}

}  // namespace
}  // namespace tessera::scene::clusters_test

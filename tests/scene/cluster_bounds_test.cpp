// Boxes and cones of clusters that rest.
#include "scene/cluster_bounds.h"
#include "scene/clusters.h"
#include "tests/support/tests.h"

namespace tessera::scene::cluster_bounds_test {
namespace {

// A turned, bent strip of quads: oriented boxes are much smaller than aligned ones.
Primitive turned_strip(Random& random, float bend) {
  const DQuat turn = glm::normalize(DQuat(1, DVec3(random.in_box(1))));
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> indices;
  constexpr std::uint32_t kLength = 200, kWidth = 4;
  for (std::uint32_t y = 0; y <= kWidth; ++y)
    for (std::uint32_t x = 0; x <= kLength; ++x)
      positions.emplace_back(turn * (DVec3(x, y, 0) + DVec3(0, 0, random.uniform(-bend, bend)) + DVec3(7, -90, 3)));
  for (std::uint32_t y = 0; y < kWidth; ++y)
    for (std::uint32_t x = 0; x < kLength; ++x) {
      const std::uint32_t a = y * (kLength + 1) + x, b = a + kLength + 1;
      for (const std::uint32_t i : {a, a + 1, b + 1, a, b + 1, b}) indices.push_back(i);
    }
  return test::triangles(positions, indices);
}

struct Checked {
  std::size_t clusters = 0, turned = 0, cones = 0;
  std::size_t outside = 0, larger = 0, off_cone = 0, too_small = 0;
};
void check_triangle(const ClusterBound& bound, const DVec3& p, const DVec3& q, const DVec3& r, Checked& out) {
  const DVec3 normal = glm::cross(q - p, r - p);
  const double a = glm::length(q - p), b = glm::length(r - q), c = glm::length(p - r), size = glm::length(normal);
  const DVec3 axis = glm::normalize(DVec3(bound.cone_axis[0], bound.cone_axis[1], bound.cone_axis[2]));
  if (glm::dot(normal, axis) < static_cast<double>(bound.cone_cosine) * size) ++out.off_cone;
  const double edges = a + b + c - std::min({a, b, c});
  if (size < static_cast<double>(bound.least_height) * edges || edges < static_cast<double>(bound.least_edges))
    ++out.too_small;
}
void check_bounds(const Primitive& primitive, const MeshClusters& clusters, const std::vector<ClusterBound>& bounds,
                  Checked& out) {
  for (std::size_t c = 0; c < bounds.size(); ++c) {
    const ClusterBound& bound = bounds[c];
    const Cluster& cluster = clusters.clusters[c];
    const auto point = [&](std::uint32_t corner) {
      return DVec3(primitive.vertices.positions[clusters.vertices[cluster.first_vertex + corner]]);
    };
    const auto axes = bound.frame();
    DVec3 low(1e300), high(-1e300);
    for (std::uint32_t v = 0; v < cluster.vertex_count; ++v) {
      low = glm::min(low, point(v)), high = glm::max(high, point(v));
      for (std::size_t a = 0; a < 3; ++a) {
        const double s = glm::dot(axes[a], point(v));
        if (s < static_cast<double>(bound.low[a]) || s > static_cast<double>(bound.high[a])) ++out.outside;
      }
    }
    const auto surface = [](const DVec3& side) { return side.x * side.y + side.y * side.z + side.z * side.x; };
    ++out.clusters;
    for (int a = 0; a < 3; ++a) {
      const auto k = static_cast<std::size_t>(a);
      if (low[a] < static_cast<double>(bound.aligned_low[k]) || high[a] > static_cast<double>(bound.aligned_high[k]))
        ++out.outside;
    }
    if (bound.turned()) {
      ++out.turned;
      DVec3 side;
      for (std::size_t a = 0; a < 3; ++a)
        side[static_cast<int>(a)] = static_cast<double>(bound.high[a]) - static_cast<double>(bound.low[a]);
      if (!(surface(side) < surface(high - low))) ++out.larger;
    }
    if (bound.cone_cosine == 0) continue;
    ++out.cones;
    for (std::uint32_t k = cluster.first_cell; k < cluster.first_cell + cluster.cell_count; ++k) {
      const ClusterCell& cell = clusters.cells[k];
      check_triangle(bound, point(cell.corner[0]), point(cell.corner[1]), point(cell.corner[2]), out);
      if (!cell.single())
        check_triangle(bound, point(cell.corner[0]), point(cell.corner[2]), point(cell.corner[3]), out);
    }
  }
}

TEST(ClusterBounds, HoldEveryVertexAndEveryNormal) {  // CB1, CB2, CB3
  Random random(5);
  Checked out;
  for (int trial = 0; trial < 20; ++trial) {
    const Primitive strip = turned_strip(random, 0.3f);
    const MeshClusters clusters = build_clusters(strip);
    check_bounds(strip, clusters, bound_clusters(strip, clusters), out);
  }
  EXPECT_EQ(out.outside, 0u);
  EXPECT_EQ(out.larger, 0u);
  EXPECT_EQ(out.off_cone, 0u);
  EXPECT_EQ(out.too_small, 0u);
  EXPECT_GT(out.turned, out.clusters / 2);
  EXPECT_GT(out.cones, out.clusters / 2);
}

TEST(ClusterBounds, ABoxOrConeThatIsSlightlyTooSmallIsCaught) {
  Random random(5);
  const Primitive strip = turned_strip(random, 0.3f);
  const MeshClusters clusters = build_clusters(strip);
  std::vector<ClusterBound> bounds = bound_clusters(strip, clusters);
  for (ClusterBound& bound : bounds) {
    bound.high[0] = std::nextafter(bound.high[0], bound.low[0]);
    bound.high[0] = std::nextafter(bound.high[0], bound.low[0]);
    bound.cone_cosine += 1e-5f * (bound.cone_cosine > 0 ? 1.0f : 0.0f);
    bound.least_height *= 1.00001f, bound.least_edges *= 1.00001f;
  }
  Checked out;
  check_bounds(strip, clusters, bounds, out);
  EXPECT_GT(out.outside, 0u);
  EXPECT_GT(out.off_cone, 0u);
  EXPECT_GT(out.too_small, 0u);
}

TEST(ClusterBounds, ClosedSurfacesAndSliversHaveNoCone) {
  // A tetrahedron; a triangle whose corners lie on a line.
  const Primitive closed =
      test::triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3});
  EXPECT_EQ(bound_clusters(closed, build_clusters(closed))[0].cone_cosine, 0.0f);
  const Primitive sliver = test::triangles({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 1, 0}}, {0, 1, 2, 0, 1, 3});
  EXPECT_EQ(bound_clusters(sliver, build_clusters(sliver))[0].cone_cosine, 0.0f);
}

}  // namespace
}  // namespace tessera::scene::cluster_bounds_test

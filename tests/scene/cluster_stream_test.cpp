// Streams of encoded clusters: there and back, and any bytes.
#include "scene/cluster_stream.h"
#include "scene/geometry_record.h"
#include "tests/support/captures.h"
#include "tests/support/tests.h"

namespace tessera::scene::cluster_stream_test {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

constexpr std::array kEncodings{GeometryEncoding::kQuantised, GeometryEncoding::kMeshlet, GeometryEncoding::kDgf};

Triangle smallest_rotation(const Triangle& t) {
  return std::min({t, Triangle{t[1], t[2], t[0]}, Triangle{t[2], t[0], t[1]}});
}

std::multiset<Triangle> triangles_of(std::span<const std::uint32_t> indices) {
  std::multiset<Triangle> out;
  for (std::size_t i = 0; i + 2 < indices.size(); i += 3)
    out.insert(smallest_rotation({indices[i], indices[i + 1], indices[i + 2]}));
  return out;
}

// Indices of the triangles that cells have.
std::vector<std::uint32_t> indices_of(const MeshClusters& clusters) {
  std::vector<std::uint32_t> out;
  for (const Cluster& cluster : clusters.clusters)
    for (std::uint32_t c = 0; c < cluster.cell_count; ++c) {
      const ClusterCell& cell = clusters.cells[cluster.first_cell + c];
      const auto vertex = [&](std::size_t k) { return clusters.vertices[cluster.first_vertex + cell.corner[k]]; };
      out.insert(out.end(), {vertex(0), vertex(1), vertex(2)});
      if (!cell.single()) out.insert(out.end(), {vertex(0), vertex(2), vertex(3)});
    }
  return out;
}

// A wavy grid, or any triangles over some vertices, degenerate ones as well, on a lattice of 2^exponent.
Primitive random_mesh(test::Random& random, int exponent) {
  Primitive mesh;
  if (random.coin()) {
    mesh = test::wavy_grid(random.integer(1, 30), static_cast<std::uint32_t>(random.integer(0, 1000)));
  } else {
    std::vector<Vec3> positions;
    for (int v = random.integer(3, 200); v > 0; --v) positions.push_back(random.in_box(1));
    std::vector<std::uint32_t> indices;
    for (int k = 3 * random.integer(1, 400); k > 0; --k)
      indices.push_back(static_cast<std::uint32_t>(random.integer(0, static_cast<int>(positions.size()) - 1)));
    mesh = test::triangles(positions, indices);
  }
  PositionLattice lattice;
  lattice.exponent = exponent;
  for (Vec3& p : mesh.vertices.positions) {
    p = lattice.point(lattice.place(p * std::ldexp(1.0f, exponent + 10)));
  }
  return mesh;
}

TEST(ClusterStream, CLS1AnyMeshComesBack) {
  test::Random random(1);
  for (int trial = 0; trial < 300; ++trial) {
    const int exponent = random.integer(-100, 100);
    const Primitive mesh = random_mesh(random, exponent);
    const MeshClusters clusters = build_clusters(mesh);
    for (const GeometryEncoding encoding : kEncodings) {
      const std::optional<ClusterStream> stream = encode_cluster_stream(encoding, exponent, mesh);
      ASSERT_TRUE(stream.has_value());
      ASSERT_EQ(stream->clusters, clusters.clusters.size());
      std::string fault;
      const std::optional<DecodedClusters> decoded = decode_cluster_stream(
          {encoding, stream->bits}, stream->bytes, {stream->clusters, stream->order.size(), stream->triangles}, fault);
      ASSERT_TRUE(decoded.has_value()) << fault;
      for (std::size_t v = 0; v < stream->order.size(); ++v)
        ASSERT_EQ(decoded->positions[v], mesh.vertices.positions[stream->order[v]]);
      std::vector<std::uint32_t> indices = decoded->indices;
      for (std::uint32_t& index : indices) index = stream->order[index];
      ASSERT_EQ(triangles_of(indices), triangles_of(indices_of(clusters)));
      // A capture that is read is cut into the clusters that were encoded.
      Primitive read = test::triangles(decoded->positions, decoded->indices);
      read.triangles_of_cluster = decoded->triangles_of_cluster;
      const MeshClusters cut = build_clusters(read);
      ASSERT_EQ(cut.clusters.size(), clusters.clusters.size());
      for (std::size_t c = 0; c < cut.clusters.size(); ++c) {
        ASSERT_EQ(cut.clusters[c].triangle_count, decoded->triangles_of_cluster[c]);
        ASSERT_EQ(cut.clusters[c].vertex_count, clusters.clusters[c].vertex_count);
      }
    }
  }
}

TEST(ClusterStream, ClustersBeyondTheLimitsOfDgfBlocksAreNotEncoded) {
  const Primitive wide = test::triangles({{0, 0, 0}, {65536, 0, 0}, {0, 1, 0}}, {0, 1, 2}),
                  fits = test::triangles({{0, 0, 0}, {65535, 0, 0}, {0, 1, 0}}, {0, 1, 2});
  EXPECT_FALSE(encode_cluster_stream(GeometryEncoding::kDgf, 0, wide).has_value());
  EXPECT_TRUE(encode_cluster_stream(GeometryEncoding::kDgf, 0, fits).has_value());
  EXPECT_TRUE(encode_cluster_stream(GeometryEncoding::kMeshlet, 0, wide).has_value());
}

void expect_sound(const DecodedClusters& clusters, const ClusterStreamCounts& counts) {
  ASSERT_EQ(clusters.positions.size(), counts.vertices);
  ASSERT_EQ(clusters.indices.size(), 3 * counts.triangles);
  ASSERT_EQ(clusters.triangles_of_cluster.size(), counts.clusters);
  for (const Vec3& p : clusters.positions) ASSERT_TRUE(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z));
  for (const std::uint32_t index : clusters.indices) ASSERT_LT(index, counts.vertices);
  std::size_t triangles = 0;
  for (const std::uint8_t n : clusters.triangles_of_cluster) triangles += n;
  ASSERT_EQ(triangles, counts.triangles);
}

TEST(ClusterStream, CLS2GR3AnyBytesAreSoundClustersOrAFault) {
  test::Random random(2);
  int sound = 0, refused = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const GeometryEncoding encoding = kEncodings[static_cast<std::size_t>(trial) % 3];
    Primitive mesh = random_mesh(random, 0);
    mesh.indices.resize(std::min<std::size_t>(mesh.indices.size(), 600));
    const std::optional<ClusterStream> stream = encode_cluster_stream(encoding, 0, mesh);
    ASSERT_TRUE(stream.has_value());
    std::vector<std::uint8_t> bytes = stream->bytes;
    ClusterStreamCounts counts{stream->clusters, stream->order.size(), stream->triangles};
    switch (random.integer(0, 3)) {
      case 0:
        bytes.resize(static_cast<std::size_t>(random.integer(0, static_cast<int>(bytes.size()))));
        break;
      case 1:
        for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random.integer(0, 255));
        break;
      case 2:
        counts.clusters += static_cast<std::size_t>(random.integer(0, 2));
        counts.vertices += static_cast<std::size_t>(random.integer(0, 2));
        counts.triangles -= static_cast<std::size_t>(random.integer(0, 1));
        break;
      default:
        for (int flips = random.integer(1, 3); flips > 0; --flips)
          bytes[static_cast<std::size_t>(random.integer(0, static_cast<int>(bytes.size()) - 1))] ^=
              static_cast<std::uint8_t>(1 << random.integer(0, 7));
    }
    const int bits = random.integer(0, 3) == 0 ? random.integer(1, 24) : stream->bits;
    std::string fault;
    const std::optional<DecodedClusters> decoded = decode_cluster_stream({encoding, bits}, bytes, counts, fault);
    ASSERT_EQ(decoded.has_value(), fault.empty());
    if (decoded)
      expect_sound(*decoded, counts), ++sound;
    else
      ++refused;
  }
  EXPECT_GT(sound, 30);
  EXPECT_GT(refused, 1000);
}

}  // namespace
}  // namespace tessera::scene::cluster_stream_test

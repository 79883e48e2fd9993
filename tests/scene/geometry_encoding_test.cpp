// Positions on lattices, records of encoded geometry, and what an assembly holds of them.
#include <limits>

#include "base/error.h"
#include "frontend/patch_record.h"
#include "scene/capture_reader.h"
#include "scene/geometry_record.h"
#include "scene/held_geometry.h"
#include "scene/position_lattice.h"
#include "tests/support/instances.h"
#include "tests/support/tests.h"

namespace tessera::scene::geometry_encoding_test {
namespace {

using Words = std::array<std::uint32_t, 3>;

Words words(const Vec3& p) {
  return {std::bit_cast<std::uint32_t>(p.x), std::bit_cast<std::uint32_t>(p.y), std::bit_cast<std::uint32_t>(p.z)};
}

const std::vector<GeometrySettings>& encodings() {
  static const std::vector<GeometrySettings> kAll = {
      {GeometryEncoding::kQuantised, 8}, {GeometryEncoding::kMeshlet, 8},    {GeometryEncoding::kQuantised, 12},
      {GeometryEncoding::kMeshlet, 12},  {GeometryEncoding::kQuantised, 16}, {GeometryEncoding::kMeshlet, 16}};
  return kAll;
}

// A box anywhere from the smallest floats to the largest, far from the origin or around it.
std::array<Vec3, 2> random_box(test::Random& random) {
  const float size = std::ldexp(random.uniform(0.5f, 1.0f), random.integer(-148, 126));
  const float away = random.coin() ? 0.0f : std::ldexp(size, random.integer(-4, 30));
  Vec3 low = random.in_box(1) * size, high = low;
  for (int axis = 0; axis < 3; ++axis) {
    if (std::isfinite(away) && away < 0x1p126f) low[axis] += away * random.uniform(-1, 1);
    high[axis] = low[axis] + (random.integer(0, 4) == 0 ? 0.0f : size * random.uniform(0, 1));
  }
  return {low, high};
}

TEST(PositionLattice, LAT1LAT2LAT3PlacesAreExactNearAndFewOverAllMagnitudes) {
  test::Random random(1);
  for (int trial = 0; trial < 20'000; ++trial) {
    const auto [low, high] = random_box(random);
    const int bits = random.integer(8, 16);
    const PositionLattice lattice = make_lattice(low, high, bits);
    const double step = std::ldexp(1.0, lattice.exponent);
    for (int k = 0; k < 4; ++k) {
      Vec3 p;
      for (int axis = 0; axis < 3; ++axis)
        p[axis] = std::clamp(low[axis] + (high[axis] - low[axis]) * random.uniform(0, 1), low[axis], high[axis]);
      const LatticePoint place = lattice.place(p);
      const Vec3 point = lattice.point(place);
      ASSERT_EQ(lattice.place(point), place) << trial;
      for (int axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        ASSERT_LE(std::abs(static_cast<double>(point[axis]) - static_cast<double>(p[axis])), step / 2) << trial;
        ASSERT_LE(std::abs(place[a]), 1 << 24) << trial;
        ASSERT_GE(place[a], lattice.origin[a]) << trial;
        ASSERT_LT(place[a] - lattice.origin[a], 1 << bits) << trial;
      }
    }
  }
}

TEST(PositionLattice, LAT2TheLargestFloatsStayFinite) {
  constexpr float kLargest = std::numeric_limits<float>::max();
  for (const int bits : {8, 12, 16}) {
    const PositionLattice lattice = make_lattice(Vec3(-kLargest), Vec3(kLargest), bits);
    for (const float x : {-kLargest, kLargest, 0.0f, std::numeric_limits<float>::denorm_min()}) {
      const Vec3 point = lattice.point(lattice.place(Vec3(x)));
      EXPECT_TRUE(std::isfinite(point.x)) << x;
      EXPECT_LE(std::abs(static_cast<double>(point.x) - static_cast<double>(x)), std::ldexp(1.0, lattice.exponent));
      EXPECT_EQ(lattice.place(point), lattice.place(Vec3(x)));
    }
  }
}

TEST(PositionLattice, IsAsFineAsItsBitsAllow) {
  EXPECT_EQ(make_lattice(Vec3(0), Vec3(1), 16).exponent, -15) << "2^16 steps and one end";
  EXPECT_EQ(make_lattice(Vec3(0), Vec3(1 - 0x1p-16f), 16).exponent, -16);
  EXPECT_EQ(make_lattice(Vec3(1000), Vec3(1000.5f), 16).exponent, -14) << "floats are no finer there";
  EXPECT_EQ(make_lattice(Vec3(0), Vec3(0), 8).exponent, -126);
  EXPECT_EQ(make_lattice(Vec3(0), Vec3(255, 1, 1), 8).exponent, 0);
}

// A quad, a triangle at its right edge, another quad with one new vertex: what the format in the header makes of them.
TEST(GeometryRecord, HasTheBytesThatItsFormatSays) {
  const PositionLattice lattice{-2, {-8, 0, 0}};
  const std::vector<LatticePoint> points = {{0, 0, 5}, {4, 0, 5}, {4, 4, 5}, {0, 4, 5}, {7, 2, 5}, {7, 9, 5}};
  const std::vector<ClusterCell> cells = {{{0, 1, 2, 3}}, {{2, 1, 4, 4}}, {{2, 4, 5, 3}}};
  const EncodedRecord quantised = encode_record({GeometryEncoding::kQuantised, 12}, lattice, points, cells);
  EXPECT_EQ(quantised.bytes.size(), (8u + 3 * 26 + 6 * 3 * 12 + 3 * 4 * 8 + 7) / 8);
  const EncodedRecord meshlet = encode_record({GeometryEncoding::kMeshlet, 12}, lattice, points, cells);
  // x to 7: 3 bits, y to 9: 4, z: 0. A quad without an edge and four new vertices: 1 + 4 + 4; a triangle at an edge with a new
  // one: 1 + 4 + 2 + 1; a quad at the triangle's edge, a new vertex and one of 5: 1 + 4 + 2 + 1 + 1 + 3.
  EXPECT_EQ(meshlet.bytes.size(), (8u + 3 * 26 + 3 * 5 + 6 * 7 + 9 + 8 + 12 + 7) / 8);
  EXPECT_EQ(meshlet.bytes[0], 0xfe) << "2^-2";
  const DecodedRecord decoded = decode_record({GeometryEncoding::kMeshlet, 12}, meshlet.bytes, 6, 3);
  for (std::size_t v = 0; v < 6; ++v)
    EXPECT_EQ(words(decoded.positions[v]), words(lattice.point(points[meshlet.order[v]]))) << v;
  EXPECT_EQ(words(decoded.positions[0]), words(Vec3(0, 0, 1.25f)));
}

void expect_round_trip(const GeometrySettings& settings, const PositionLattice& lattice,
                       const std::vector<LatticePoint>& points, const std::vector<ClusterCell>& cells) {
  const EncodedRecord record = encode_record(settings, lattice, points, cells);
  const DecodedRecord decoded = decode_record(settings, record.bytes, points.size(), cells.size());
  std::vector<std::uint8_t> order = record.order;
  std::sort(order.begin(), order.end());
  ASSERT_EQ(order.size(), points.size());
  for (std::size_t v = 0; v < points.size(); ++v) {
    ASSERT_EQ(order[v], v) << "each once";
    ASSERT_EQ(words(decoded.positions[v]), words(lattice.point(points[record.order[v]])));
  }
  ASSERT_EQ(decoded.cells.size(), cells.size());
  for (std::size_t c = 0; c < cells.size(); ++c)
    for (std::size_t k = 0; k < 4; ++k) ASSERT_EQ(record.order[decoded.cells[c].corner[k]], cells[c].corner[k]) << c;
}

// Any cells over any vertices: also degenerate ones, and vertices that no cell has.
TEST(GeometryRecord, GR1AnyRecordComesBack) {
  test::Random random(2);
  for (int trial = 0; trial < 4000; ++trial) {
    const auto [low, high] = random_box(random);
    const GeometrySettings settings = {random.coin() ? GeometryEncoding::kMeshlet : GeometryEncoding::kQuantised,
                                       random.integer(8, 16)};
    const PositionLattice lattice = make_lattice(low, high, settings.bits);
    std::vector<LatticePoint> points(static_cast<std::size_t>(random.integer(1, 64)));
    for (LatticePoint& p : points)
      p = lattice.place({random.uniform(0, 1) < 0.5f ? low.x : high.x, random.coin() ? low.y : high.y,
                         std::clamp(low.z + (high.z - low.z) * random.uniform(0, 1), low.z, high.z)});
    std::vector<ClusterCell> cells(static_cast<std::size_t>(random.integer(0, 124)));
    const int used = random.integer(1, static_cast<int>(points.size()));
    for (ClusterCell& cell : cells)
      for (std::uint8_t& corner : cell.corner) corner = static_cast<std::uint8_t>(random.integer(0, used - 1));
    expect_round_trip(settings, lattice, points, cells);
  }
}

// Two primitives of a mesh that share a border, another mesh beside them, and patches: all meet in the same places.
Capture touching_capture(std::uint32_t seed) {
  test::Random random(seed);
  Primitive left = test::wavy_grid(random.integer(1, 14), seed);
  const Vec3 scale = Vec3(std::ldexp(1.0f, random.integer(-6, 6))) + random.in_box(0.01f), shift = random.in_box(100);
  for (Vec3& p : left.vertices.positions) p = p * scale + shift;
  Primitive right = left;
  float border = left.vertices.positions[0].x;
  for (const Vec3& p : left.vertices.positions) border = std::max(border, p.x);
  for (Vec3& p : right.vertices.positions)
    if (p.x != border) p.x = 2 * border - p.x, p.z += random.uniform(-1, 1);
  std::vector<Vec3> control_points;
  for (int k = 0; k < 16 * 5; ++k)
    control_points.push_back(random.coin() ? left.vertices.positions[static_cast<std::size_t>(
                                                 random.integer(0, static_cast<int>(left.vertices.count()) - 1))]
                                           : random.in_box(500));
  Capture capture;
  const int node = test::add_node(capture, left);
  capture.meshes[static_cast<std::size_t>(capture.nodes[static_cast<std::size_t>(node)].mesh)].primitives.push_back(
      right);
  test::add_node(capture, test::patches(control_points));
  test::add_node(capture, right);
  return capture;
}

// The positions that the memory holds by those of the file, over everything that is drawn.
std::size_t expect_closed(const Capture& capture, const Assembly& assembly, const GeometrySettings& settings) {
  const std::vector<PositionLattice> lattices = mesh_lattices(capture, settings.bits);
  std::map<Words, Words> decoded;
  std::size_t vertices = 0;
  for (const Drawable& drawable : assembly.drawables) {
    const HeldGeometry* held = assembly.held_geometry(drawable);
    EXPECT_NE(held, nullptr);
    if (held == nullptr) continue;
    const std::vector<Vec3>& file = capture.meshes[static_cast<std::size_t>(drawable.mesh)]
                                        .primitives[static_cast<std::size_t>(drawable.primitive)]
                                        .vertices.positions;
    const double half = std::ldexp(0.5, lattices[static_cast<std::size_t>(drawable.mesh)].exponent);
    for (std::size_t v = 0; v < file.size(); ++v) {
      const auto [at, fresh] = decoded.emplace(words(file[v] + 0.0f), words(held->positions[v]));
      EXPECT_EQ(at->second, words(held->positions[v])) << "a crack";
      for (int axis = 0; axis < 3; ++axis)
        EXPECT_LE(std::abs(static_cast<double>(held->positions[v][axis]) - static_cast<double>(file[v][axis])), half);
      ++vertices;
    }
  }
  return vertices;
}

// LAT4, GR2: what is in one place stays in one place, bit by bit, in every record that has it.
TEST(HeldGeometry, HG1HG2NoCrackOpensBetweenPatchesPrimitivesAndMeshesThatTouch) {
  std::size_t vertices = 0;
  for (std::uint32_t seed = 1; seed <= 60; ++seed) {
    const Capture capture = touching_capture(seed);
    const Assembly raw = assemble(capture);
    for (const GeometrySettings& settings : encodings()) {
      Assembly assembly = raw;
      hold_geometry(settings, assembly);
      vertices += expect_closed(capture, assembly, settings);
    }
    if (HasFailure()) break;
  }
  EXPECT_GT(vertices, 100'000u);
}

TEST(HeldGeometry, HG3ClustersKeepTheirCellsAndBoundsHoldWhatIsDecoded) {
  Capture capture;
  test::add_node(capture, test::wavy_grid(40, 3));
  const Assembly raw = assemble(capture);
  for (const GeometrySettings& settings : encodings()) {
    Assembly assembly = raw;
    hold_geometry(settings, assembly);
    const MeshClusters &a = raw.clusters[0], &b = assembly.clusters[0];
    ASSERT_EQ(a.cells.size(), b.cells.size());
    for (std::size_t c = 0; c < a.clusters.size(); ++c) {
      for (std::uint32_t k = a.clusters[c].first_cell; k < a.clusters[c].first_cell + a.clusters[c].cell_count; ++k)
        for (std::size_t i = 0; i < 4; ++i)
          ASSERT_EQ(a.vertices[a.clusters[c].first_vertex + a.cells[k].corner[i]],
                    b.vertices[b.clusters[c].first_vertex + b.cells[k].corner[i]]);
      const ClusterBound& bound = assembly.cluster_bounds[0][c];
      for (std::uint32_t v = 0; v < b.clusters[c].vertex_count; ++v) {
        const Vec3& p = assembly.held_clusters[0].positions[b.vertices[b.clusters[c].first_vertex + v]];
        for (std::size_t axis = 0; axis < 3; ++axis) {
          EXPECT_LE(bound.aligned_low[axis], p[static_cast<int>(axis)]);
          EXPECT_GE(bound.aligned_high[axis], p[static_cast<int>(axis)]);
        }
      }
    }
  }
}

TEST(HeldGeometry, HG3InstancesShareRecordsAndPatchesKeepTheirNeighbours) {
  Capture capture;
  const int node = test::add_node(capture, test::closed_patches(kNone));
  for (int i = 0; i < 3; ++i) capture.nodes[static_cast<std::size_t>(node)].instances.emplace_back();
  Assembly assembly = assemble(capture);
  const std::vector<PatchNeighbours> before = assembly.neighbours[0];
  hold_geometry({GeometryEncoding::kMeshlet, 12}, assembly);
  EXPECT_EQ(assembly.held_bezier.size(), 1u);
  EXPECT_EQ(assembly.held_bezier[0].record_bytes.size(), 6u);
  for (std::size_t p = 0; p < before.size(); ++p)
    for (std::size_t e = 0; e < 4; ++e) EXPECT_EQ(assembly.neighbours[0][p].edges[e].patch, before[p].edges[e].patch);
  for (std::uint32_t p = 0; p < assembly.patch_count(); ++p) {
    EXPECT_EQ(frontend::decoded_elements(assembly, p), 16u);
    EXPECT_EQ(frontend::patch_record_bytes(assembly, p, false), 32u + assembly.held_bezier[0].record_bytes[p % 6]);
    EXPECT_LT(frontend::patch_record_bytes(assembly, p, false), 32u + 192);
  }
}

TEST(HeldGeometry, LeavesWhatMayDeformAndPointsAsTheyAre) {
  Capture capture;
  Primitive morphing = test::wavy_grid(4, 1);
  morphing.vertices.morph_targets.push_back({std::vector<Vec3>(morphing.vertices.count(), Vec3(1)), {}, {}});
  test::add_node(capture, morphing);
  test::add_node(capture, test::points({{0, 0, 0}, {1, 1, 1}}));
  Assembly assembly = assemble(capture);
  hold_geometry({GeometryEncoding::kMeshlet, 16}, assembly);
  for (const Drawable& drawable : assembly.drawables) EXPECT_EQ(assembly.held_geometry(drawable), nullptr);
}

// A vertex that no triangle has may be anything: the reader lets it pass.
TEST(HeldGeometry, PassesOverVerticesThatNobodyDraws) {
  Primitive mesh = test::wavy_grid(4, 1);
  mesh.vertices.positions.emplace_back(std::numeric_limits<float>::quiet_NaN());
  mesh.vertices.positions.emplace_back(std::numeric_limits<float>::infinity());
  Capture capture;
  test::add_node(capture, mesh);
  Assembly assembly = assemble(capture);
  hold_geometry({GeometryEncoding::kMeshlet, 16}, assembly);
  for (std::size_t v = 0; v + 2 < mesh.vertices.count(); ++v)
    EXPECT_NEAR(assembly.held_clusters[0].positions[v].x, mesh.vertices.positions[v].x, 1e-4) << v;
}

TEST(HeldGeometry, AsksForItsRoomBeforeItTakesIt) {
  Capture capture;
  test::add_node(capture, test::wavy_grid(30, 1));
  capture.max_bytes = 31 * 31 * sizeof(Vec3) - 1;
  Assembly assembly = assemble(capture);
  EXPECT_THROW(hold_geometry({GeometryEncoding::kMeshlet, 16}, assembly), LimitError);
  capture.max_bytes += 1;
  assembly = assemble(capture);
  hold_geometry({GeometryEncoding::kMeshlet, 16}, assembly);
  EXPECT_EQ(assembly.charged_bytes(), capture.max_bytes);
}

// Bytes of a triangle's positions and cells behind the headers of its records.
double bytes_per_triangle(Assembly assembly, const GeometrySettings& settings) {
  hold_geometry(settings, assembly);
  std::uint64_t bytes = 0, triangles = 0;
  for (std::uint32_t p = 0; p < assembly.patch_count(); ++p)
    bytes += frontend::patch_record_bytes(assembly, p, false) - frontend::kPatchHeaderBytes;
  for (const MeshClusters& clusters : assembly.clusters)
    for (const Cluster& cluster : clusters.clusters) triangles += cluster.triangle_count;
  return static_cast<double>(bytes) / static_cast<double>(triangles);
}

TEST(HeldGeometry, ASmoothMeshTakesUnderFiveBytesATriangle) {
  constexpr std::uint32_t kSide = 128;
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> indices;
  for (std::uint32_t j = 0; j <= kSide; ++j)
    for (std::uint32_t i = 0; i <= kSide; ++i) {
      const double u = 6.283185307 * i / kSide, v = 3.141592654 * j / kSide;
      positions.emplace_back(std::sin(v) * std::cos(u), std::cos(v), std::sin(v) * std::sin(u));
      const std::uint32_t a = j * (kSide + 1) + i, b = a + kSide + 1;
      if (i < kSide && j < kSide) indices.insert(indices.end(), {a, a + 1, b + 1, a, b + 1, b});
    }
  Capture capture;
  test::add_node(capture, test::triangles(positions, indices));
  const Assembly raw = assemble(capture);
  const double meshlet = bytes_per_triangle(raw, {GeometryEncoding::kMeshlet, 16}),
               quantised = bytes_per_triangle(raw, {GeometryEncoding::kQuantised, 16}),
               floats = bytes_per_triangle(raw, {}), coarse = bytes_per_triangle(raw, {GeometryEncoding::kMeshlet, 12});
  RecordProperty("bytes", fmt::format("{} {} {} {}", floats, quantised, meshlet, coarse));
  EXPECT_LT(meshlet, 4.7);
  EXPECT_LT(meshlet, quantised);
  EXPECT_LT(quantised, floats);
  EXPECT_LT(coarse, meshlet - 0.8);
}

// Codecs of meshlets that the field publishes take 4.1 bytes of it at 16 bits and 3.1 at 12.
TEST(HeldGeometry, ARealMeshTakesUnderFiveBytesATriangle) {
  const auto assets = test::assets_folder();
  if (!assets) GTEST_SKIP() << "no sample models";
  const Capture capture = read_capture(*assets / "FlightHelmet/glTF/FlightHelmet.gltf");
  const Assembly raw = assemble(capture);
  const double meshlet = bytes_per_triangle(raw, {GeometryEncoding::kMeshlet, 16}),
               coarse = bytes_per_triangle(raw, {GeometryEncoding::kMeshlet, 12});
  RecordProperty("bytes", fmt::format("{} {} {} {}", bytes_per_triangle(raw, {}),
                                      bytes_per_triangle(raw, {GeometryEncoding::kQuantised, 16}), meshlet, coarse));
  EXPECT_LT(meshlet, 4.7);
  EXPECT_LT(coarse, 3.7);
}

}  // namespace
}  // namespace tessera::scene::geometry_encoding_test

#include "tilecore/tessellation/tessellator.h"
#include "base/simd_targets.h"
#include "scene/subpixel.h"
#include "tests/support/tests.h"
#include "tests/tilecore/support.h"
#include "tilecore/tessellation/tessellator_kernel.h"

namespace tessera::tilecore::tessellator_test {
namespace {

using scene::CellRange;

// A closed displaced surface whose faces have grids of different fineness.
TestFrame closed_surface(float strength, bool deforming, Random& random) {
  TestFrame test;
  scene::Material material;
  std::vector<float> heights(16 * 16);
  for (float& h : heights) h = random.uniform(0, 1);
  if (strength != 0) material.displacement = test::displacement(16, 16, heights, strength, 0.02f);
  scene::Primitive primitive = test::closed_patches(test::add_material(*test.capture, material));
  if (deforming) {
    // Points that coincide move alike.
    scene::MorphTarget target;
    for (const Vec3& p : primitive.vertices.positions) target.positions.push_back(Vec3(p.y, p.z, p.x) * 0.3f);
    primitive.vertices.morph_targets.push_back(target);
  }
  const int node = test::add_node(*test.capture, primitive);
  test::add_motion(*test.capture, node, {0.4, 0.1, -0.2});
  if (deforming)
    test.capture->animations[0].channels.push_back(
        {.node = node, .path = scene::AnimatedPath::kWeights, .components = 1, .times = {0, 1}, .values = {0, 1}});
  test::add_camera(*test.capture, {0.3, 0.4, 4.0});
  test.pose(400, 300);
  return test;
}

using Bits = std::array<std::uint32_t, 3>;
Bits bits_of(const Vec3& p) {
  return {std::bit_cast<std::uint32_t>(p.x), std::bit_cast<std::uint32_t>(p.y), std::bit_cast<std::uint32_t>(p.z)};
}

// Positions of the boundary vertices of all patches at a key, each with the number of patches that have it.
std::map<Bits, std::set<std::uint32_t>> boundary_vertices(const scene::FrameGeometry& frame, int key) {
  std::map<Bits, std::set<std::uint32_t>> out;
  for (std::uint32_t patch = 0; patch < frame.assembly->patch_count(); ++patch) {
    const auto& p = frame.pattern_of(patch);
    for (int j = 0; j <= p.nv; ++j)
      for (int i = 0; i <= p.nu; ++i)
        if (i == 0 || j == 0 || i == p.nu || j == p.nv)
          out[bits_of(Tessellator::vertex_position(frame, patch, i, j, key))].insert(patch);
  }
  return out;
}

TEST(Tessellator, ClosedDisplacedMovingSurfacesHaveNoCrack) {
  // On a closed surface every boundary vertex belongs to at least two patches, bit by bit.
  Random random(1);
  for (const float strength : {0.0f, 0.3f, -0.8f})
    for (const bool deforming : {false, true}) {
      const TestFrame test = closed_surface(strength, deforming, random);
      for (int key = 0; key < 2; ++key)
        for (const auto& [position, patches] : boundary_vertices(*test.frame, key)) EXPECT_GE(patches.size(), 2u);
    }
}

TEST(Tessellator, WithoutOwnersDisplacedEdgesWouldCrack) {
  // The failing twin: each patch evaluating its own edge gives different bits somewhere.
  Random random(2);
  const TestFrame test = closed_surface(0.3f, false, random);
  auto unowned = *test.assembly;
  for (auto& patches : unowned.neighbours)
    for (std::uint32_t p = 0; p < patches.size(); ++p) {
      for (std::uint8_t e = 0; e < 4; ++e) patches[p].edges[e] = {p, e, false, false};
      for (std::uint8_t c = 0; c < 4; ++c) patches[p].corners[c] = {p, c};
    }
  test.frame->assembly = &unowned;
  int alone = 0;
  for (const auto& [position, patches] : boundary_vertices(*test.frame, 0)) alone += patches.size() < 2 ? 1 : 0;
  EXPECT_GT(alone, 0);
}

// Everything a mesh holds about a grid vertex.
using VertexBits = std::array<std::uint32_t, 7>;
VertexBits vertex_bits(const MicroMesh& m, std::size_t v) {
  const auto b = [](float f) { return std::bit_cast<std::uint32_t>(f); };
  return {b(m.x0[v]), b(m.y0[v]), b(m.z0[v]), b(m.x1[v]), b(m.y1[v]), b(m.z1[v]), m.projected[v]};
}

std::map<std::pair<int, int>, VertexBits> grid_vertices(const scene::FrameGeometry& frame, std::uint32_t patch,
                                                        const CellRange& r) {
  Tessellator tessellator;
  MicroMesh mesh;
  tessellator.tessellate(frame, patch, r, {true, true}, mesh);
  std::map<std::pair<int, int>, VertexBits> out;
  const int columns = r.i1 - r.i0 + 1;
  for (int j = r.j0; j <= r.j1; ++j)
    for (int i = r.i0; i <= r.i1; ++i)
      out[{i, j}] = vertex_bits(mesh, static_cast<std::size_t>((j - r.j0) * columns + i - r.i0));
  return out;
}

TEST(Tessellator, CuttingAPatchNeverMovesAVertex) {
  Random random(3);
  const TestFrame test = closed_surface(0.3f, true, random);
  for (std::uint32_t patch = 0; patch < 6; ++patch) {
    const CellRange whole = whole_patch(*test.frame, patch);
    const auto all = grid_vertices(*test.frame, patch, whole);
    for (int trial = 0; trial < 10; ++trial) {
      CellRange part;
      part.i0 = static_cast<std::uint8_t>(random.integer(0, whole.i1 - 1));
      part.i1 = static_cast<std::uint8_t>(random.integer(part.i0 + 1, whole.i1));
      part.j0 = static_cast<std::uint8_t>(random.integer(0, whole.j1 - 1));
      part.j1 = static_cast<std::uint8_t>(random.integer(part.j0 + 1, whole.j1));
      for (const auto& [place, bits] : grid_vertices(*test.frame, patch, part)) ASSERT_EQ(bits, all.at(place));
    }
  }
}

TEST(Tessellator, GivesTheSameBitsOnEveryInstructionSet) {
  Random random(4);
  const TestFrame test = closed_surface(0.25f, true, random);
  std::map<std::pair<int, int>, VertexBits> expected;
  for (const std::string& target : simd_target_names()) {
    force_simd_target(target);
    const auto vertices = grid_vertices(*test.frame, 2, whole_patch(*test.frame, 2));
    if (expected.empty()) expected = vertices;
    EXPECT_EQ(vertices, expected) << target;
  }
  force_simd_target("");
}

TEST(Tessellator, ProjectedVerticesLieOnTheSubPixelGridWithinHalfAStep) {
  Random random(5);
  const TestFrame test = closed_surface(0.1f, false, random);
  const auto& frame = *test.frame;
  Tessellator tessellator;
  MicroMesh mesh;
  const CellRange whole = whole_patch(frame, 1);
  tessellator.tessellate(frame, 1, whole, {true, false}, mesh);
  EXPECT_TRUE(mesh.all_projected);
  std::size_t v = 0;
  for (int j = 0; j <= whole.j1; ++j)
    for (int i = 0; i <= whole.i1; ++i, ++v) {
      const Vec4 r = frame.drawables[0].to_raster[1] * Vec4(Tessellator::vertex_position(frame, 1, i, j, 1), 1.0f);
      EXPECT_EQ(mesh.x1[v] * 256.0f, std::round(mesh.x1[v] * 256.0f));
      EXPECT_NEAR(mesh.x1[v], r.x / r.w, 0.5f / 256.0f + 1e-4f);
      EXPECT_NEAR(mesh.y1[v], r.y / r.w, 0.5f / 256.0f + 1e-4f);
      EXPECT_NEAR(mesh.z1[v], r.z, 1e-5f * r.z);
    }
}

TEST(Tessellator, CountsItsWork) {
  Random random(6);
  const TestFrame test = closed_surface(0.3f, false, random);
  Tessellator tessellator;
  MicroMesh mesh;
  const CellRange part{0, 0, 4, 3};
  const auto work = tessellator.tessellate(*test.frame, 0, part, {true, false}, mesh);
  EXPECT_EQ(work.domain_evaluations, 5u * 4u);
  EXPECT_LE(work.triangles, 2u * 4u * 3u);
  EXPECT_GT(work.triangles, 0u);
}

TEST(Tessellator, FetchesTheOwnersOfDisplacedEdges) {
  Random random(6);
  const TestFrame test = closed_surface(0.3f, false, random);
  const auto patch = static_cast<std::uint32_t>(test.assembly->patch_count() -
                                                1);  // the first patch owns all of its edges, the last none
  const scene::TessellationPattern& pattern = test.frame->pattern_of(patch);
  ASSERT_GT(pattern.nu, 2);
  std::vector<std::uint32_t> others;
  fetched_neighbours(*test.frame, patch, {0, 0, pattern.nu, pattern.nv}, true, others);
  EXPECT_FALSE(others.empty());
  for (const std::uint32_t other : others) EXPECT_NE(other, patch);
  // Neither an edge without displacement nor the middle of the grid needs anybody.
  fetched_neighbours(*test.frame, patch, {0, 0, pattern.nu, pattern.nv}, false, others);
  EXPECT_TRUE(others.empty());
  fetched_neighbours(*test.frame, patch, {1, 1, 2, 2}, true, others);
  EXPECT_TRUE(others.empty());
}

TEST(Tessellator, StitchedCellsDropTheirDegenerateTriangles) {
  Random random(7);
  TestFrame test = closed_surface(0.0f, false, random);
  test.frame->patterns[0].nu = test.frame->patterns[0].nv = 8;
  test.frame->patterns[0].edge = {2, 8, 8, 8};
  Tessellator tessellator;
  MicroMesh mesh;
  const auto work = tessellator.tessellate(*test.frame, 0, {0, 0, 8, 8}, {true, false}, mesh);
  // Six of the eight steps along the coarse edge have no length; each costs one triangle.
  EXPECT_EQ(work.triangles, 2u * 64u - 6u);
}

TEST(Tessellator, ClustersKeepTheirTrianglesNumbers) {
  TestFrame test;
  test::add_node(*test.capture,
                 test::triangles({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {2, 0, 0}}, {0, 1, 2, 0, 2, 3, 1, 4, 2}));
  test::add_camera(*test.capture, {0.5, 0.5, 3});
  test.pose();
  Tessellator tessellator;
  MicroMesh mesh;
  const auto work = tessellator.tessellate(*test.frame, 0, whole_patch(*test.frame, 0), {}, mesh);
  EXPECT_EQ(work.triangles, 3u);
  EXPECT_EQ(work.domain_evaluations, 5u);
}

TEST(Tessellator, EveryInstructionSetSamplesTheHeightsOfSinglePoints) {
  Random random(31);
  for (int round = 0; round < 60; ++round) {
    const int width = random.integer(1, 20), height = random.integer(1, 20);
    std::vector<float> values(static_cast<std::size_t>(width * height));
    for (float& value : values) value = random.uniform(-1, 1);
    const shaders::ScalarTexture texture(width, height, values);
    shaders::Sampler sampler;
    sampler.wrap_s = static_cast<shaders::Wrap>(random.integer(0, 2));
    sampler.wrap_t = static_cast<shaders::Wrap>(random.integer(0, 2));
    const float lods[] = {-1.0f, 0.0f, 1.0f, random.uniform(0, 4), 99.0f}, lod = lods[round % 5];
    constexpr std::size_t kCount = 21;
    std::array<float, kCount + 16> u{}, v{}, heights{};
    for (std::size_t i = 0; i < kCount; ++i) u[i] = random.uniform(-3, 3), v[i] = random.uniform(-3, 3);
    u[3] = std::numeric_limits<float>::infinity(), v[7] = std::numeric_limits<float>::quiet_NaN(), u[9] = -1e30f;
    for (const std::string& target : simd_target_names()) {
      force_simd_target(target);
      sample_heights(texture.view(), sampler, lod, u.data(), v.data(), kCount, heights.data());
      for (std::size_t i = 0; i < kCount; ++i)
        ASSERT_EQ(std::bit_cast<std::uint32_t>(heights[i]),
                  std::bit_cast<std::uint32_t>(texture.sample(sampler, Vec2(u[i], v[i]), lod)))
            << target << ", round " << round << ", point " << i;
    }
  }
  force_simd_target("");
}

}  // namespace
}  // namespace tessera::tilecore::tessellator_test

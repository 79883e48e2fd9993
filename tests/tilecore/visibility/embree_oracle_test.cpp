// Embree as an oracle of visibility: the same triangles, every sample as a ray, nearest hits compared.
//
// Tessera's moving triangle is exactly one that Embree can trace (tests/support/embree_scene.h), so only the rounding
// of single precision is tolerated: samples within 2^-14 pixel of an edge of a claimed triangle, and surfaces whose
// depths differ by less than 2e-6 of them or than a shift of 2^-14 pixel makes. Such samples are counted and must be
// few; everything else must agree in patch, triangle and depth.
#include "gpu/configuration.h"
#include "tests/support/embree_scene.h"
#include "tests/support/machine_visibility.h"
#include "tests/support/tests.h"
#include "tests/tilecore/support.h"

namespace tessera::tilecore::embree_oracle_test {
namespace {

using test::Agreement;
using test::Claim;
using test::EmbreeScene;

constexpr int kWidth = 160, kHeight = 120;

// ---- Scenes -----------------------------------------------------------------------------------------------------

struct OracleCase {
  const char* name;
  bool moving, lens, displaced, clusters, orthographic, crossing;
};
constexpr OracleCase kCases[] = {
    {"StaticPinhole", false, false, false, false, false, false},
    {"Moving", true, false, false, false, false, false},
    {"Defocused", false, true, false, false, false, false},
    {"MovingDefocused", true, true, false, false, false, false},
    {"DisplacedStatic", false, false, true, false, false, false},
    {"DisplacedMovingDefocused", true, true, true, false, false, false},
    {"ClustersStatic", false, false, false, true, false, false},
    {"ClustersMovingDefocused", true, true, false, true, false, false},
    {"OrthographicStatic", false, false, false, false, true, false},
    {"OrthographicMovingDefocused", true, true, false, false, true, false},
    {"NearPlaneCrossingStatic", false, false, false, false, false, true},
    {"NearPlaneCrossingMovingDefocused", true, true, false, false, false, true},
};

// A sheet of n x n quads, bent, as a passive mesh.
scene::Primitive sheet(int n, float half, Random& random, int material) {
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> indices;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i)
      positions.push_back(Vec3(half * (2.0f * static_cast<float>(i) / static_cast<float>(n) - 1.0f),
                               half * (2.0f * static_cast<float>(j) / static_cast<float>(n) - 1.0f), 0.0f) +
                          random.in_box(0.3f * half / static_cast<float>(n)));
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const auto a = static_cast<std::uint32_t>(j * (n + 1) + i), down = static_cast<std::uint32_t>(n + 1);
      for (const std::uint32_t v : {a, a + 1, a + 1 + down, a, a + 1 + down, a + down}) indices.push_back(v);
    }
  return test::triangles(positions, indices, material);
}

// Three bent or closed surfaces in front of one another, one of them single-sided, at odd places: nothing is aligned
// with the samples.
TestFrame make_scene(const OracleCase& c, std::uint32_t seed) {
  Random random(seed);
  TestFrame test;
  for (int object = 0; object < 3; ++object) {
    scene::Material material;
    material.double_sided = object != 1;
    if (c.displaced) {
      std::vector<float> heights(16 * 16);
      for (float& h : heights) h = random.uniform(0, 1);
      material.displacement = test::displacement(16, 16, heights, random.uniform(-0.4f, 0.4f), 0.02f);
    }
    const int number = test::add_material(*test.capture, material);
    scene::Primitive primitive;
    if (c.clusters) {
      primitive = sheet(24, 1.4f, random, number);
    } else if (object == 1) {
      primitive = test::closed_patches(number);
    } else {
      std::vector<Vec3> points;
      for (int p = 0; p < 2; ++p) {
        std::vector<Vec3> patch =
            test::flat_patch({-2.6f + 2.6f * static_cast<float>(p), -1.7f, 0}, {2.6f, 0.3f, 0}, {0.2f, 3.4f, 0});
        for (std::size_t k = 0; k < 16; ++k) patch[k] += Vec3(0.1f, 0.1f, 0.7f) * random.in_box(1.0f);
        points.insert(points.end(), patch.begin(), patch.end());
      }
      primitive = test::patches(points, number);
    }
    if (c.moving && object == 2) {
      scene::MorphTarget target;  // deforms as well as moves; points that coincide move alike
      for (const Vec3& p : primitive.vertices.positions) target.positions.push_back(Vec3(p.y, p.z, p.x) * 0.1f);
      primitive.vertices.morph_targets.push_back(target);
    }
    const DVec3 place(0.31 * object - 0.3, 0.17 - 0.2 * object, c.clusters ? 0.6 - 0.6 * object : 0.8 - 0.9 * object);
    const int node = test::add_node(*test.capture, primitive, place);
    if (c.moving) {
      const Vec3 way = random.in_box(1.0f);
      test::add_motion(*test.capture, node, DVec3(way) * (c.crossing ? 1.4 : 0.9));
      if (object == 2)
        test.capture->animations[0].channels.push_back(
            {.node = node, .path = scene::AnimatedPath::kWeights, .components = 1, .times = {0, 1}, .values = {0, 1}});
    }
  }
  if (c.crossing) {
    // A floor that begins behind the camera.
    scene::Material material;
    material.double_sided = true;
    const int node = test::add_node(
        *test.capture,
        test::patches(test::flat_patch({-2.1f, -0.6f, 2.6f}, {4.2f, 0.11f, 0.07f}, {0.13f, -0.2f, -6.1f}),
                      test::add_material(*test.capture, material)));
    if (c.moving) test::add_motion(*test.capture, node, {0.3, 0.2, 0.7});
  }
  scene::Camera camera;
  camera.near = 0.3f;
  camera.far = 40.0f;
  if (c.orthographic) {
    camera.type = scene::Camera::Type::kOrthographic;
    camera.x_mag = 2.8f;
    camera.y_mag = 2.1f;
  }
  if (c.lens) camera.lens = {0.15f, 3.1f};
  test::add_camera(*test.capture, {0.13, 0.21, c.crossing ? 1.7 : 4.3}, camera);
  test.pose(kWidth, kHeight, c.moving ? 1.0 : 0.0);
  return test;
}

// ---- The comparison ---------------------------------------------------------------------------------------------

struct Twin {
  float time_offset = 0;  // added to the time of Embree's rays
  bool hole = false;      // the triangle that most samples see is kept from Embree
};

std::vector<std::uint32_t> all_patches(const scene::FrameGeometry& frame) {
  std::vector<std::uint32_t> patches(frame.assembly->patch_count());
  for (std::uint32_t p = 0; p < patches.size(); ++p) patches[p] = p;
  return patches;
}

// The triangle that most samples see.
Claim max_seen(const std::vector<TileState>& tiles) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> count;
  for (const TileState& tile : tiles)
    for (std::size_t s = 0; s < tile.patch.size(); ++s)
      if (tile.patch[s] != TileState::kNoPatch) ++count[{tile.patch[s], tile.triangle[s]}];
  const auto most =
      std::max_element(count.begin(), count.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  return {most->first.first, most->first.second, 0};
}

Agreement compare(const TestFrame& scene, std::uint32_t seed, test::EmbreeOptions options, const Twin& twin) {
  const scene::FrameGeometry& frame = *scene.frame;
  const gpu::GpuConfiguration gpu;
  const binner::TileGrid grid(kWidth, kHeight, gpu.tile.width, gpu.tile.height);
  const SamplePattern pattern({4, seed, 0});
  const frontend::PyramidLibrary pyramids(*scene.assembly);
  test::MachineVisibility machine(gpu, pattern, grid);
  const auto seen = machine.run(frame, pyramids, true);
  if (twin.hole) {
    const Claim hole = max_seen(seen.tiles);
    options.missing_patch = hole.patch;
    options.missing_triangle = hole.triangle;
  }
  const test::EmbreeDevice device("threads=2");
  EmbreeScene embree(device, frame, all_patches(frame), options);
  embree.commit();
  embree.index_triangles();
  Agreement agreement;
  TileSamples samples;
  for (binner::TileIndex tile = 0; tile < grid.tile_count(); ++tile) {
    samples.fill(pattern, grid.pixels(tile), static_cast<float>(frame.projection.lens_scale),
                 frame.projection.lens_scale != 0);
    const TileState& state = seen.tiles[tile];
    for (std::size_t s = 0; s < samples.count; ++s) {
      const test::EmbreeRay ray = embree.ray(samples, s);
      test::EmbreeRay traced = ray;
      traced.time = std::clamp(ray.time + twin.time_offset, 0.0f, 1.0f);
      const Claim tessera =
          state.patch[s] == TileState::kNoPatch ? Claim{} : Claim{state.patch[s], state.triangle[s], state.z[s]};
      embree.compare(ray, tessera, embree.trace(traced), {}, agreement);
    }
  }
  return agreement;
}

class EmbreeOracle : public testing::TestWithParam<OracleCase> {};

TEST_P(EmbreeOracle, SeesTheSameTriangleThroughEverySample) {  // EMB1, EMB2
  Agreement total;
  // Triangles that cross the near plane are tested one by one: slow.
  const std::uint32_t seeds = GetParam().crossing ? 1 : 4;
  for (std::uint32_t seed = 1; seed <= seeds; ++seed) total.add(compare(make_scene(GetParam(), seed), seed, {}, {}));
  const std::string figures = fmt::format(
      "{} samples, {} see something; {} ({:.4f} %) tied, of which {} differ, the farthest {:.2g} px from an edge",
      total.samples, total.visible, total.ties,
      100.0 * static_cast<double>(total.ties) / static_cast<double>(total.samples), total.different_ties,
      total.farthest_edge_pixels);
  RecordProperty("agreement", figures);
  EXPECT_EQ(total.wrong, 0u) << figures;
  EXPECT_EQ(total.wrong_depth, 0u) << figures;
  EXPECT_LT(static_cast<double>(total.ties), 0.001 * static_cast<double>(total.samples)) << figures;
  EXPECT_GT(static_cast<double>(total.visible), 0.5 * static_cast<double>(total.samples)) << figures;
}

std::string case_name(const testing::TestParamInfo<OracleCase>& info) { return info.param.name; }
INSTANTIATE_TEST_SUITE_P(Effects, EmbreeOracle, testing::ValuesIn(kCases), case_name);

std::vector<OracleCase> cases_that(bool (*wanted)(const OracleCase&)) {
  std::vector<OracleCase> cases;
  std::copy_if(std::begin(kCases), std::end(kCases), std::back_inserter(cases), wanted);
  return cases;
}

class EmbreeGridOracle : public EmbreeOracle {};
TEST_P(EmbreeGridOracle, SeesTheSameTriangleThroughEverySample) {  // EMB1, EMB2
  test::EmbreeOptions options;
  options.geometry = test::EmbreeOptions::Geometry::kGrids;
  const Agreement agreement = compare(make_scene(GetParam(), 7), 7, options, {});
  EXPECT_EQ(agreement.wrong, 0u);
  EXPECT_EQ(agreement.wrong_depth, 0u);
}
INSTANTIATE_TEST_SUITE_P(Effects, EmbreeGridOracle,
                         testing::ValuesIn(cases_that([](const OracleCase& c) { return !c.clusters; })), case_name);

// ---- Broken twins -----------------------------------------------------------------------------------------------

TEST_P(EmbreeOracle, ATriangleThatOneOfThemLacksIsCaught) {
  Twin twin;
  twin.hole = true;
  EXPECT_GT(compare(make_scene(GetParam(), 8), 8, {}, twin).wrong, 0u);
}

class EmbreeTimeOracle : public EmbreeOracle {};
TEST_P(EmbreeTimeOracle, SamplesASixteenthOfTheShutterLateAreCaught) {
  Twin twin;
  twin.time_offset = 1.0f / 16;
  const Agreement agreement = compare(make_scene(GetParam(), 9), 9, {}, twin);
  EXPECT_GT(static_cast<double>(agreement.wrong + agreement.wrong_depth),
            0.05 * static_cast<double>(agreement.samples));
}
INSTANTIATE_TEST_SUITE_P(Effects, EmbreeTimeOracle,
                         testing::ValuesIn(cases_that([](const OracleCase& c) { return c.moving; })), case_name);

}  // namespace
}  // namespace tessera::tilecore::embree_oracle_test

// All visibility methods find the same hits with the same bits.
#include "base/simd_targets.h"
#include "tests/support/tests.h"
#include "tests/tilecore/visibility/method_mesh.h"
#include "tilecore/tile_core.h"

namespace tessera::tilecore::visibility_method_test {
namespace {

TEST(VisibilityMethods, FindTheSameHitsOnPatchesAndClustersUnderAllEffects) {
  Random random(1);
  std::size_t hits = 0;
  for (const int time_bits : {8, 16})
    for (const bool orthographic : {false, true})
      for (const auto& [motion, lens] : {std::pair{false, false}, {true, false}, {false, true}, {true, true}})
        for (const bool cluster : {false, true})
          for (const IntRect& tile : {IntRect{0, 0, 24, 16}, IntRect{8, 8, 16, 16}, IntRect{3, 1, 18, 14}}) {
            const MethodMesh m =
                random_mesh(random, {{motion, lens}, orthographic, cluster, 0, 0, 2, tile, 4, time_bits});
            const auto expected = all_pairs(m);
            hits += expected.size();
            expect_all_methods_find(m, expected);
          }
  EXPECT_GT(hits, 30000u);
}

TEST(VisibilityMethods, CountTheSameOnEveryInstructionSet) {
  Random random(2);
  const MethodMesh m = random_mesh(random, {{true, true}});
  for (const NamedMethod& method : methods_of_units()) {
    force_simd_target("");
    const Found expected = find(m.in_tile(), method.settings);
    for (const std::string& target : simd_target_names()) {
      force_simd_target(target);
      const Found found = find(m.in_tile(), method.settings);
      EXPECT_EQ(found.hits, expected.hits) << method.name << " " << target;
      EXPECT_EQ(found.work.box_tests, expected.work.box_tests) << method.name << " " << target;
      EXPECT_EQ(found.work.triangle_tests, expected.work.triangle_tests) << method.name << " " << target;
    }
  }
  force_simd_target("");
}

// ---- Hard cases -------------------------------------------------------------------------------------------------

TEST(VisibilityMethods, AgreeWhenAllSamplesHaveOneTime) {
  Random random(3);
  std::size_t hits = 0;
  for (const int code : {0, 1, 1 << 15, 255 << 8, 0xFFFF}) {
    MethodMesh m = random_mesh(random, {{true, code == 1 << 15}});
    for (auto& time : m.samples.time) time = static_cast<std::uint16_t>(code);
    m.samples.half_quantum = 0;
    // The pattern's classes have that time, too: all of them are classes of one stencil value.
    SampleClasses classes = m.pattern->classes();
    std::fill(classes.t.begin(), classes.t.end(), static_cast<float>(code) / 65536);
    for (int k = 0; k <= 256; ++k) classes.first_at[static_cast<std::size_t>(k)] = k <= code >> 8 ? 0 : classes.count;
    m.samples.classes = &classes;
    const auto expected = all_pairs(m);
    hits += expected.size();
    expect_all_methods_find(m, expected);
  }
  EXPECT_GT(hits, 1000u);
}

TEST(VisibilityMethods, AgreeOnATileWithOneSample) {
  Random random(4);
  std::size_t hits = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const MethodMesh m =
        random_mesh(random, {{true, trial % 2 == 0}, false, trial % 3 == 0, 0, 0, 2, {12, 8, 13, 9}, 1});
    const auto expected = all_pairs(m);
    hits += expected.size();
    expect_all_methods_find(m, expected);
  }
  EXPECT_GT(hits, 10u);
}

TEST(VisibilityMethods, ALensOfRadius0IsAPinholeBitByBit) {
  Random random(5);
  for (int trial = 0; trial < 6; ++trial) {
    MethodMesh m = random_mesh(random, {{true, false}, trial % 2 == 0});
    const auto expected = all_pairs(m);
    m.effects.lens = true;
    m.settings.inverse_focus = 0.3f;
    m.finish(m.samples.pixels, m.samples.spp);
    EXPECT_EQ(all_pairs(m), expected);
    expect_all_methods_find(m, expected);
  }
}

TEST(VisibilityMethods, AgreeOnTrianglesThatDegenerateOrFlipWithinTheShutter) {
  for (const bool flips : {false, true}) {
    MethodMesh m;
    m.effects = {true, false};
    m.resize(4);
    m.place(0, 2, 2, 2);
    m.place(1, 12, 3, 2);
    m.place(2, 12, 13, 2);
    m.place(3, 3, 12, 2);
    // The far corners run through the diagonal, or meet in one point at shutter close.
    m.move(0, flips ? 12.0f : 5.0f, flips ? 11.0f : 6.0f, 3);
    m.move(1, -5, 5, 1);
    m.move(2, flips ? -9.0f : -5.0f, flips ? -10.0f : -5.0f, 3);
    m.move(3, 4, -4, 1);
    m.mesh.begin_leaf();
    m.mesh.add_cell({0, 1, 2, 3}, 0);
    m.finish({0, 0, 16, 16}, 16);
    const auto expected = all_pairs(m);
    EXPECT_GT(expected.size(), 100u);
    expect_all_methods_find(m, expected);
  }
}

TEST(VisibilityMethods, AgreeAtTheEndOfTheGuardBandAndAMillionUnitsAway) {
  Random random(6);
  std::size_t hits = 0;
  for (int trial = 0; trial < 8; ++trial) {
    const MethodMesh m = random_mesh(
        random, {{true, trial % 2 == 0}, trial % 4 > 1, false, 16000, 15000, 1e6f, {16000, 15000, 16024, 15016}});
    const auto expected = all_pairs(m);
    hits += expected.size();
    expect_all_methods_find(m, expected);
  }
  EXPECT_GT(hits, 500u);
}

TEST(VisibilityMethods, OnlySamplesWithinTheEntrysTimesAreTested) {
  Random random(7);
  for (int trial = 0; trial < 6; ++trial) {
    const MethodMesh m = random_mesh(random, {{true, trial % 2 == 0}});
    auto expected = all_pairs(m);
    std::erase_if(expected, [&](const HitSet::Key& hit) {
      const int s = m.samples.stencil(std::get<0>(hit));
      return s < 40 || s > 200;
    });
    MeshInTile in = m.in_tile();
    in.times = {40, 200};
    for (const NamedMethod& method : methods_of_units())
      EXPECT_EQ(find(in, method.settings).hits, expected) << method.name;
  }
}

TEST(VisibilityMethods, OnlyHitsBehindASamplesSurfaceMayBeLeftOut) {
  Random random(8);
  std::uint64_t with = 0, without = 0;
  for (int trial = 0; trial < 8; ++trial) {
    MethodMesh m = random_mesh(random, {{true, trial % 2 == 0}, trial % 4 > 1});
    const auto all = all_pairs(m);
    // Depths that samples see already: the depth of one of their hits, or a random depth.
    std::vector<float> depth(m.samples.count);
    for (float& z : depth) z = random.uniform(0.5f, 5);
    for (const HitSet::Key& hit : all)
      if (random.coin()) depth[std::get<0>(hit)] = std::get<2>(hit);
    const auto in_front = [&](std::set<HitSet::Key> hits) {
      std::erase_if(hits, [&](const HitSet::Key& hit) { return std::get<2>(hit) > depth[std::get<0>(hit)]; });
      return hits;
    };
    for (const NamedMethod& method : methods_of_units()) {
      m.settings.depth = nullptr;
      const Found everything = find(m.in_tile(), method.settings);
      m.settings.depth = depth.data();
      const Found found = find(m.in_tile(), method.settings);
      EXPECT_EQ(in_front(found.hits), in_front(all)) << method.name;
      with += found.rays.node_visits;
      without += everything.rays.node_visits;
    }
  }
  EXPECT_LT(with, without);
}

// ---- Whole tile cores -------------------------------------------------------------------------------------------

// Hits of every patch of a frame, tile by tile; samples are numbered over the frame.
std::set<std::tuple<std::uint64_t, std::uint32_t, HitSet::Key>> frame_hits(const scene::FrameGeometry& frame,
                                                                           int tile_side,
                                                                           const VisibilityMethodSettings& method,
                                                                           CoreCounters* counters = nullptr) {
  const binner::TileGrid grid(frame.request.width, frame.request.height, tile_side, tile_side);
  const SamplePattern pattern({4, 3, 0});
  TileJob job;
  job.frame = &frame;
  job.grid = &grid;
  job.pattern = &pattern;
  job.core.visibility = method;
  TileCore core;
  std::set<std::tuple<std::uint64_t, std::uint32_t, HitSet::Key>> hits;
  for (binner::TileIndex tile = 0; tile < grid.tile_count(); ++tile) {
    const IntRect pixels = grid.pixels(tile);
    core.begin_tile(job, tile);
    for (std::uint32_t patch = 0; patch < frame.assembly->patch_count(); ++patch) {
      binner::ListEntry entry{};
      entry.base_patch = patch;
      entry.range = whole_patch(frame, patch);
      entry.t0 = 0;
      entry.t1 = 255;
      HitSet sink;
      core.find_hits(job, entry, sink);
      for (HitSet::Key key : sink.hits) {
        const std::uint32_t local = std::get<0>(key), pixel = local / 4;
        const auto x = static_cast<std::uint64_t>(pixels.x0) + pixel % static_cast<std::uint32_t>(pixels.width());
        const auto y = static_cast<std::uint64_t>(pixels.y0) + pixel / static_cast<std::uint32_t>(pixels.width());
        std::get<0>(key) = 0;
        hits.emplace((y * 4096 + x) * 4 + local % 4, patch, key);
      }
    }
  }
  if (counters != nullptr) *counters = core.take_result().counters;
  return hits;
}

struct SceneCase {
  const char* name;
  bool bezier, moving, lens, orthographic;
  double camera_z;  // 0.6: the surface crosses the camera's plane
};

class Scenes : public testing::TestWithParam<SceneCase> {};

TEST_P(Scenes, AllMethodsAndTileSizesFindTheHitsOfTheDefault) {
  const SceneCase& c = GetParam();
  TestFrame test;
  scene::Material material;
  material.double_sided = true;
  const int m = test::add_material(*test.capture, material);
  Random random(9);
  int node;
  if (c.bezier) {
    node = test::add_node(*test.capture, test::closed_patches(m));
  } else {
    std::vector<Vec3> positions;
    std::vector<std::uint32_t> indices;
    for (std::uint32_t k = 0; k < 60; ++k) {
      const Vec3 at = random.in_box(1.2f);
      for (int corner = 0; corner < 3; ++corner)
        positions.push_back(at + random.in_box(0.5f)), indices.push_back(3 * k + static_cast<std::uint32_t>(corner));
    }
    node = test::add_node(*test.capture, test::triangles(positions, indices, m));
  }
  if (c.moving) test::add_motion(*test.capture, node, {0.5, -0.3, 0.4});
  scene::Camera camera;
  camera.near = 0.05f;
  if (c.orthographic) camera.type = scene::Camera::Type::kOrthographic;
  if (c.lens) camera.lens = {0.05f, 2.0f};
  test::add_camera(*test.capture, {0, 0, c.camera_z}, camera);
  // Near surfaces are large: fewer pixels.
  if (c.camera_z < 1)
    test.pose(24, 16);
  else
    test.pose(64, 40);
  const auto expected = frame_hits(*test.frame, 32, {});
  EXPECT_GT(expected.size(), 500u);
  EXPECT_EQ(frame_hits(*test.frame, 8, {}), expected);
  for (const NamedMethod& method : methods_of_units())
    for (const int side : {8, 32})
      EXPECT_TRUE(frame_hits(*test.frame, side, method.settings) == expected) << method.name << ", tiles of " << side;
}

INSTANTIATE_TEST_SUITE_P(Cases, Scenes,
                         testing::Values(SceneCase{"StaticPatches", true, false, false, false, 3},
                                         SceneCase{"MovingPatches", true, true, false, false, 3},
                                         SceneCase{"DefocusedPatches", true, false, true, false, 3},
                                         SceneCase{"MovingDefocusedPatches", true, true, true, false, 3},
                                         SceneCase{"OrthographicMovingDefocusedPatches", true, true, true, true, 3},
                                         SceneCase{"CrossingTheCameraPlane", true, true, true, false, 0.6},
                                         SceneCase{"MovingClusters", false, true, false, false, 3},
                                         SceneCase{"ClustersCrossingTheCameraPlane", false, true, true, false, 0.6}),
                         [](const auto& param_info) { return std::string(param_info.param.name); });

// Triangle and box tests per hit of a frame.
struct Rate {
  double triangles, boxes;
  std::size_t hits;
};
Rate rate_of(const TestFrame& test, const VisibilityMethodSettings& method) {
  CoreCounters counters;
  const std::size_t hits = frame_hits(*test.frame, 32, method, &counters).size();
  const auto by = static_cast<double>(counters.tilecore.sample_hits);
  return {static_cast<double>(counters.tilecore.triangle_tests) / by,
          static_cast<double>(counters.tilecore.box_tests) / by, hits};
}

// For each kind of motion the default takes the traversal whose boxes follow it.
TEST(VisibilityMethods, TurningAndComingCloserTakeTheDefaultNoMoreTestsThanEitherWay) {
  for (const char* motion : {"along", "turning", "closer"}) {
    TestFrame test;
    const int m = test::add_material(*test.capture);
    const int node = test::add_node(*test.capture, test::closed_patches(m));
    test::add_camera(*test.capture, {0, 0, 5});
    const std::string how = motion;
    if (how == "along") test::add_motion(*test.capture, node, {0.7, 0.3, 0});
    if (how == "turning") test::add_turn(*test.capture, node, {0, 0, 1}, 1.2f);
    if (how == "closer") test::add_motion(*test.capture, node, {0, 0, 2.2});
    test.pose(96, 64);
    using M = VisibilityMethod;
    const Rate chosen = rate_of(test, {}), classes = rate_of(test, {M::kPatchBvh, 0, Traversal::kClass}),
               rays = rate_of(test, {M::kPatchBvh, 0, Traversal::kRay});
    EXPECT_EQ(chosen.hits, classes.hits);
    EXPECT_EQ(chosen.hits, rays.hits);
    const auto all = [](const Rate& r) { return r.triangles + r.boxes; };
    std::printf("%s: triangle and box tests per hit %.1f %.1f, classes %.1f %.1f, rays %.1f %.1f\n", motion,
                chosen.triangles, chosen.boxes, classes.triangles, classes.boxes, rays.triangles, rays.boxes);
    EXPECT_LE(all(chosen), 1.06 * std::min(all(classes), all(rays))) << motion;
    if (how != "along") {
      EXPECT_LE(chosen.triangles, 1.3 * rays.triangles) << motion;
    }
  }
}

// A street of walls that the camera flies through: all cells beside it cross the camera's plane during the shutter.
TEST(VisibilityMethods, CellsAcrossTheNearPlaneTakeFewTestsPerHitByEveryMethod) {
  TestFrame test;
  scene::Material material;
  material.double_sided = true;
  const int m = test::add_material(*test.capture, material);
  constexpr int kCells = 24;
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> indices;
  for (int j = 0; j <= kCells; ++j)
    for (int i = 0; i <= kCells; ++i)
      positions.push_back({0.4f + 0.02f * std::sin(static_cast<float>(i)), -0.6f + 0.05f * static_cast<float>(j),
                           0.5f - 0.08f * static_cast<float>(i)});
  for (std::uint32_t j = 0; j < kCells; ++j)
    for (std::uint32_t i = 0; i < kCells; ++i) {
      const std::uint32_t a = j * (kCells + 1) + i;
      indices.insert(indices.end(), {a, a + 1, a + kCells + 2, a, a + kCells + 2, a + kCells + 1});
    }
  test::add_node(*test.capture, test::triangles(positions, indices, m));
  scene::Camera camera;
  camera.near = 0.02f;
  camera.vertical_fov = 1.2f;
  test::add_camera(*test.capture, {0, 0, 0.3}, camera);
  test::add_motion(*test.capture, static_cast<int>(test.capture->nodes.size()) - 1, {0, 0, -1});
  test.pose(96, 64);
  const auto rate = [&](const VisibilityMethodSettings& method, std::size_t& hits) {
    CoreCounters counters;
    hits = frame_hits(*test.frame, 32, method, &counters).size();
    return static_cast<double>(counters.tilecore.triangle_tests) / static_cast<double>(counters.tilecore.sample_hits);
  };
  std::size_t expected = 0, hits = 0;
  using M = VisibilityMethod;
  const double brute = rate({M::kBrute}, expected), bvh = rate({}, hits);
  EXPECT_GT(expected, 3000u);
  EXPECT_EQ(hits, expected);
  EXPECT_GT(brute, 100);
  EXPECT_LE(bvh, 20);
  RecordProperty("brute", std::to_string(brute));
  std::printf("triangle tests per hit: brute %.1f, patch-bvh %.2f", brute, bvh);
  const double classes = rate({M::kPatchBvh, 0, Traversal::kClass}, hits),
               rays = rate({M::kPatchBvh, 0, Traversal::kRay}, hits);
  std::printf(", classes %.1f, rays %.1f", classes, rays);
  EXPECT_LE(bvh, 1.3 * std::min(classes, rays));
  for (const M method : {M::kSegments, M::kPartition, M::kClusters, M::kClusterPartition, M::kInterleaved}) {
    const double own = rate({method}, hits);
    EXPECT_EQ(hits, expected);
    EXPECT_LT(own, 1.05 * brute);
    std::printf(", %s %.1f", std::string(word(method)).c_str(), own);
  }
  std::printf("\n");
}

// ---- Purpose of the methods -------------------------------------------------------------------------------------

TEST(VisibilityMethods, AsBlurGrowsBruteForceCollapsesAndTheBvhDoesNot) {
  const auto efficiency = [](const VisibilityMethodSettings& method, float blur) {
    MethodMesh m;
    m.effects = {true, false};
    m.resize(81);
    for (std::size_t v = 0; v < 81; ++v) {
      m.place(v, 8 + static_cast<float>(v % 9) + 0.03f, 8 + static_cast<float>(v / 9) + 0.03f, 2);
      m.move(v, blur * 0.8f, blur * 0.6f, 2);
    }
    m.add_grid_cells(8);
    m.finish({0, 0, 96, 80}, 4);
    const Found found = find(m.in_tile(), method);
    return static_cast<double>(found.work.sample_hits) / static_cast<double>(found.work.triangle_tests);
  };
  const VisibilityMethodSettings brute{VisibilityMethod::kBrute}, rays{VisibilityMethod::kPatchBvh, 0, Traversal::kRay};
  EXPECT_LT(efficiency(brute, 40), 0.05 * efficiency(brute, 0));
  EXPECT_GT(efficiency(rays, 40), 0.5 * efficiency(rays, 0));
}

}  // namespace
}  // namespace tessera::tilecore::visibility_method_test

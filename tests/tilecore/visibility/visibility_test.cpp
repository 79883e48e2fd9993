// The kernels, boxes and time ranges of visibility against brute force: every sample against every triangle.
#include "base/simd_targets.h"
#include "tests/support/tests.h"
#include "tests/tilecore/support.h"
#include "tilecore/visibility/clipped_cells.h"
#include "tilecore/visibility/tile_frustum.h"

namespace tessera::tilecore::visibility_test {
namespace {

// Inputs of visibility without a scene: random cells, moving, at random depths.
struct RandomMesh {
  MicroMesh mesh;
  RayEffects effects;
  VisibilitySettings settings;
  SamplePattern pattern;
  TileSamples samples;
  float lens_scale;

  RandomMesh(const RandomMesh& o)
      : mesh(o.mesh),
        effects(o.effects),
        settings(o.settings),
        pattern(o.pattern),
        samples(o.samples),
        lens_scale(o.lens_scale) {
    samples.classes = &pattern.classes();
  }
  RandomMesh(Random& random, RayEffects effects_in, bool orthographic, const SamplingSettings& sampling = {4, 1, 0})
      : effects(effects_in), pattern(sampling), lens_scale(effects_in.lens ? random.uniform(0, 20) : 0) {
    settings.orthographic = orthographic;
    settings.inverse_focus = random.uniform(0, 0.8f);
    settings.limits.near = 0.5f;
    if (random.coin()) settings.weight_steps = weight_steps(random.integer(8, 24));
    const std::size_t count = 60;
    mesh.resize_vertices(count + 64, true);
    mesh.vertex_count = count;
    const float size = random.coin() ? 3.0f : 30.0f, speed = random.coin() ? 0.0f : random.uniform(0, 60);
    for (std::size_t v = 0; v < count; ++v) {
      const auto grid = [](float x) { return std::round(x * 256) / 256; };
      const float cx = static_cast<float>(v / 4 % 5) * 8, cy = static_cast<float>(v / 20) * 10;
      mesh.x0[v] = grid(cx + random.uniform(-size, size));
      mesh.y0[v] = grid(cy + random.uniform(-size, size));
      mesh.z0[v] = random.uniform(0.6f, 4);
      const bool still = !effects.motion || random.integer(0, 4) == 0;
      mesh.x1[v] = still ? mesh.x0[v] : grid(mesh.x0[v] + random.uniform(-speed, speed));
      mesh.y1[v] = still ? mesh.y0[v] : grid(mesh.y0[v] + random.uniform(-speed, speed));
      mesh.z1[v] = still ? mesh.z0[v] : random.uniform(0.6f, 4);
      mesh.projected[v] = 1;
    }
    for (std::int32_t v = 0; v + 3 < static_cast<std::int32_t>(count); v += 4) {
      if (v / 4 % 10 == 0) mesh.begin_leaf();
      const bool quad = random.coin();
      mesh.add_cell({v, v + 1, v + 2, quad ? v + 3 : v + 2}, static_cast<std::uint32_t>(v / 2));
    }
    build_cells(mesh, {effects.motion, effects.lens, orthographic, settings.inverse_focus, lens_scale});
    samples.fill(pattern, {0, 0, 40, 24}, lens_scale, effects.lens);
  }
};

// The scalar twin of a corner: the formulas of MicroMesh, with the kernels' roundings.
Corner reference_corner(const RandomMesh& r, std::size_t v, std::size_t sample) {
  const MicroMesh& m = r.mesh;
  const float t = r.samples.t(sample);
  Corner c;
  c.z = r.effects.motion ? std::fma(t, m.z1[v] - m.z0[v], m.z0[v]) : m.z0[v];
  c.scale = r.settings.orthographic ? 1.0f : 1.0f / c.z;
  c.x = m.x0[v] - r.samples.x[sample];
  c.y = m.y0[v] - r.samples.y[sample];
  if (r.effects.motion) {
    const float lambda = r.settings.orthographic ? t : t * (m.z1[v] / c.z);
    c.x = std::fma(lambda, m.x1[v] - m.x0[v], c.x);
    c.y = std::fma(lambda, m.y1[v] - m.y0[v], c.y);
  }
  if (r.effects.lens) {
    const float coc =
        r.settings.orthographic ? 1.0f - c.z * r.settings.inverse_focus : c.scale - r.settings.inverse_focus;
    c.x = std::fma(-r.samples.lens_u[sample], coc, c.x);
    c.y = std::fma(-r.samples.lens_v[sample], coc, c.y);
  }
  return c;
}

std::set<HitSet::Key> brute_force(const RandomMesh& r) {
  std::set<HitSet::Key> hits;
  for (std::size_t cell = 0; cell < r.mesh.used.size(); ++cell) {
    if (!r.mesh.used[cell]) continue;
    for (std::uint32_t s = 0; s < r.samples.count; ++s) {
      Corner c[4];
      for (std::size_t k = 0; k < 4; ++k)
        c[k] = reference_corner(r, static_cast<std::size_t>(r.mesh.corner[k][cell]), s);
      const auto test = [&](const Corner& a, const Corner& b, const Corner& d, std::uint32_t offset) {
        TriangleHit hit;
        if (!exact_triangle_test(a, b, d, r.settings.orthographic, hit)) return;
        const HitLimits& limits = r.settings.limits;
        if (!(hit.z >= limits.near && hit.z <= limits.far) ||
            !(hit.positive ? limits.keep_positive : limits.keep_negative))
          return;
        round_weights(r.settings.weight_steps, hit.b1, hit.b2);
        hits.emplace(s, r.mesh.triangle[cell] + offset, hit.z, hit.b1, hit.b2);
      };
      test(c[0], c[1], c[2], 0);
      if (r.mesh.corner[2][cell] != r.mesh.corner[3][cell]) test(c[0], c[2], c[3], 1);
    }
  }
  return hits;
}

std::set<HitSet::Key> traced(const RandomMesh& r, VisibilityWork& work) {
  HitSet sink;
  for (std::size_t l = 0; l < r.mesh.leaves.size(); ++l) {
    const TimeRange times = touching_times(r.mesh.leaves[l], r.samples.pixels, r.effects.motion, r.lens_scale);
    if (!times.empty()) trace_leaf(r.mesh, l, r.samples, times, r.effects, r.settings, sink, work);
  }
  sink.flush();
  return sink.hits;
}

class Visibility : public testing::TestWithParam<std::tuple<bool, bool, bool>> {};

TEST_P(Visibility, TheRayPathFindsExactlyTheHitsOfBruteForceOnEveryInstructionSet) {
  const auto [motion, lens, orthographic] = GetParam();
  Random random(10);
  std::size_t total = 0;
  for (int trial = 0; trial < 12; ++trial) {
    const RandomMesh mesh(random, {motion, lens}, orthographic);
    const auto expected = brute_force(mesh);
    total += expected.size();
    VisibilityWork first;
    for (const std::string& target : simd_target_names()) {
      force_simd_target(target);
      VisibilityWork work;
      EXPECT_EQ(traced(mesh, work), expected) << target;
      EXPECT_EQ(work.sample_hits, expected.size());
      if (first.box_tests == 0) first = work;
      EXPECT_EQ(work.box_tests, first.box_tests) << target;
      EXPECT_EQ(work.triangle_tests, first.triangle_tests) << target;
      EXPECT_EQ(work.box_lanes, first.box_lanes) << target;
      EXPECT_EQ(work.triangle_lanes, first.triangle_lanes) << target;
      EXPECT_GE(work.box_lanes, work.box_tests);
      EXPECT_GE(work.triangle_lanes, work.triangle_tests);
    }
  }
  force_simd_target("");
  EXPECT_GT(total, 1000u);
}

TEST_P(Visibility, EveryPatternAndPrecisionOfTimeFindsTheHitsOfBruteForce) {
  const auto [motion, lens, orthographic] = GetParam();
  for (const SamplingSettings& sampling :
       {SamplingSettings{4, 1, 0, 32, 8}, SamplingSettings{3, 2, 5, 8, 16}, SamplingSettings{16, 0, 1, 8, 16}}) {
    Random random(70);
    std::uint64_t triangle_tests = 0;
    for (int trial = 0; trial < 2; ++trial) {
      const RandomMesh mesh(random, {motion, lens}, orthographic, sampling);
      VisibilityWork work;
      EXPECT_EQ(traced(mesh, work), brute_force(mesh)) << sampling.pattern_side << " " << sampling.samples_per_pixel;
      triangle_tests += work.triangle_tests;
    }
    EXPECT_GT(triangle_tests, 0u);
  }
}

// A sample that already sees something nearer than the leaf is not tested; one that sees something as near is.
TEST_P(Visibility, OnlyHitsBehindTheSamplesDepthAreLeftOut) {
  const auto [motion, lens, orthographic] = GetParam();
  Random random(80);
  for (int trial = 0; trial < 6; ++trial) {
    RandomMesh mesh(random, {motion, lens}, orthographic);
    std::vector<float> depth(mesh.samples.count);
    for (float& z : depth) z = random.coin() ? std::numeric_limits<float>::infinity() : random.uniform(0.6f, 4);
    auto expected = brute_force(mesh);
    // Ties must arrive: some samples already have exactly the depth of their hit.
    for (const auto& hit : expected)
      if (std::get<0>(hit) % 5 == 0) depth[std::get<0>(hit)] = std::get<2>(hit);
    std::erase_if(expected, [&](const HitSet::Key& hit) { return std::get<2>(hit) > depth[std::get<0>(hit)]; });
    VisibilityWork all, some;
    (void)traced(mesh, all);
    mesh.settings.depth = depth.data();
    const auto found = traced(mesh, some);
    for (const auto& hit : expected) EXPECT_TRUE(found.contains(hit));
    for (const auto& hit : found) EXPECT_TRUE(expected.contains(hit) || std::get<2>(hit) <= depth[std::get<0>(hit)]);
    EXPECT_LE(some.triangle_tests, all.triangle_tests);
  }
}

TEST_P(Visibility, ListsOfSamplesGiveTheSameHits) {
  const auto [motion, lens, orthographic] = GetParam();
  Random random(90);
  for (int trial = 0; trial < 4; ++trial) {
    const RandomMesh mesh(random, {motion, lens}, orthographic);
    std::vector<std::uint32_t> list;
    for (std::uint32_t s = 0; s < mesh.samples.count; ++s) list.push_back(s);
    HitSet sink;
    VisibilityWork work;
    for (std::size_t cell = 0; cell < mesh.mesh.used.size(); ++cell)
      if (mesh.mesh.used[cell])
        test_cell_samples(mesh.mesh, cell, list, mesh.samples, mesh.effects, mesh.settings, sink, work);
    sink.flush();
    EXPECT_EQ(sink.hits, brute_force(mesh));
  }
}

// A sample more than a row of lanes holds takes a row more.
TEST_P(Visibility, IdleLanesAreCounted) {
  const auto [motion, lens, orthographic] = GetParam();
  Random random(95);
  const RandomMesh mesh(random, {motion, lens}, orthographic);
  const auto cell =
      static_cast<std::size_t>(std::find(mesh.mesh.used.begin(), mesh.mesh.used.end(), true) - mesh.mesh.used.begin());
  ASSERT_LT(cell, mesh.mesh.used.size());
  std::vector<std::uint32_t> list;
  const auto lanes = [&] {
    HitSet sink;
    VisibilityWork work;
    test_cell_samples(mesh.mesh, cell, list, mesh.samples, mesh.effects, mesh.settings, sink, work);
    return work.triangle_lanes;
  };
  EXPECT_EQ(lanes(), 0u);
  for (std::uint32_t s = 0; s < 33; ++s) list.push_back(s);
  const std::uint64_t of_33 = lanes();
  list.pop_back();
  const std::uint64_t of_32 = lanes();
  EXPECT_EQ(of_33 * 2, of_32 * 3);
  list.resize(17);
  EXPECT_EQ(lanes(), of_32);
}

TEST_P(Visibility, FacingAndDepthLimitsAreRespected) {
  const auto [motion, lens, orthographic] = GetParam();
  Random random(20);
  RandomMesh mesh(random, {motion, lens}, orthographic);
  VisibilityWork work;
  const std::size_t both = traced(mesh, work).size();
  mesh.settings.limits.keep_positive = false;
  const std::size_t negative = traced(mesh, work).size();
  EXPECT_EQ(traced(mesh, work), brute_force(mesh));
  mesh.settings.limits.keep_positive = true;
  mesh.settings.limits.keep_negative = false;
  EXPECT_EQ(traced(mesh, work).size() + negative, both);
  mesh.settings.limits.keep_negative = true;
  mesh.settings.limits.near = 1.5f;
  mesh.settings.limits.far = 2.0f;
  EXPECT_EQ(traced(mesh, work), brute_force(mesh));
}

std::string effect_names(const testing::TestParamInfo<std::tuple<bool, bool, bool>>& info) {
  const auto [motion, lens, orthographic] = info.param;
  return std::string(motion ? "Moving" : "Still") + (lens ? "Lens" : "Pinhole") +
         (orthographic ? "Orthographic" : "Perspective");
}
INSTANTIATE_TEST_SUITE_P(Effects, Visibility, testing::Combine(testing::Bool(), testing::Bool(), testing::Bool()),
                         effect_names);

TEST(RasterPath, FindsExactlyTheHitsOfBruteForceOnEveryInstructionSet) {
  Random random(30);
  for (int trial = 0; trial < 20; ++trial) {
    const RandomMesh mesh(random, {}, trial % 2 == 0);
    const auto expected = brute_force(mesh);
    VisibilityWork first;
    for (const std::string& target : simd_target_names()) {
      force_simd_target(target);
      HitSet sink;
      VisibilityWork work;
      raster_mesh(mesh.mesh, mesh.samples, mesh.settings, sink, work);
      sink.flush();
      EXPECT_EQ(sink.hits, expected) << target;
      if (first.box_tests == 0) first = work;
      EXPECT_EQ(work.triangle_tests, first.triangle_tests) << target;
      EXPECT_EQ(work.box_lanes, first.box_lanes) << target;
      EXPECT_EQ(work.triangle_lanes, first.triangle_lanes) << target;
      EXPECT_GE(work.box_lanes, work.box_tests);
      EXPECT_GE(work.triangle_lanes, work.triangle_tests);
      EXPECT_EQ(work.sample_hits, expected.size());
    }
  }
  force_simd_target("");
}

TEST(RayPath, WithoutMotionAndWithALensOfRadiusZeroItEqualsTheRasterPathBitByBit) {
  Random random(40);
  for (int trial = 0; trial < 20; ++trial) {
    RandomMesh still(random, {}, trial % 2 == 0);
    HitSet raster;
    VisibilityWork work;
    raster_mesh(still.mesh, still.samples, still.settings, raster, work);
    raster.flush();
    // The same mesh through the general kernels: key 1 equals key 0, lens points all scaled by 0.
    RandomMesh general = still;
    general.effects = {true, true};
    build_cells(general.mesh, {true, true, still.settings.orthographic, still.settings.inverse_focus, 0.0f});
    general.lens_scale = 0;
    general.samples.fill(general.pattern, {0, 0, 40, 24}, 0.0f, true);
    EXPECT_EQ(traced(general, work), raster.hits);
  }
}

// ---- Boxes and time ranges --------------------------------------------------------------------------------------

// Leaves whose time range for a rectangle misses a time at which the box touches it.
int missed_times(std::uint32_t seed, bool naive) {
  Random random(seed);
  int missed = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    MicroMesh::Leaf leaf{};
    leaf.rate = random.coin() ? 1.0f : std::exp(random.uniform(-2, 2));
    leaf.x_low = random.uniform(-60, 60);
    leaf.x_high = leaf.x_low + random.uniform(0, 5);
    leaf.y_low = random.uniform(-60, 60);
    leaf.y_high = leaf.y_low + random.uniform(0, 5);
    // Slow motion is where a naive solve fails.
    const float speed = std::pow(2.0f, random.uniform(-22, 7));
    leaf.drift_x = random.uniform(-speed, speed);
    leaf.drift_y = random.uniform(-speed, speed);
    IntRect pixels;
    // A side right where the box starts.
    pixels.x0 = static_cast<int>(std::floor(leaf.x_high)) + random.integer(-1, 1);
    pixels.x1 = pixels.x0 + random.integer(1, 8);
    pixels.y0 = static_cast<int>(std::floor(leaf.y_low)) - random.integer(0, 8);
    pixels.y1 = pixels.y0 + random.integer(1, 16);
    TimeRange range = touching_times(leaf, pixels, true, 0);
    if (naive && !range.empty()) {
      // The published solve in single precision, rounded to codes without widening.
      const float d0 = static_cast<float>(pixels.x0) - leaf.x_high, d1 = d0 - leaf.drift_x;
      if (d0 > 0 && d1 < 0)
        range.first = std::max(range.first, static_cast<int>(std::ceil(d0 / (d0 - d1) * 256.0f)) + 1);
    }
    for (int code = 0; code < 256; ++code) {
      const float t = static_cast<float>(code) / 256.0f, tau = t * leaf.rate / ((1.0f - t) + t * leaf.rate);
      const auto face = [&](float at, float drift) { return std::fma(tau, drift, at); };
      const bool touches = face(leaf.x_low, leaf.drift_x) <= static_cast<float>(pixels.x1) &&
                           face(leaf.x_high, leaf.drift_x) >= static_cast<float>(pixels.x0) &&
                           face(leaf.y_low, leaf.drift_y) <= static_cast<float>(pixels.y1) &&
                           face(leaf.y_high, leaf.drift_y) >= static_cast<float>(pixels.y0);
      if (touches && (code < range.first || code > range.last)) ++missed;
    }
  }
  return missed;
}

TEST(TouchingTimes, NeverMissATimeAtWhichTheBoxTouchesHoweverSlowTheMotion) { EXPECT_EQ(missed_times(50, false), 0); }

TEST(TouchingTimes, ANaiveSolveIsCaught) { EXPECT_GT(missed_times(50, true), 0); }

TEST(TouchingTimes, AreTightForFastMotion) {
  MicroMesh::Leaf leaf{};
  leaf.rate = 1;
  leaf.x_low = 0, leaf.x_high = 1, leaf.drift_x = 256;  // one pixel per code
  leaf.y_high = 8;
  const TimeRange range = touching_times(leaf, {100, 0, 108, 8}, true, 0);
  EXPECT_GE(range.first, 97);
  EXPECT_LE(range.last, 110);
  EXPECT_TRUE(touching_times(leaf, {100, 20, 108, 28}, true, 0).empty());
}

TEST(TouchingTimes, AreTheSameForOneLeafAndForManyOnEverySimdTarget) {
  Random random(51);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<MicroMesh::Leaf> leaves(static_cast<std::size_t>(random.integer(1, 21)));
    for (MicroMesh::Leaf& leaf : leaves) {
      leaf.rate = random.coin() ? 1.0f : std::exp(random.uniform(-2, 2));
      leaf.x_low = random.uniform(-60, 60);
      leaf.x_high = leaf.x_low + random.uniform(-1, 9);  // some are empty
      leaf.y_low = random.uniform(-60, 60);
      leaf.y_high = leaf.y_low + random.uniform(0, 9);
      leaf.drift_x = random.coin() ? 0.0f : random.uniform(-90, 90);
      leaf.drift_y = random.uniform(-90, 90);
      leaf.lens_factor = random.uniform(-1, 1);
    }
    const int x0 = random.integer(-64, 32), y0 = random.integer(-64, 32);
    const IntRect pixels{x0, y0, x0 + random.integer(1, 32), y0 + random.integer(1, 32)};
    const bool moving = random.integer(0, 9) > 0;
    const float lens_scale = random.coin() ? 0.0f : random.uniform(0, 20);
    for (const std::string& target : simd_target_names()) {
      force_simd_target(target);
      std::vector<TimeRange> times(leaves.size());
      touching_times(leaves, pixels, moving, lens_scale, times);
      for (std::size_t l = 0; l < leaves.size(); ++l) {
        const TimeRange one = touching_times(leaves[l], pixels, moving, lens_scale);
        EXPECT_TRUE(times[l].first == one.first && times[l].last == one.last)
            << target << " leaf " << l << " of trial " << trial;
      }
    }
    force_simd_target("");
  }
}

// Vertices outside their cell's moving box at some time and lens point.
int box_violations(bool forget_spread) {
  Random random(60);
  int violations = 0;
  for (int trial = 0; trial < 40; ++trial) {
    RandomMesh r(random, {true, false}, false);
    // Everything moves far besides.
    for (std::size_t v = 0; v < r.mesh.vertex_count; ++v) r.mesh.x1[v] += 200;
    const std::vector<float> close = r.mesh.z1;
    if (forget_spread) r.mesh.z1 = r.mesh.z0;  // boxes that move linearly on screen
    build_cells(r.mesh, {true, false, false, 0, 0});
    r.mesh.z1 = close;
    for (std::size_t cell = 0; cell < r.mesh.used.size(); ++cell) {
      if (!r.mesh.used[cell]) continue;
      const auto& leaf = r.mesh.leaves[cell / kLeafCells];
      for (int code = 0; code < 256; code += 5) {
        const float t = static_cast<float>(code) / 256.0f, tau = t * leaf.rate / ((1.0f - t) + t * leaf.rate);
        for (const auto& corner : r.mesh.corner) {
          const auto v = static_cast<std::size_t>(corner[cell]);
          const double z0 = static_cast<double>(r.mesh.z0[v]), z1 = static_cast<double>(r.mesh.z1[v]),
                       td = static_cast<double>(t);
          const double lambda = td * z1 / ((1 - td) * z0 + td * z1);
          const double x = static_cast<double>(r.mesh.x0[v]) +
                           lambda * (static_cast<double>(r.mesh.x1[v]) - static_cast<double>(r.mesh.x0[v]));
          const float low = std::fma(tau, leaf.drift_x, r.mesh.box_x_low[cell]),
                      high = std::fma(tau, leaf.drift_x, r.mesh.box_x_high[cell]);
          if (x < static_cast<double>(low) || x > static_cast<double>(high)) ++violations;
        }
      }
    }
  }
  return violations;
}

TEST(MovingBoxes, HoldTheirVerticesAtEveryTimeAlsoWhenTheyApproachAtDifferentRates) {
  EXPECT_EQ(box_violations(false), 0);
}

TEST(MovingBoxes, BoxesThatMoveLinearlyOnScreenAreCaught) { EXPECT_GT(box_violations(true), 0); }

// ---- Clipped cells ----------------------------------------------------------------------------------------------

// A floor through the camera plane: all samples below the horizon, as far as the floor reaches, see it.
TEST(ClippedCells, AFloorThatPassesUnderTheCameraHasNoHole) {
  for (const bool moving : {false, true}) {
    TestFrame test;
    const auto point = [](float x, float z) { return Vec3(x, -1, z); };
    std::vector<Vec3> positions;
    std::vector<std::uint32_t> indices;
    const int n = 6;
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i <= n; ++i)
        positions.push_back(point(-30.0f + 10.0f * static_cast<float>(i), 10.0f - 10.0f * static_cast<float>(j)));
    for (std::uint32_t j = 0; j < n; ++j)
      for (std::uint32_t i = 0; i < n; ++i) {
        const std::uint32_t a = j * (n + 1) + i;
        indices.insert(indices.end(), {a, a + 1, a + n + 2, a, a + n + 2, a + n + 1});
      }
    const int node = test::add_node(*test.capture, test::triangles(positions, indices));
    if (moving) test::add_motion(*test.capture, node, {0, 0, 3});
    scene::Camera camera;
    camera.near = 0.01f;
    test::add_camera(*test.capture, {0, 0, 0}, camera);
    test.pose(64, 48);
    const auto& frame = *test.frame;
    const SamplePattern pattern({4, 0, 0});
    TileSamples samples;
    samples.fill(pattern, {0, 0, 64, 48}, 0, false);
    Tessellator tessellator;
    MicroMesh mesh;
    HitSet sink;
    VisibilityWork work;
    const VisibilitySettings settings{{0.01f}, false, 0};
    for (std::uint32_t patch = 0; patch < frame.assembly->patch_count(); ++patch) {
      tessellator.tessellate(frame, patch, whole_patch(frame, patch), {moving, false}, mesh);
      EXPECT_FALSE(mesh.clipped_cells.empty());
      if (moving) {
        for (std::size_t l = 0; l < mesh.leaves.size(); ++l)
          trace_leaf(mesh, l, samples, {0, 255}, {true, false}, settings, sink, work);
      } else {
        raster_mesh(mesh, samples, settings, sink, work);
      }
      // In two parts of the shutter: together they test every sample once.
      for (const TimeRange times : {TimeRange{0, 99}, TimeRange{100, 255}})
        test_clipped_cells(mesh, samples, times, {moving, false}, frame.projection, settings, {}, sink, work);
      sink.flush();
    }
    std::map<std::uint32_t, int> count;
    for (const auto& hit : sink.hits) ++count[std::get<0>(hit)];
    for (std::uint32_t s = 0; s < samples.count; ++s) {
      // The ray (dx, dy, -1) z meets y = -1 at z = -1/dy.
      const double dx = (static_cast<double>(samples.x[s]) - 32) / frame.projection.scale,
                   dy = -(static_cast<double>(samples.y[s]) - 24) / frame.projection.scale;
      const double z = dy < 0 ? -1 / dy : 1e9, shift = moving ? 3 * static_cast<double>(samples.t(s)) : 0;
      const bool expected = z + shift < 49.9 && std::abs(dx * z) < 29.9;
      const bool outside = z + shift > 50.1 || std::abs(dx * z) > 30.1;
      if (expected) {
        EXPECT_EQ(count[s], 1) << samples.x[s] << " " << samples.y[s];
      }
      if (outside) {
        EXPECT_EQ(count[s], 0);
      }
    }
  }
}

}  // namespace
}  // namespace tessera::tilecore::visibility_test

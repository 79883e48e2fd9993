// Min-max pyramids and bounds on screen.
#include "frontend/bounds/coarse_depth.h"
#include "frontend/bounds/minmax_pyramid.h"
#include "frontend/bounds/screen_bounds.h"
#include "frontend/occlusion_candidate.h"
#include "tests/frontend/bound_scenes.h"
#include "tests/support/tests.h"

namespace tessera::frontend::bounds_test {
namespace {

// ---- Min-max pyramid --------------------------------------------------------------------------------------------

shaders::ScalarTexture random_texture(Random& random, int width, int height) {
  std::vector<float> values(static_cast<std::size_t>(width * height));
  // Noise, or a ramp, whose coarse levels differ from nearby texels.
  const bool ramp = random.coin();
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = ramp ? static_cast<float>(i) * 0.01f : random.uniform(-1, 1);
  return {width, height, values};
}

shaders::Sampler random_sampler(Random& random) {
  constexpr shaders::Wrap kWraps[] = {shaders::Wrap::kRepeat, shaders::Wrap::kMirroredRepeat,
                                      shaders::Wrap::kClampToEdge};
  shaders::Sampler sampler;
  sampler.wrap_s = kWraps[random.integer(0, 2)];
  sampler.wrap_t = kWraps[random.integer(0, 2)];
  return sampler;
}

// Counts samples of random boxes, taken at up to `lod`, that fall outside the range of a query with `claimed_lod`.
int pyramid_violations(std::uint32_t seed, bool honest) {
  Random random(seed);
  int violations = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const shaders::ScalarTexture texture = random_texture(random, random.integer(1, 33), random.integer(1, 33));
    const MinMaxPyramid pyramid(texture);
    const shaders::Sampler sampler = random_sampler(random);
    const float lod = random.coin() ? 0.0f : random.uniform(0, 6);
    const float size = random.coin() ? random.uniform(0, 0.1f) : random.uniform(0, 3);
    const Vec2 low(random.uniform(-3, 3), random.uniform(-3, 3)),
        high = low + Vec2(random.uniform(0, size), random.uniform(0, size));
    const ValueRange range = pyramid.query(sampler, low, high, honest ? lod : 0.0f);
    for (int k = 0; k < 60; ++k) {
      const Vec2 uv(random.uniform(low.x, high.x), random.uniform(low.y, high.y));
      const float value = texture.sample(sampler, uv, lod);
      if (value < range.low || value > range.high) ++violations;
    }
  }
  return violations;
}

TEST(MinMaxPyramid, HoldsEveryFilteredValueOfAFootprintAtAnyLevelAndWrap) { EXPECT_EQ(pyramid_violations(1, true), 0); }

TEST(MinMaxPyramid, AQueryThatForgetsTheFiltersFootprintIsCaught) { EXPECT_GT(pyramid_violations(1, false), 0); }

TEST(MinMaxPyramid, ASmallFootprintGivesATightRange) {
  std::vector<float> ramp;
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) ramp.push_back(static_cast<float>(x));
  const MinMaxPyramid pyramid(shaders::ScalarTexture(64, 64, ramp));
  shaders::Sampler clamp;
  clamp.wrap_s = clamp.wrap_t = shaders::Wrap::kClampToEdge;
  const ValueRange range = pyramid.query(clamp, {0.5f, 0.5f}, {0.52f, 0.52f}, 0);
  EXPECT_GT(range.low, 24.0f);  // the point is at 32; four texels of footprint, up to two entries of a level
  EXPECT_LT(range.high, 44.0f);
}

TEST(MinMaxPyramid, FootprintsThatAreNotFiniteGetTheWholeRange) {
  Random random(3);
  const shaders::ScalarTexture texture = random_texture(random, 9, 5);
  const MinMaxPyramid pyramid(texture);
  const float infinity = std::numeric_limits<float>::infinity();
  for (const float odd : {infinity, -infinity, std::nanf(""), 1e30f})
    for (int s = 0; s < 9; ++s) {
      const ValueRange range = pyramid.query(random_sampler(random), {odd, 0}, {odd, 0.5f}, 2);
      EXPECT_LE(range.low, range.high);
    }
}

TEST(MinMaxPyramid, OneTexelIsItsOwnRangeEverywhere) {
  const MinMaxPyramid pyramid(shaders::ScalarTexture(1, 1, {0.75f}));
  const ValueRange range = pyramid.query({}, {-9, -9}, {9, 9}, 5);
  EXPECT_NEAR(range.low, 0.75f, 1e-4f);
  EXPECT_NEAR(range.high, 0.75f, 1e-4f);
}

// ---- Screen bounds ----------------------------------------------------------------------------------------------

scene::Projection projection(bool orthographic, double lens, double focus) {
  scene::Projection p;
  p.orthographic = orthographic;
  p.center_x = 320;
  p.center_y = 240;
  p.scale = orthographic ? 60 : 500;
  p.near = 0.1;
  p.lens_scale = p.scale * lens;
  p.inverse_focus = focus > 0 ? 1 / focus : 0;
  return p;
}

enum class Twin { kHonest, kLinearScreenMotion, kNoLens };

// Random boxes in camera space at two motion keys, many behind or across the camera plane; counts points outside the bound.
int screen_violations(std::uint32_t seed, Twin twin) {
  Random random(seed);
  int violations = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    const scene::Projection p = projection(random.integer(0, 3) == 0, random.coin() ? 0.0 : 0.05, 2.0);
    MovingCorners corners;
    for (std::size_t key = 0; key < 2; ++key) {
      const DVec3 center(static_cast<double>(random.uniform(-2, 2)), static_cast<double>(random.uniform(-2, 2)),
                         static_cast<double>(random.uniform(-4, 1)));
      const double half = static_cast<double>(random.uniform(0.01f, 1));
      for (std::size_t i = 0; i < 8; ++i)
        corners[8 * key + i] =
            p.matrix() * DVec4(center + half * DVec3((i & 1) ? 1 : -1, (i & 2) ? 1 : -1, (i & 4) ? 1 : -1), 1);
    }
    scene::Projection bounded = p;
    if (twin == Twin::kNoLens) bounded.lens_scale = 0;
    auto bounds = screen_bounds(corners, bounded, {});
    for (int k = 0; k < 25; ++k) {
      // A point of the box at each key, linearly in between.
      const double t = static_cast<double>(random.uniform(0, 1));
      const auto point = [&](std::size_t key) {
        const double a = static_cast<double>(random.uniform(0, 1)), b = static_cast<double>(random.uniform(0, 1)),
                     c = static_cast<double>(random.uniform(0, 1));
        DVec4 sum(0);
        for (std::size_t i = 0; i < 8; ++i)
          sum += corners[8 * key + i] * ((i & 1 ? a : 1 - a) * (i & 2 ? b : 1 - b) * (i & 4 ? c : 1 - c));
        return sum;
      };
      const DVec4 at = point(0) * (1 - t) + point(1) * t;
      const double angle = static_cast<double>(random.uniform(0, 6.2831f)),
                   radius = std::sqrt(static_cast<double>(random.uniform(0, 1)));
      const SampledPoint s = see(at, p, radius * std::cos(angle), radius * std::sin(angle));
      if (!s.drawn) continue;
      if (twin == Twin::kLinearScreenMotion) {
        // Bounds at time t that a box with linear motion in screen space would claim.
        const auto key_bounds = [&](std::size_t key) {
          return screen_bounds(std::span(corners).subspan(8 * key, 8), bounded, {});
        };
        const auto open = key_bounds(0), close = key_bounds(1);
        if (!open || !close) continue;
        const auto mix = [&](float a, float b) {
          return static_cast<float>((1 - t) * static_cast<double>(a) + t * static_cast<double>(b));
        };
        bounds = ScreenBounds{mix(open->x0, close->x0),
                              mix(open->y0, close->y0),
                              mix(open->x1, close->x1),
                              mix(open->y1, close->y1),
                              0,
                              mix(open->near_z, close->near_z),
                              mix(open->far_z, close->far_z),
                              false};
      }
      if (!bounds || !inside(*bounds, s)) ++violations;
    }
  }
  return violations;
}

TEST(ScreenBounds, HoldEveryMovingDefocusedPointAlsoAcrossTheCameraPlane) {  // M3
  EXPECT_EQ(screen_violations(11, Twin::kHonest), 0);
}

TEST(ScreenBounds, BoxesThatMoveLinearlyOnScreenAreCaught) {
  EXPECT_GT(screen_violations(11, Twin::kLinearScreenMotion), 0);
}

TEST(ScreenBounds, BoundsThatForgetTheLensAreCaught) { EXPECT_GT(screen_violations(11, Twin::kNoLens), 0); }

TEST(ScreenBounds, BodiesWhollyBehindTheCameraOrBeyondTheFarPlaneAreDropped) {
  scene::Projection p = projection(false, 0, 0);
  MovingCorners corners;
  for (std::size_t i = 0; i < 16; ++i)
    corners[i] = p.matrix() * DVec4((i & 1) ? 1 : -1, (i & 2) ? 1 : -1, 2 + static_cast<double>(i % 8) * 0.1, 1);
  EXPECT_FALSE(screen_bounds(corners, p, {}).has_value());
  for (DVec4& c : corners) c = p.matrix() * DVec4(0, 0, -50, 1);
  EXPECT_TRUE(screen_bounds(corners, p, {}).has_value());
  p.far = 20;
  EXPECT_FALSE(screen_bounds(corners, p, {}).has_value());
}

// A cube of half a unit in camera space, its middle at these depths at the two motion keys.
MovingCorners cube_between(const scene::Projection& p, double depth0, double depth1) {
  MovingCorners corners;
  for (std::size_t k = 0; k < 16; ++k) {
    const DVec3 corner(k & 1 ? 0.5 : -0.5, k & 2 ? 0.5 : -0.5, (k & 4 ? 0.5 : -0.5) - (k < 8 ? depth0 : depth1));
    corners[k] = p.matrix() * DVec4(corner, 1);
  }
  return corners;
}

struct PlaneCase {
  const char* name;
  double depth0, depth1;
  bool drawn, crosses;
};
class CameraPlane : public testing::TestWithParam<PlaneCase> {};

TEST_P(CameraPlane, IsCutWhereTheBoxPassesIt) {
  const auto [name, depth0, depth1, drawn, crosses] = GetParam();
  const scene::Projection p = projection(false, 0.02, 2.0);
  const MovingCorners corners = cube_between(p, depth0, depth1);
  const auto bounds = screen_bounds(corners, p, {});
  ASSERT_EQ(bounds.has_value(), drawn);
  if (!drawn) return;
  EXPECT_EQ(bounds->crosses_near, crosses);
  // Points of corners and edges at many times, where they lie in front of the near plane.
  for (int t = 0; t <= 64; ++t)
    for (std::size_t a = 0; a < 8; ++a)
      for (std::size_t b = 0; b < 8; ++b)
        for (const double s : {0.0, 0.3, 0.9}) {
          const double time = t / 64.0;
          const DVec4 open = corners[a] * (1 - s) + corners[b] * s,
                      close = corners[8 + a] * (1 - s) + corners[8 + b] * s;
          const SampledPoint seen = see(open * (1 - time) + close * time, p, 0.6, -0.8);
          EXPECT_TRUE(!seen.drawn || inside(*bounds, seen)) << "time " << time;
        }
}

std::string plane_name(const testing::TestParamInfo<PlaneCase>& instance) { return instance.param.name; }
INSTANTIATE_TEST_SUITE_P(Box, CameraPlane,
                         testing::Values(PlaneCase{"InFrontAtBothKeys", 3, 4, true, false},
                                         PlaneCase{"CrossingAtOneKey", 0.3, 4, true, true},
                                         PlaneCase{"CrossingAtBothKeys", 0.3, -0.2, true, true},
                                         PlaneCase{"CrossingOnlyBetween", 3, -3, true, true},
                                         PlaneCase{"CameraInside", 0, 0, true, true},
                                         PlaneCase{"BehindAtBothKeys", -2, -5, false, false}),
                         plane_name);

TEST(ScreenBounds, AFocusDistanceInsideTheBoxGrowsByItsFartherEnd) {
  const MovingCorners corners = cube_between(projection(false, 0, 0), 2, 2);
  const scene::Projection pinhole = projection(false, 0.0, 2.0), lens = projection(false, 0.05, 2.0);
  const auto sharp = screen_bounds(corners, pinhole, {}), blurred = screen_bounds(corners, lens, {});
  ASSERT_TRUE(sharp && blurred);
  const double radius = std::max(defocus_radius(lens, 1.5), defocus_radius(lens, 2.5));
  EXPECT_GT(radius, 1.0);
  EXPECT_NEAR(static_cast<double>(sharp->x0 - blurred->x0), radius, 0.01);
  EXPECT_NEAR(static_cast<double>(blurred->y1 - sharp->y1), radius, 0.01);
}

TEST(ScreenBounds, PointsThatAreNotFiniteKeepTheBodyEverywhere) {
  const scene::Projection p = projection(false, 0, 0);
  MovingCorners corners;
  for (DVec4& c : corners) c = p.matrix() * DVec4(0, 0, -5, 1);
  corners[3].x = std::nan("");
  const auto bounds = screen_bounds(corners, p, {});
  ASSERT_TRUE(bounds.has_value());
  EXPECT_LT(bounds->x0, -1e30f);
  EXPECT_GT(bounds->x1, 1e30f);
}

TEST(MinMaxPyramid, TheWholeTextureAndFootprintsAcrossItsEdgesAreHeld) {
  Random random(8);
  for (int trial = 0; trial < 50; ++trial) {
    const shaders::ScalarTexture texture = random_texture(random, random.integer(2, 20), random.integer(2, 20));
    const MinMaxPyramid pyramid(texture);
    const shaders::Sampler sampler = random_sampler(random);
    for (const auto& [low, high] : {std::pair{Vec2(0), Vec2(1)},
                                    {Vec2(0.95f, 0.4f), Vec2(1.05f, 0.45f)},
                                    {Vec2(-0.05f), Vec2(0.05f)},
                                    {Vec2(1.9f), Vec2(2.1f)}}) {
      const ValueRange range = pyramid.query(sampler, low, high, 0.0f);
      for (int k = 0; k < 60; ++k) {
        const float value =
            texture.sample(sampler, {random.uniform(low.x, high.x), random.uniform(low.y, high.y)}, 0.0f);
        EXPECT_TRUE(value >= range.low && value <= range.high);
      }
    }
  }
}

// ---- Coarse depth -----------------------------------------------------------------------------------------------

// CD1: a code's depth is never nearer, or never farther, than the depth, and by less than a 256th of it.
TEST(DepthCode, RoundsAwayFromTheViewerOrTowardsIt) {
  Random random(11);
  for (int trial = 0; trial < 10000; ++trial) {
    const float depth = std::exp2(random.uniform(-100, 100));
    const float far = depth_of(code_not_nearer(depth)), near = depth_of(code_not_farther(depth));
    EXPECT_TRUE(near <= depth && depth <= far && far <= depth * (1 + 0x1p-8f) && near >= depth * (1 - 0x1p-8f))
        << depth;
  }
  const float infinity = std::numeric_limits<float>::infinity();
  EXPECT_EQ(code_not_nearer(infinity), kNothingSeen);
  EXPECT_EQ(code_not_nearer(std::numeric_limits<float>::max()), kNothingSeen);
  EXPECT_EQ(code_not_nearer(std::numeric_limits<float>::quiet_NaN()), kNothingSeen);
  EXPECT_EQ(code_not_farther(std::numeric_limits<float>::quiet_NaN()), 0);
  EXPECT_EQ(code_not_nearer(-1.0f), 0);
  EXPECT_TRUE(std::isinf(depth_of(kNothingSeen)));
}

CoarseDepth depth_of_blocks(int columns, int rows) {
  CoarseDepth depth;
  depth.blocks = {0, 0, columns, rows};
  depth.projection = projection(false, 0.0, 0.0);
  depth.projection.center_x = 4 * columns;
  depth.projection.center_y = 4 * rows;
  depth.farthest.assign(static_cast<std::size_t>(columns * rows), code_not_nearer(2.0f));
  return depth;
}

TEST(CoarseDepth, AnUnchangedViewKeepsAllDepthsExceptBesideFartherBlocks) {
  CoarseDepth depth = depth_of_blocks(8, 6);
  depth.farthest[depth.blocks.index(5, 3)] = kNothingSeen;
  depth.farthest[depth.blocks.index(0, 0)] = code_not_nearer(1.0f);
  const CoarseDepth guess = reproject(depth, depth.projection, depth.view);
  for (int y = 0; y < 6; ++y)
    for (int x = 0; x < 8; ++x) {
      const bool beside = std::abs(x - 5) <= 1 && std::abs(y - 3) <= 1;
      if (beside)
        EXPECT_EQ(guess.at(x, y), kNothingSeen) << x << " " << y;
      else
        EXPECT_NEAR(depth_of(guess.at(x, y)), 2.0f, 0.01f) << x << " " << y;
    }
}

TEST(CoarseDepth, HidesBoundsThatBeginBehindAllBlocksThatTheyTouch) {
  CoarseDepth depth = depth_of_blocks(4, 3);
  depth.farthest[depth.blocks.index(1, 0)] = code_not_nearer(3.0f);
  std::uint64_t tested = 0;
  const auto hides = [&](float x0, float x1, float near_z) {
    return depth.hides(depth.footprint({x0, 1, x1, 5, 0, near_z, 100, false}), tested);
  };
  EXPECT_TRUE(hides(1, 5, 2.5f));
  EXPECT_EQ(tested, 1u);
  EXPECT_FALSE(hides(1, 8, 2.5f)) << "it touches block 1";
  EXPECT_TRUE(hides(1, 8, 3.5f));
  EXPECT_FALSE(hides(1, 5, 1.5f));
  EXPECT_FALSE(hides(1, 5, 2.0f)) << "the same depth";
  EXPECT_FALSE(hides(16, 20, 1.9f)) << "closed: it touches block 1";
  EXPECT_FALSE(hides(100, 120, 9.0f)) << "outside";
  EXPECT_FALSE(hides(1, 5, std::numeric_limits<float>::quiet_NaN()));
}

TEST(OcclusionCandidate, RecordsAreReadAsTheyWereWritten) {
  Random random(12);
  std::vector<OcclusionCandidate> all;
  std::vector<std::uint8_t> bytes;
  for (int trial = 0; trial < 3000; ++trial) {
    OcclusionCandidate d;
    d.kind = random.coin() ? OcclusionCandidate::kGroup : OcclusionCandidate::kInstance;
    d.number = static_cast<std::uint32_t>(random.integer(0, 2147483646)) * 2u;
    d.segment = static_cast<std::uint16_t>(random.integer(0, 2048));
    if (d.kind == OcclusionCandidate::kGroup) d.level = static_cast<std::uint8_t>(random.integer(0, 7));
    const int x = random.integer(0, 2047), y = random.integer(0, 2047);
    d.footprint = {{x, y, x + random.integer(1, 2048), y + random.integer(1, 2048)},
                   static_cast<DepthCode>(random.integer(0, 65535))};
    pack_candidates(d, bytes);
    all.push_back(d);
  }
  EXPECT_EQ(bytes.size(), all.size() * kDeferredBytes);
  EXPECT_EQ(unpack_candidates(bytes), all);
}

// ---- Slopes -----------------------------------------------------------------------------------------------------

// Follows random short segments over a texture; counts segments along which the height changes by more than `share`
// times the slope bound.
int slope_violations(std::uint32_t seed, float share) {
  Random random(seed);
  int violations = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const shaders::ScalarTexture texture = random_texture(random, random.integer(1, 40), random.integer(1, 40));
    const SlopePyramid slopes(texture);
    const shaders::Sampler sampler = random_sampler(random);
    for (int k = 0; k < 20; ++k) {
      const float lod = random.uniform(0, 3), reach = random.uniform(0.001f, 0.3f);
      const Vec2 low(random.uniform(-1.5f, 1.5f), random.uniform(-1.5f, 1.5f)), high = low + Vec2(reach);
      const HeightSlopes slope = slopes.query(sampler, low, high, lod);
      for (int s = 0; s < 10; ++s) {
        const Vec2 a(random.uniform(low.x, high.x), random.uniform(low.y, high.y)),
            b(random.uniform(low.x, high.x), random.uniform(low.y, high.y));
        const float change = texture.sample(sampler, b, lod) - texture.sample(sampler, a, lod);
        const auto [s0, s1] = std::minmax({(b.x - a.x) * slope.along_s.low, (b.x - a.x) * slope.along_s.high});
        const auto [t0, t1] = std::minmax({(b.y - a.y) * slope.along_t.low, (b.y - a.y) * slope.along_t.high});
        if (change > share * (s1 + t1) + 1e-3f || change < share * (s0 + t0) - 1e-3f) ++violations;
      }
    }
  }
  return violations;
}

TEST(SlopePyramid, HoldsEveryChangeOfAFilteredValueAtAnyLevelAndWrap) { EXPECT_EQ(slope_violations(5, 1.0f), 0); }

TEST(SlopePyramid, HalfTheSlopeIsCaught) { EXPECT_GT(slope_violations(5, 0.5f), 0); }

TEST(SlopePyramid, CoarseLevelsHaveTheirOwnSlopes) {
  // Stripes of a texel: steep in level 0, level in the next.
  std::vector<float> stripes;
  for (int i = 0; i < 32 * 32; ++i) stripes.push_back(static_cast<float>(i % 2));
  const SlopePyramid slopes(shaders::ScalarTexture(32, 32, stripes));
  const auto steepest = [&](float lod) { return slopes.query({}, {0.1f, 0.1f}, {0.6f, 0.6f}, lod).along_s.largest(); };
  EXPECT_NEAR(steepest(0), 32.0f, 0.01f);
  EXPECT_NEAR(steepest(0.75f), 8.0f, 0.01f);
  EXPECT_NEAR(steepest(1), 0.0f, 0.01f);
  const ValueRange rising =
      SlopePyramid(shaders::ScalarTexture(4, 1, {0, 1, 2, 3})).query({}, {0.2f, 0}, {0.6f, 1}, 0).along_s;
  EXPECT_NEAR(rising.low, 4.0f, 0.01f) << "slopes have signs";
}

// ---- Differences of levels --------------------------------------------------------------------------------------

int level_violations(std::uint32_t seed, float share) {
  Random random(seed);
  int violations = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const bool whole = random.coin();
    const shaders::ScalarTexture texture =
        whole ? random_texture(random, 1 << random.integer(0, 5), 1 << random.integer(0, 5))
              : random_texture(random, random.integer(1, 40), random.integer(1, 40));
    const LevelDifferences differences(texture);
    const shaders::Sampler sampler = random_sampler(random);
    for (int k = 0; k < 20; ++k) {
      const float lod = random.uniform(-1, 6), other = random.uniform(-1, 6), reach = random.uniform(0, 0.3f);
      const Vec2 low(random.uniform(-1.5f, 1.5f), random.uniform(-1.5f, 1.5f)), high = low + Vec2(reach);
      const float most = differences.query(sampler, low, high, lod, other) * share;
      for (int s = 0; s < 10; ++s) {
        const Vec2 at(random.uniform(low.x, high.x), random.uniform(low.y, high.y));
        if (std::abs(texture.sample(sampler, at, lod) - texture.sample(sampler, at, other)) > most + 1e-4f)
          ++violations;
      }
    }
  }
  return violations;
}

TEST(LevelDifferences, BoundTheDifferenceOfTwoLevelsOfDetailAtAnyWrap) { EXPECT_EQ(level_violations(6, 1.0f), 0); }

TEST(LevelDifferences, HalfTheDifferenceIsCaught) { EXPECT_GT(level_violations(6, 0.5f), 0); }

// ---- Window tables ----------------------------------------------------------------------------------------------

// WT1, WT2 and WT3 against every texel, on random grids and rectangles.
TEST(WindowTable, HoldsARectangleAndLittleElse) {
  Random random(21);
  for (int trial = 0; trial < 200; ++trial) {
    const int width = random.integer(1, 70), height = random.integer(1, 70);
    std::vector<float> values(static_cast<std::size_t>(width * height));
    for (float& v : values) v = random.uniform(-1, 1);
    const auto value = [&](int x, int y) { return values[static_cast<std::size_t>(y * width + x)]; };
    const WindowTable table(width, height, [&](int x, int y) { return ValueRange{value(x, y), value(x, y)}; });
    EXPECT_LE(table.entry_count(), 3 * values.size());
    const auto range = [&](int x0, int y0, int x1, int y1) {
      ValueRange all{1e30f, -1e30f};
      for (int y = std::max(y0, 0); y <= std::min(y1, height - 1); ++y)
        for (int x = std::max(x0, 0); x <= std::min(x1, width - 1); ++x) all = all.hull({value(x, y), value(x, y)});
      return all;
    };
    for (int k = 0; k < 50; ++k) {
      const int x0 = random.integer(0, width - 1), y0 = random.integer(0, height - 1),
                x1 = random.integer(x0, width - 1), y1 = random.integer(y0, height - 1);
      const int shorter = std::min(x1 - x0, y1 - y0) + 1, longer = std::max(x1 - x0, y1 - y0) + 1;
      const ValueRange got = table.over(x0, y0, x1, y1, nullptr), exact = range(x0, y0, x1, y1);
      EXPECT_TRUE(got.low <= exact.low && got.high >= exact.high);
      if (shorter < 2 || longer > 4 * shorter / 2) continue;
      const int more = std::max(shorter / WindowTable::kWindowsPerSide - 1, 0);
      const ValueRange most = range(x0 - more, y0 - more, x1 + more, y1 + more);
      EXPECT_TRUE(got.low >= most.low && got.high <= most.high)
          << width << "x" << height << ": " << x0 << ".." << x1 << ", " << y0 << ".." << y1;
    }
  }
}

TEST(WindowTable, CountsTheLinesThatItFetches) {
  WindowTable table(64, 64, [](int x, int y) { return ValueRange{static_cast<float>(x), static_cast<float>(y)}; });
  table.place(4096);
  HeightTableCache none({0, 1, 64, 0}), cached({4096, 4, 64, 0});
  // 16 x 16 texels are one window; 20 x 20 are four of those, in four lines.
  (void)table.over(8, 8, 23, 23, &none);
  EXPECT_EQ(none.take_table_bytes(), 64u);
  for (HeightTableCache* fetches : {&none, &cached}) {
    (void)table.over(8, 8, 27, 27, fetches);
    (void)table.over(8, 8, 27, 27, fetches);
  }
  EXPECT_EQ(none.take_table_bytes(), 2 * 4 * 64u);
  EXPECT_EQ(cached.take_table_bytes() % 64, 0u);
  (void)table.over(8, 8, 27, 27, &cached);
  EXPECT_EQ(cached.take_table_bytes(), 0u);
}

}  // namespace
}  // namespace tessera::frontend::bounds_test

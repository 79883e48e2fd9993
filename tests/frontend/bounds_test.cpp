// Invariant 3 for the OBB method: no point of a displaced, moving, defocused sub-patch lies outside its bound.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "frontend/bounds/minmax_pyramid.h"
#include "frontend/bounds/oriented_box.h"
#include "frontend/bounds/screen_bounds.h"
#include "frontend/front_end.h"
#include "frontend/patch_displacement.h"
#include "shaders_cpp/bicubic.h"
#include "tests/support/captures.h"

namespace tessera::frontend {
namespace {

using test::Random;

// ---- Min-max pyramid --------------------------------------------------------------------------------------------

shaders::ScalarTexture random_texture(Random& random, int width, int height) {
  std::vector<float> values(static_cast<std::size_t>(width * height));
  // Noise, or a ramp, whose coarse levels differ from what lies nearby.
  const bool ramp = random.coin();
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = ramp ? static_cast<float>(i) * 0.01f : random.uniform(-1, 1);
  return {width, height, values};
}

shaders::Sampler random_sampler(Random& random) {
  constexpr shaders::Wrap kWraps[] = {shaders::Wrap::kRepeat, shaders::Wrap::kMirroredRepeat, shaders::Wrap::kClampToEdge};
  shaders::Sampler sampler;
  sampler.wrap_s = kWraps[random.integer(0, 2)];
  sampler.wrap_t = kWraps[random.integer(0, 2)];
  return sampler;
}

// Samples of random boxes that fall outside what a query with `claimed_lod` says, when sampled at up to `lod`.
int pyramid_violations(std::uint32_t seed, bool honest) {
  Random random(seed);
  int violations = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const shaders::ScalarTexture texture = random_texture(random, random.integer(1, 33), random.integer(1, 33));
    const MinMaxPyramid pyramid(texture);
    const shaders::Sampler sampler = random_sampler(random);
    const float lod = random.coin() ? 0.0f : random.uniform(0, 6);
    const float size = random.coin() ? random.uniform(0, 0.1f) : random.uniform(0, 3);
    const Vec2 low(random.uniform(-3, 3), random.uniform(-3, 3)), high = low + Vec2(random.uniform(0, size), random.uniform(0, size));
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
  EXPECT_GT(range.low, 24.0f);   // the point is at 32; four texels of footprint, up to two entries of a level
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

Projection projection(bool orthographic, double lens, double focus) {
  Projection p;
  p.orthographic = orthographic;
  p.center_x = 320;
  p.center_y = 240;
  p.scale = orthographic ? 60 : 500;
  p.near = 0.1;
  p.lens_scale = p.scale * lens;
  p.inverse_focus = focus > 0 ? 1 / focus : 0;
  return p;
}

struct SampledPoint {
  double x, y, z;
  bool drawn;
};
// Where a raster-space point is seen through lens point (lu, lv) of the unit disc.
SampledPoint see(const DVec4& r, const Projection& p, double lu, double lv) {
  const double coc = p.orthographic ? 1 - r.z * p.inverse_focus : 1 / r.w - p.inverse_focus;
  return {r.x / r.w - p.lens_scale * lu * coc, r.y / r.w - p.lens_scale * lv * coc, r.z, r.z >= p.near && (p.far == 0 || r.z <= p.far)};
}

bool inside(const ScreenBounds& b, const SampledPoint& s) {
  return s.x >= static_cast<double>(b.x0) && s.x <= static_cast<double>(b.x1) && s.y >= static_cast<double>(b.y0) && s.y <= static_cast<double>(b.y1) &&
         s.z >= static_cast<double>(b.near_z) && s.z <= static_cast<double>(b.far_z);
}

enum class Twin { kHonest, kLinearScreenMotion, kNoLens };

// Random boxes in camera space at two keys, many behind or across the camera plane; counts points outside the bound.
int screen_violations(std::uint32_t seed, Twin twin) {
  Random random(seed);
  int violations = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    const Projection p = projection(random.integer(0, 3) == 0, random.coin() ? 0.0 : 0.05, 2.0);
    MovingCorners corners;
    for (std::size_t key = 0; key < 2; ++key) {
      const DVec3 center(static_cast<double>(random.uniform(-2, 2)), static_cast<double>(random.uniform(-2, 2)), static_cast<double>(random.uniform(-4, 1)));
      const double half = static_cast<double>(random.uniform(0.01f, 1));
      for (std::size_t i = 0; i < 8; ++i)
        corners[8 * key + i] = p.matrix() * DVec4(center + half * DVec3((i & 1) ? 1 : -1, (i & 2) ? 1 : -1, (i & 4) ? 1 : -1), 1);
    }
    Projection bounded = p;
    if (twin == Twin::kNoLens) bounded.lens_scale = 0;
    auto bounds = screen_bounds(corners, bounded, {});
    for (int k = 0; k < 25; ++k) {
      // A point of the box at each key, linearly in between.
      const double t = static_cast<double>(random.uniform(0, 1));
      const auto point = [&](std::size_t key) {
        const double a = static_cast<double>(random.uniform(0, 1)), b = static_cast<double>(random.uniform(0, 1)), c = static_cast<double>(random.uniform(0, 1));
        DVec4 sum(0);
        for (std::size_t i = 0; i < 8; ++i) sum += corners[8 * key + i] * ((i & 1 ? a : 1 - a) * (i & 2 ? b : 1 - b) * (i & 4 ? c : 1 - c));
        return sum;
      };
      const DVec4 at = point(0) * (1 - t) + point(1) * t;
      const double angle = static_cast<double>(random.uniform(0, 6.2831f)), radius = std::sqrt(static_cast<double>(random.uniform(0, 1)));
      const SampledPoint s = see(at, p, radius * std::cos(angle), radius * std::sin(angle));
      if (!s.drawn) continue;
      if (twin == Twin::kLinearScreenMotion) {
        // What a box that is linear in screen space would claim at time t.
        const auto key_bounds = [&](std::size_t key) { return screen_bounds(std::span(corners).subspan(8 * key, 8), bounded, {}); };
        const auto open = key_bounds(0), close = key_bounds(1);
        if (!open || !close) continue;
        const auto mix = [&](float a, float b) { return static_cast<float>((1 - t) * static_cast<double>(a) + t * static_cast<double>(b)); };
        bounds = ScreenBounds{mix(open->x0, close->x0), mix(open->y0, close->y0), mix(open->x1, close->x1), mix(open->y1, close->y1), 0,
                              mix(open->near_z, close->near_z), mix(open->far_z, close->far_z), false};
      }
      if (!bounds || !inside(*bounds, s)) ++violations;
    }
  }
  return violations;
}

TEST(ScreenBounds, HoldEveryMovingDefocusedPointAlsoAcrossTheCameraPlane) { EXPECT_EQ(screen_violations(11, Twin::kHonest), 0); }

TEST(ScreenBounds, BoxesThatMoveLinearlyOnScreenAreCaught) { EXPECT_GT(screen_violations(11, Twin::kLinearScreenMotion), 0); }

TEST(ScreenBounds, BoundsThatForgetTheLensAreCaught) { EXPECT_GT(screen_violations(11, Twin::kNoLens), 0); }

TEST(ScreenBounds, BodiesWhollyBehindTheCameraOrBeyondTheFarPlaneAreDropped) {
  Projection p = projection(false, 0, 0);
  MovingCorners corners;
  for (std::size_t i = 0; i < 16; ++i) corners[i] = p.matrix() * DVec4((i & 1) ? 1 : -1, (i & 2) ? 1 : -1, 2 + static_cast<double>(i % 8) * 0.1, 1);
  EXPECT_FALSE(screen_bounds(corners, p, {}).has_value());
  for (DVec4& c : corners) c = p.matrix() * DVec4(0, 0, -50, 1);
  EXPECT_TRUE(screen_bounds(corners, p, {}).has_value());
  p.far = 20;
  EXPECT_FALSE(screen_bounds(corners, p, {}).has_value());
}

TEST(ScreenBounds, PointsThatAreNotFiniteKeepTheBodyEverywhere) {
  const Projection p = projection(false, 0, 0);
  MovingCorners corners;
  for (DVec4& c : corners) c = p.matrix() * DVec4(0, 0, -5, 1);
  corners[3].x = std::nan("");
  const auto bounds = screen_bounds(corners, p, {});
  ASSERT_TRUE(bounds.has_value());
  EXPECT_LT(bounds->x0, -1e30f);
  EXPECT_GT(bounds->x1, 1e30f);
}

// ---- Whole sub-patches ------------------------------------------------------------------------------------------

enum class Hard { kRandom, kPole, kPoint, kFolded, kHuge, kTiny, kFarAway, kFlatTexture, kCrossing, kInside, kBigDisplacement, kNoMotion, kWholeScreenMotion, kCount };

std::vector<Vec3> hard_net(Hard kind, Random& random) {
  std::vector<Vec3> c = test::flat_patch({-1, -1, 0}, {2, 0, 0}, {0, 2, 0});
  for (Vec3& p : c) p += random.in_box(0.4f);
  switch (kind) {
    case Hard::kPole:
      for (std::size_t i = 12; i < 16; ++i) c[i] = c[12];
      break;
    case Hard::kPoint: std::fill(c.begin(), c.end(), c[0]); break;
    case Hard::kFolded: std::swap(c[5], c[10]); break;
    case Hard::kHuge:
      for (Vec3& p : c) p *= 1e6f;
      break;
    case Hard::kTiny:
      for (Vec3& p : c) p *= 1e-6f;
      break;
    case Hard::kFarAway:
      for (Vec3& p : c) p = p * 1e-2f + Vec3(1e4f, -2e4f, 5e3f);
      break;
    default: break;
  }
  return c;
}

// A capture of two neighbouring patches of a kind, displaced, moving and seen through a lens.
struct Scene {
  Capture capture;
  Assembly assembly;
  std::unique_ptr<PyramidLibrary> pyramids;
  std::unique_ptr<FrameGeometry> frame;

  Scene(Hard kind, Random& random) {
    Material material;
    material.double_sided = true;
    const float scale = kind == Hard::kHuge ? 1e6f : kind == Hard::kTiny ? 1e-6f : kind == Hard::kFarAway ? 1e-2f : 1.0f;
    std::vector<float> heights(64);
    for (float& h : heights) h = kind == Hard::kFlatTexture ? 0.5f : random.uniform(-1, 1);
    const float strength = kind == Hard::kBigDisplacement ? -5.0f : random.uniform(-0.5f, 0.5f);
    material.displacement = test::displacement(8, 8, heights, strength * scale, 0.1f * scale);
    std::vector<Vec3> points = hard_net(kind, random);
    // The neighbour shares the edge u = 1.
    std::vector<Vec3> second = hard_net(kind, random);
    for (std::size_t j = 0; j < 4; ++j) second[4 * j] = points[4 * j + 3];
    points.insert(points.end(), second.begin(), second.end());
    Primitive primitive = test::patches(points, test::add_material(capture, material));
    MorphTarget target;  // deforms as well as moves
    for (std::size_t i = 0; i < points.size(); ++i) target.positions.push_back(random.in_box(0.2f * scale));
    for (std::size_t j = 0; j < 4; ++j) target.positions[16 + 4 * j] = target.positions[4 * j + 3];
    primitive.vertices.morph_targets.push_back(target);
    const int node = test::add_node(capture, primitive);
    if (kind != Hard::kNoMotion) {
      const double reach = kind == Hard::kWholeScreenMotion ? 40.0 : 1.5;
      test::add_motion(capture, node, DVec3(random.in_box(1)) * reach * static_cast<double>(scale));
      AnimationChannel weights{node, AnimatedPath::kWeights, Interpolation::kLinear, 1, {0, 1}, {0, 1}};
      capture.animations[0].channels.push_back(weights);
    }
    Camera camera;
    camera.near = 0.05f * scale;
    camera.lens = {0.03f * scale, 3.0f * scale};
    const Vec3 middle = points[5];
    const double distance = kind == Hard::kInside ? 0.1 : kind == Hard::kCrossing ? 0.5 : 4.0;
    test::add_camera(capture, DVec3(middle) + DVec3(0.1, 0.2, distance) * static_cast<double>(scale), camera);
    assembly = assemble(capture);
    pyramids = std::make_unique<PyramidLibrary>(assembly);
    FrameRequest request;
    request.width = 320;
    request.height = 240;
    request.open_time = 0.25;
    request.close_time = 0.75;
    frame = pose_frame(assembly, choose_camera(capture, 0, 320, 240), request);
  }
};

// d(u,v) of a patch in double precision, in raster space at a key. Heights are read as the machine reads them.
DVec4 displaced_point(const FrameGeometry& frame, std::uint32_t patch, float u, float v, std::size_t key) {
  const PosedDrawable& drawable = frame.drawable_of(patch);
  shaders::ControlPoints<double> c;
  const auto points = frame.control_points(drawable, patch, static_cast<int>(key));
  for (std::size_t i = 0; i < 16; ++i) c[i] = {static_cast<double>(points[i].x), static_cast<double>(points[i].y), static_cast<double>(points[i].z)};
  const double du = static_cast<double>(u), dv = static_cast<double>(v);
  const auto p = shaders::bicubic_point<double>(shaders::bicubic_row(c, dv), du);
  const auto n = shaders::bicubic_normal(c, du, dv, p);
  const auto d = p.position + n * static_cast<double>(patch_displacement(frame, drawable, patch).offset(u, v));
  return DMat4(drawable.to_raster[key]) * DVec4(d.x, d.y, d.z, 1);
}

struct Outcome {
  int points = 0, violations = 0;
};

Outcome check_scene(const Scene& scene, Random& random, bool forget_displacement) {
  Outcome outcome;
  const FrameGeometry& frame = *scene.frame;
  for (std::uint32_t patch = 0; patch < frame.assembly->patch_count(); ++patch)
    for (const CellRange& cells : cut_patch(frame, patch, 16)) {
      SubPatchBody body = sub_patch_body(frame, *scene.pyramids, patch, cells);
      if (forget_displacement) {
        std::array<ControlNet, 2> nets;
        for (std::size_t key = 0; key < 2; ++key) {
          const auto points = frame.control_points(frame.drawable_of(patch), patch, static_cast<int>(key));
          for (std::size_t i = 0; i < 16; ++i) nets[key][i] = DVec3(points[i]);
          nets[key] = sub_net(nets[key], parameter_range(frame.patterns[patch], cells));
        }
        body.corners = box_corners(bezier_box(nets, {0, 0}), frame.drawable_of(patch).to_raster);
      }
      const auto bounds = screen_bounds(body.corners, frame.projection, body.margin);
      const ParameterRange range = parameter_range(frame.patterns[patch], cells);
      for (int k = 0; k < 40; ++k) {
        const float u = k < 4 ? (k & 1 ? range.u1 : range.u0) : random.uniform(range.u0, range.u1);
        const float v = k < 4 ? (k & 2 ? range.v1 : range.v0) : random.uniform(range.v0, range.v1);
        const DVec4 open = displaced_point(frame, patch, u, v, 0), close = displaced_point(frame, patch, u, v, 1);
        for (int s = 0; s < 6; ++s) {
          const double t = s < 2 ? s : static_cast<double>(random.uniform(0, 1));
          const double angle = static_cast<double>(random.uniform(0, 6.2831f)), radius = std::sqrt(static_cast<double>(random.uniform(0, 1)));
          const SampledPoint seen = see(open * (1 - t) + close * t, frame.projection, radius * std::cos(angle), radius * std::sin(angle));
          if (!seen.drawn) continue;
          ++outcome.points;
          if (!bounds || !inside(*bounds, seen)) ++outcome.violations;
        }
      }
    }
  return outcome;
}

class SubPatchBounds : public testing::TestWithParam<int> {};

TEST_P(SubPatchBounds, HoldEveryPointOfTheDisplacedMovingDefocusedPatch) {
  const auto kind = static_cast<Hard>(GetParam());
  Random random(100 + static_cast<std::uint32_t>(GetParam()));
  Outcome total;
  for (int trial = 0; trial < 25; ++trial) {
    const Scene scene(kind, random);
    const Outcome outcome = check_scene(scene, random, false);
    total.points += outcome.points;
    total.violations += outcome.violations;
  }
  EXPECT_EQ(total.violations, 0);
  EXPECT_GT(total.points, 1000) << "the case shows nothing";
}

std::string hard_name(const testing::TestParamInfo<int>& info) {
  static constexpr const char* kNames[] = {"Random",     "Pole",        "AllPointsEqual",    "Folded",           "HugeCoordinates",
                                           "TinyCoordinates", "FarFromTheOrigin", "FlatTexture", "CrossingTheCameraPlane", "CameraInside",
                                           "DisplacementLargerThanThePatch", "NoMotion", "MotionLargerThanTheScreen"};
  return kNames[info.param];
}
INSTANTIATE_TEST_SUITE_P(HardCase, SubPatchBounds, testing::Range(0, static_cast<int>(Hard::kCount)), hard_name);

TEST(SubPatchBoundsTwin, ABoundThatForgetsDisplacementIsCaught) {
  Random random(7);
  int violations = 0;
  for (int trial = 0; trial < 10; ++trial) violations += check_scene(Scene(Hard::kBigDisplacement, random), random, true).violations;
  EXPECT_GT(violations, 0);
}

TEST(OrientedBox, SubNetsReproduceTheSurface) {
  Random random(9);
  for (int trial = 0; trial < 200; ++trial) {
    ControlNet net;
    for (DVec3& p : net) p = DVec3(random.in_box(1));
    const ParameterRange range{random.uniform(0, 0.5f), random.uniform(0, 0.5f), random.uniform(0.5f, 1), random.uniform(0.5f, 1)};
    const ControlNet part = sub_net(net, range);
    const auto at = [](const ControlNet& n, double u, double v) {
      shaders::ControlPoints<double> c;
      for (std::size_t i = 0; i < 16; ++i) c[i] = {n[i].x, n[i].y, n[i].z};
      const auto p = shaders::bicubic_point<double>(shaders::bicubic_row(c, v), u).position;
      return DVec3(p.x, p.y, p.z);
    };
    const double s = 0.37, t = 0.81;
    const DVec3 a = at(part, s, t);
    const DVec3 b = at(net, static_cast<double>(range.u0) * (1 - s) + static_cast<double>(range.u1) * s, static_cast<double>(range.v0) * (1 - t) + static_cast<double>(range.v1) * t);
    EXPECT_LT(glm::length(a - b), 1e-12);
  }
}

TEST(OrientedBox, FitsARotatedFlatPatchMuchTighterThanTheWorldAxes) {
  // A thin strip along the diagonal: its own frame is thin, the world's box is not.
  std::array<ControlNet, 2> nets;
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < 4; ++i) {
      const DVec3 p = DVec3(1, 1, 0) * (i / 3.0) + DVec3(-1, 1, 0) * (0.02 * j);
      nets[0][static_cast<std::size_t>(4 * j + i)] = nets[1][static_cast<std::size_t>(4 * j + i)] = p;
    }
  const MovingBox box = bezier_box(nets, {0, 0});
  double area = 1;
  for (std::size_t axis = 0; axis < 2; ++axis) area *= box.high[0][axis] - box.low[0][axis];
  EXPECT_LT(area, 0.2 * 1.06 * 1.06);
}

}  // namespace
}  // namespace tessera::frontend

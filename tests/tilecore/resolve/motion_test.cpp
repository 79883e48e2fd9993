// Where points were a frame ago, against the definition: the point's vertices posed then, projected.
#include "base/simd_targets.h"
#include "tests/support/tests.h"
#include "tests/tilecore/support.h"
#include "tilecore/resolve/motion_field.h"
#include "tilecore/resolve/velocity_buffer.h"

namespace tessera::tilecore::motion_test {
namespace {

std::unique_ptr<scene::FrameGeometry> pose(const TestFrame& scene, double open, double close,
                                           bool orthographic = false) {
  scene::FrameRequest request;
  request.width = 96;
  request.height = 64;
  request.open_time = open;
  request.close_time = close;
  scene::CameraChoice camera = scene::choose_camera(*scene.capture, 96, 64);
  if (orthographic) {
    camera.camera.type = scene::Camera::Type::kOrthographic;
    camera.camera.x_mag = 3, camera.camera.y_mag = 2;
  }
  return scene::pose_frame(*scene.assembly, camera, request);
}

// Triangles and patches before a camera, moved by `way` in a second; the camera by `camera_way`.
TestFrame scene(const DVec3& way, const DVec3& camera_way) {
  TestFrame s;
  const int patches =
      test::add_node(*s.capture, test::patches(test::flat_patch({-1, -1, 0}, {2, 0, 0.5f}, {0, 2, -0.3f})));
  const int mesh = test::add_node(*s.capture, test::triangles({{-1, -1, -1}, {1, -1, -1.5f}, {0, 1, -2}}, {0, 1, 2}));
  test::add_camera(*s.capture, {0, 0, 6});
  if (way != DVec3(0.0)) test::add_motion(*s.capture, patches, way), test::add_motion(*s.capture, mesh, way);
  if (camera_way != DVec3(0.0)) test::add_motion(*s.capture, 2, camera_way);
  s.pose();
  return s;
}

TEST(MotionField, RigidMotionFollowsTheVerticesOfBothPoses) {
  for (const bool orthographic : {false, true})
    for (const auto& [way, camera_way] :
         {std::pair{DVec3(0.3, -0.2, 0.4), DVec3(0.0)}, std::pair{DVec3(0.0), DVec3(0.2, 0.1, -0.5)},
          std::pair{DVec3(1, 0, 0), DVec3(-0.4, 0.3, 0.2)}}) {
      const TestFrame s = scene(way, camera_way);
      const auto then = pose(s, 0.2, 0.25, orthographic), now = pose(s, 0.5, 0.55, orthographic);
      const MotionField field(*now, *then);
      test::Random random(3);
      for (int i = 0; i < 200; ++i) {
        const std::uint32_t patch = i % 2 == 0 ? 0u : s.assembly->drawables[1].first_patch,
                            d = s.assembly->patch_drawable[patch];
        ASSERT_EQ(field.kind(d), MotionField::Kind::kRigid);
        const float b1 = random.uniform(0.05f, 0.45f), b2 = random.uniform(0.05f, 0.45f);
        const SurfaceLocation at{patch, i % 2 == 0 ? SurfaceLocation::kWholePatch : 0u, b1, b2, 0};
        const Vec2 parameters(b1, b2);
        const Vec4 here = surface_raster(*now, at, parameters, 0), there = surface_raster(*then, at, parameters, 0);
        const Vec2 rest = Vec2(here.x, here.y) / here.w, expected = rest - Vec2(there.x, there.y) / there.w;
        const MotionField::Step step = field.step(d, rest, here.z, at);
        ASSERT_TRUE(step.usable);
        EXPECT_NEAR(step.velocity.x, expected.x, 2e-4);
        EXPECT_NEAR(step.velocity.y, expected.y, 2e-4);
        EXPECT_NEAR(step.depth, there.z, 1e-5 * 10);
        EXPECT_GT(glm::length(expected), 0.1f);
      }
    }
}

TEST(MotionField, PointsOfABlockAtOnceHaveTheBitsOfEach) {
  test::Random random(5);
  for (const bool orthographic : {false, true}) {
    const TestFrame s = scene(DVec3(0.3, -0.2, 0.4), DVec3(0.2, 0.1, -4));
    const auto then = pose(s, 0.2, 0.25, orthographic), now = pose(s, 0.5, 0.55, orthographic);
    const MotionField field(*now, *then);
    ASSERT_EQ(field.kind(0), MotionField::Kind::kRigid);
    const std::vector<std::string> targets = simd_target_names();
    int unusable = 0;
    for (int n = 0; n < 300; ++n) {
      MotionField::RigidPoints points;
      for (std::size_t i = 0; i < points.kCount; ++i) {
        points.x[i] = random.uniform(-20, 120), points.y[i] = random.uniform(-20, 90);
        points.depth[i] = random.uniform(-3, 12);
      }
      if (n % 7 == 0)
        points.depth[static_cast<std::size_t>(n % 16)] = n % 2 ? std::numeric_limits<float>::infinity() : 0.0f;
      MotionField::RigidSteps all;
      force_simd_target(targets[static_cast<std::size_t>(n) % targets.size()]);
      field.rigid_steps(0, points, all);
      for (std::size_t i = 0; i < points.kCount; ++i) {
        const MotionField::Step one = field.rigid_step(0, {points.x[i], points.y[i]}, points.depth[i]);
        const float speed = std::sqrt(one.velocity.x * one.velocity.x + one.velocity.y * one.velocity.y);
        ASSERT_EQ((all.usable >> i & 1) != 0, one.usable);
        ASSERT_EQ(std::bit_cast<std::uint32_t>(all.x[i]), std::bit_cast<std::uint32_t>(one.velocity.x));
        ASSERT_EQ(std::bit_cast<std::uint32_t>(all.y[i]), std::bit_cast<std::uint32_t>(one.velocity.y));
        ASSERT_EQ(std::bit_cast<std::uint32_t>(all.depth[i]), std::bit_cast<std::uint32_t>(one.depth));
        ASSERT_EQ(std::bit_cast<std::uint32_t>(all.speed[i]), std::bit_cast<std::uint32_t>(speed));
        unusable += !one.usable;
      }
    }
    EXPECT_GT(unusable, 0);
  }
  force_simd_target("");
}

TEST(MotionField, AStillPointHasExactlyZeroMotion) {  // MF1
  const TestFrame s = scene(DVec3(0.0), DVec3(0.0));
  const auto then = pose(s, 0.2, 0.25), now = pose(s, 0.5, 0.55);
  const MotionField field(*now, *then);
  EXPECT_TRUE(field.all_still());
  const MotionField::Step step = field.step(0, {10.25f, 3.5f}, 6.0f, {0, 0, 0.2f, 0.2f, 0});
  EXPECT_TRUE(step.usable);
  EXPECT_EQ(step.velocity, Vec2(0.0f));
  // The failing twin: one that moves during the shutters alone is not still, though it is in the same place at each
  // opening.
  const TestFrame moving = scene(DVec3(1, 0, 0), DVec3(0.0));
  EXPECT_FALSE(MotionField(*pose(moving, 0.5, 0.75), *pose(moving, 0.5, 0.75)).all_still());
}

TEST(MotionField, DeformingMeshesAreEvaluatedAtBothPoses) {
  TestFrame s;
  scene::Primitive triangle = test::triangles({{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}}, {0, 1, 2});
  triangle.vertices.morph_targets.emplace_back();
  triangle.vertices.morph_targets[0].positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0.5f}};
  test::add_node(*s.capture, triangle);
  test::add_camera(*s.capture, {0, 0, 6});
  test::add_morph(*s.capture, 0);
  s.pose();
  const auto then = pose(s, 0.25, 0.25), now = pose(s, 0.75, 0.75);
  const MotionField field(*now, *then);
  ASSERT_EQ(field.kind(0), MotionField::Kind::kDeforming);
  const SurfaceLocation at{0, 0, 1.0f, 0.0f, 0};  // the second corner: x = 1 + weight
  const Vec4 here = surface_raster(*now, at, {1, 0}, 0);
  const MotionField::Step step = field.step(0, Vec2(here.x, here.y) / here.w, here.z, at);
  ASSERT_TRUE(step.usable);
  EXPECT_NEAR(step.velocity.x, static_cast<float>(now->projection.scale) * 0.5f / 6.0f, 1e-3);
  EXPECT_NEAR(step.velocity.y, 0, 1e-4);
}

// Patches that a morph target bends, seen by the pixels of a tile through random places.
struct BentTile : TestFrame {
  explicit BentTile(bool displaced) {
    scene::Material material;
    if (displaced) material.displacement = test::displacement(4, 4, std::vector<float>(16, 0.5f), 0.2f, 0);
    scene::Primitive patches = test::closed_patches(test::add_material(*capture, material));
    Random random(9);
    patches.vertices.texcoords.emplace_back(patches.vertices.count(), Vec2(0.5f));
    patches.vertices.morph_targets.emplace_back();
    for (std::size_t k = 0; k < patches.vertices.count(); ++k)
      patches.vertices.morph_targets[0].positions.push_back(0.3f * random.in_box(1));
    test::add_node(*capture, patches);
    test::add_camera(*capture, {0, 0, 4});
    test::add_morph(*capture, 0);
    assembly = std::make_unique<scene::Assembly>(scene::assemble(*capture));

    surfaces.pixels = samples.pixels = {0, 0, 32, 16};
    surfaces.spp = samples.spp = 1;
    const std::size_t count = samples.count = 32 * 16;
    state.start(count, 32, 1);
    samples.x.assign(count, 0), samples.y.assign(count, 0);
    surfaces.depth.assign(count, 4), surfaces.surface.assign(count, 1);
    surfaces.still.assign(count, 0), surfaces.layered.assign(count, 0);
    const auto frame_then = at(0);
    for (std::size_t i = 0; i < count; ++i) {
      const auto patch = static_cast<std::uint32_t>(random.integer(0, 2));
      const scene::TessellationPattern& pattern = frame_then->pattern_of(patch);
      surfaces.patch.push_back(patch);
      state.triangle[i] = static_cast<std::uint32_t>(random.integer(0, 2 * pattern.nu * pattern.nv - 1));
      const std::array<Vec2, 4> places{Vec2(0, 0), Vec2(1, 0), Vec2(0, 1), Vec2(0.25f, 0.625f)};
      state.b1[i] = places[i % 4].x, state.b2[i] = places[i % 4].y;
    }
  }
  std::unique_ptr<scene::FrameGeometry> at(double time, bool interpolated = true) const {
    scene::FrameRequest request;
    request.width = 96, request.height = 64;
    request.open_time = request.close_time = time;
    request.interpolated_surfaces = interpolated;
    return scene::pose_frame(*assembly, scene::choose_camera(*capture, 96, 64), request);
  }
  // Work for the blocks of the tile; the velocities are in `buffer`.
  VelocityBuffer::Work evaluate(VelocityBuffer& buffer, bool counted) const {
    for (int y = 0; y < 16; y += 4)
      for (int x = 0; x < 32; x += 4) buffer.evaluate({x, y, x + 4, y + 4}, BlockSpeed::kMean, counted);
    return buffer.take_work();
  }

  TileSamples samples;
  TileState state;
  PixelSurfaces surfaces;
};

TEST(MotionField, MF4PointsOfDeformingGridsMoveAsTheirTrianglesVertices) {
  for (const bool displaced : {false, true}) {
    const BentTile tile(displaced);
    const auto now = tile.at(0.75), then = tile.at(0.25), whole_now = tile.at(0.75, false);
    const MotionField field(*now, *then), whole(*whole_now, *then);
    ASSERT_EQ(field.kind(0), MotionField::Kind::kDeforming);
    VelocityBuffer buffer, of_patches;
    buffer.start(*now, tile.samples, tile.state, tile.surfaces, &field);
    of_patches.start(*whole_now, tile.samples, tile.state, tile.surfaces, &whole);
    const VelocityBuffer::Work work = tile.evaluate(buffer, true), every = tile.evaluate(of_patches, true);

    std::set<std::array<std::uint32_t, 3>> vertices;
    float moved = 0, bent = 0;
    for (std::size_t i = 0; i < tile.samples.count; ++i) {
      const std::uint32_t patch = tile.surfaces.patch[i];
      const scene::TessellationPattern& pattern = now->pattern_of(patch);
      const double b1 = static_cast<double>(tile.state.b1[i]), b2 = static_cast<double>(tile.state.b2[i]);
      const std::array<double, 3> weight{1 - b1 - b2, b1, b2};
      DVec4 here(0), there(0);
      for (std::size_t k = 0; k < 3; ++k) {
        const auto [ci, cj] = scene::grid_corner(pattern, tile.state.triangle[i], k);
        vertices.insert({patch, static_cast<std::uint32_t>(ci), static_cast<std::uint32_t>(cj)});
        const SurfaceLocation vertex{patch, SurfaceLocation::kWholePatch, 0, 0, 0};
        const Vec2 at(pattern.u(ci, cj), pattern.v(ci, cj));
        here += DVec4(surface_raster(*now, vertex, at, 0)) * weight[k];
        there += DVec4(surface_raster(*then, vertex, at, 0)) * weight[k];
      }
      const DVec2 expected = DVec2(here) / here.w - DVec2(there) / there.w;
      ASSERT_EQ(buffer.usable()[i], 1);
      const Vec2 velocity = buffer.velocity()[i];
      EXPECT_LT(glm::length(DVec2(velocity) - expected), 2e-4);
      EXPECT_NEAR(buffer.then_depth()[i], there.z, 1e-5);
      moved = std::max(moved, glm::length(velocity));
      // At vertices, and near them elsewhere, points of patches move so as well.
      const float difference = glm::length(velocity - of_patches.velocity()[i]);
      if (i % 4 != 3) {
        EXPECT_LT(difference, 2e-4f);
      }
      bent = std::max(bent, difference);
    }
    EXPECT_GT(moved, 1.0f);
    EXPECT_GT(bent, 1e-3f);
    EXPECT_LT(bent, 0.2f * moved);

    const std::uint64_t patch_operations = displaced ? 161 : 41, pixels = tile.samples.count;
    EXPECT_EQ(work.operations, 15 * pixels + patch_operations * vertices.size());
    EXPECT_EQ(every.operations, patch_operations * pixels);
    EXPECT_GT(work.vertex_bytes, 0u);
    EXPECT_LT(work.vertex_bytes, every.vertex_bytes);
    // Vertices that an image alone asked for first are charged to the machine when it needs them, once.
    buffer.start(*now, tile.samples, tile.state, tile.surfaces, &field);
    EXPECT_EQ(tile.evaluate(buffer, false).operations, 0u);
    EXPECT_EQ(tile.evaluate(buffer, true).operations, work.operations);
    EXPECT_EQ(tile.evaluate(buffer, true).operations, 15 * pixels);
    // Where nothing moved velocities are zero exactly.
    const MotionField still(*now, *tile.at(0.75));
    buffer.start(*now, tile.samples, tile.state, tile.surfaces, &still);
    tile.evaluate(buffer, true);
    for (const Vec2& velocity : buffer.velocity()) EXPECT_EQ(velocity, Vec2(0.0f));
  }
}

TEST(MotionField, PointsBehindTheEyeInEitherFrameAreNotUsable) {  // MF2
  // The camera passes through the scene between the frames.
  const TestFrame s = scene(DVec3(0.0), DVec3(0, 0, -10));
  const auto before = pose(s, 0, 0), after = pose(s, 1, 1);
  EXPECT_FALSE(MotionField(*before, *after).step(0, {48, 32}, 6.0f, {0, 0, 0.2f, 0.2f, 0}).usable);
  EXPECT_FALSE(MotionField(*before, *before).all_still() &&
               MotionField(*before, *after).step(0, {48, 32}, -1.0f, {0, 0, 0.2f, 0.2f, 0}).usable);
}

TEST(MotionField, ALightThatChangesIsNoticed) {
  TestFrame s = scene(DVec3(0.0), DVec3(0.0));
  s.capture->lights.emplace_back();
  scene::Node node;
  node.light = 0;
  s.capture->nodes.push_back(node);
  s.capture->roots.push_back(3);
  const auto same = pose(s, 0, 0);
  EXPECT_TRUE(MotionField(*same, *pose(s, 0.5, 0.5)).lights().none());
  test::add_motion(*s.capture, 3, {1, 0, 0});
  EXPECT_FALSE(MotionField(*pose(s, 0.5, 0.5), *same).lights().none());
}

// LR1: against the light of KHR_lights_punctual at random points in balls that nothing reaches.
TEST(LightReach, WhereNothingReachesNothingIsSeenOfAChange) {
  test::Random random(11);
  int unreached = 0, reached = 0;
  for (int round = 0; round < 300; ++round) {
    scene::FrameGeometry now, then;
    const int count = random.integer(1, 3);
    for (int i = 0; i < count; ++i) {
      shaders::Light light;
      light.type = random.coin() ? shaders::Light::Type::kPoint : shaders::Light::Type::kSpot;
      light.color = Vec3(random.uniform(0.0f, 0.3f), random.uniform(0.0f, 0.3f), 0.1f);
      light.position = random.in_box(2);
      light.direction = glm::normalize(random.in_box(1) + Vec3(0.0f, 0.0f, 1e-3f));
      light.range = random.coin() ? random.uniform(0.5f, 8.0f) : 0.0f;
      light.cos_outer = random.uniform(0.1f, 0.95f), light.cos_inner = 0.5f * (1 + light.cos_outer);
      for (auto& key : then.lights) key.push_back(light);
      light.position += 0.1f * random.in_box(1);
      for (auto& key : now.lights) key.push_back(light);
    }
    const LightReach reach(now, then);
    EXPECT_FALSE(reach.none() || reach.everywhere());
    for (int i = 0; i < 30; ++i) {
      const Vec3 middle = random.in_box(12);
      const float radius = random.uniform(0.0f, 1.0f);
      if (reach.reaches(middle, radius)) {
        ++reached;
        continue;
      }
      ++unreached;
      const Vec3 direction = random.in_box(1);
      const Vec3 point = middle + direction * (radius * random.uniform(0, 1) / glm::length(direction));
      for (const auto* frame : {&now, &then}) {
        Vec3 irradiance(0.0f);
        for (const shaders::Light& light : frame->lights[0]) {
          const auto in = shaders::incident<float>(light.type, light.range > 0, shaders::light_state<float>(light),
                                                   shaders::constant<float>(point));
          irradiance += Vec3(in.irradiance.x, in.irradiance.y, in.irradiance.z);
        }
        EXPECT_LE(std::max({irradiance.x, irradiance.y, irradiance.z}), 3.14160f * kUnseenLight);
      }
    }
  }
  EXPECT_GT(unreached, 500);
  EXPECT_GT(reached, 500);
}

TEST(LightReach, DirectionalLightsAndLightsThatComeReachEverything) {
  scene::FrameGeometry now, then;
  for (auto& key : now.lights) key.emplace_back();
  EXPECT_TRUE(LightReach(now, then).everywhere());
  for (auto& key : then.lights) key.emplace_back();
  EXPECT_TRUE(LightReach(now, then).none());
  now.lights[0][0].direction = now.lights[1][0].direction = {0, 1, 0};
  EXPECT_TRUE(LightReach(now, then).everywhere());
}

// A card that moves over a floor under a sun: the places behind it along the rays are reached, others are not. The oracle
// goes from a place towards the sun and looks for the card at both ends of both frames.
TEST(LightReach, ReachesEverythingBehindMovingCastersAlongTheRaysOfASun) {
  scene::Capture capture;
  const int material = test::add_material(capture);
  test::add_node(capture,
                 test::triangles({{-9, 0, 9}, {9, 0, 9}, {9, 0, -9}, {-9, 0, -9}}, {0, 1, 2, 0, 2, 3}, material));
  const int card = test::add_node(
      capture, test::triangles({{-1, 0, 1}, {1, 0, 1}, {1, 0, -1}, {-1, 0, -1}}, {0, 1, 2, 0, 2, 3}, material));
  scene::made::play(
      capture,
      {.node = card, .path = scene::AnimatedPath::kTranslation, .times = {0, 1}, .values = {-2, 3, 0, 2, 3, 0}});
  const DVec3 rays = glm::normalize(DVec3(1, -2, 0.5));
  scene::made::add_light(capture, {}, DVec3(0.0), rays);
  test::add_camera(capture, {0, 4, 20});
  const scene::Assembly assembly = scene::assemble(capture);
  const auto posed = [&](double open, scene::ShadowCasters casters) {
    scene::FrameRequest request;
    request.width = 64, request.height = 36;
    request.open_time = open, request.close_time = open + 0.1;
    request.shadow_casters = casters;
    return scene::pose_frame(assembly, scene::choose_camera(capture, 64, 36), request);
  };
  const auto then = posed(0.2, scene::ShadowCasters::kAuto), now = posed(0.4, scene::ShadowCasters::kAuto);
  const LightReach reach(*now, *then);
  EXPECT_FALSE(reach.everywhere());
  EXPECT_TRUE(LightReach(*posed(0.4, scene::ShadowCasters::kOff), *posed(0.2, scene::ShadowCasters::kOff)).none());
  test::Random random(3);
  int shaded = 0, unreached = 0;
  for (int k = 0; k < 8000; ++k) {
    const DVec3 place(random.uniform(-9, 9), random.uniform(-1, 6), random.uniform(-9, 9));
    const bool reached = reach.reaches(Vec3(place), 0.0f);
    unreached += !reached;
    const double way = (3 - place.y) / -rays.y;  // towards the sun, to the card's height
    const DVec3 there = place - rays * way;
    for (const double time : {0.2, 0.3, 0.4, 0.5})
      if (way >= 0 && std::abs(there.x - (-2 + 4 * time)) < 1 && std::abs(there.z) < 1) {
        ++shaded;
        EXPECT_TRUE(reached) << place.x << " " << place.y << " " << place.z;
      }
  }
  EXPECT_GT(shaded, 200);
  EXPECT_GT(unreached, 1000);
}

// ---- The camera's own motion ------------------------------------------------------------------------------------

TEST(CameraMotion, IsWhereRestingPointsGoAndACutIsAChangeOfIt) {
  const TestFrame s = scene(DVec3(0.0), DVec3(0.6, 0, 0));
  History history(IntRect{0, 0, 96, 64});
  history.depth.assign(history.depth.size(), -6.0f);  // reconstructed or not
  const auto at = [&](double time) { return pose(s, time, time); };
  const CameraMotion slow = camera_motion(*at(0.2), *at(0.1), history),
                     later = camera_motion(*at(0.3), *at(0.2), history),
                     fast = camera_motion(*at(0.9), *at(0.2), history);
  const double pixels = at(0)->projection.scale * 0.06 / 6;
  for (const Vec2& p : slow.pixels) {
    EXPECT_NEAR(p.x, -pixels, 1e-4);
    EXPECT_NEAR(p.y, 0, 1e-4);
  }
  EXPECT_FALSE(is_cut(slow, later, 1e-3f));
  EXPECT_TRUE(is_cut(slow, fast, static_cast<float>(5.9 * pixels)));
  EXPECT_FALSE(is_cut(slow, fast, static_cast<float>(6.1 * pixels)));
  EXPECT_FALSE(is_cut({}, fast, 0));
}

}  // namespace
}  // namespace tessera::tilecore::motion_test

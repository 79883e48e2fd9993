// Effects follow the scene: forced effects, elision and its reported reasons, on whole frames.
#include "binner/binner.h"
#include "frontend/front_end.h"
#include "gpu/device.h"
#include "scene/capture_reader.h"
#include "tests/effects/effect_scenes.h"
#include "tests/support/image_bytes.h"
#include "tests/support/tests.h"
#include "tilecore/tile_core.h"

namespace tessera::replay::effects_test {
namespace {

using scene::Capture;
using test::image_bytes;

gpu::GpuConfiguration small_tiles() {
  gpu::GpuConfiguration gpu;
  gpu.tile.width = gpu.tile.height = 16;
  return gpu;
}

gpu::FrameResult render(const Capture& capture, const gpu::RunSettings& settings, int frame = 0,
                        const gpu::GpuConfiguration& gpu = small_tiles(), int width = 192, int height = 112) {
  gpu::Device renderer(capture, gpu, settings, {width, height, {0, 0, width, height}, true});
  return renderer.render(frame);
}

gpu::RunSettings forced(gpu::EffectMode value) {
  gpu::RunSettings settings;
  settings.effects.motion = settings.effects.defocus = settings.effects.displacement = settings.effects.alpha_test =
      value;
  return settings;
}

std::uint64_t sum(const gpu::TileMaps& maps, std::uint64_t gpu::TileCounts::*member) {
  std::uint64_t all = 0;
  for (const gpu::TileCounts& tile : maps.tiles) all += tile.*member;
  return all;
}

// ---- Forcing ----------------------------------------------------------------------------------------------------

TEST(Effects, ForcedOnEverywhereTheyGiveTheSameImage) {
  const auto compare = [](const Capture& capture, int frame, const std::string& name) {
    const std::string expected = image_bytes(render(capture, {}, frame).targets);
    EXPECT_EQ(image_bytes(render(capture, forced(gpu::EffectMode::kOn), frame).targets), expected) << name;
    for (const char* key : {"effects.motion", "effects.defocus", "effects.displacement", "effects.alpha_test"}) {
      gpu::RunSettings one;
      gpu::GpuConfiguration gpu;
      gpu::apply_setting(std::string(key) + "=on", one, gpu);
      EXPECT_EQ(image_bytes(render(capture, one, frame).targets), expected) << name << " " << key;
    }
  };
  for (const char* name : {"eggs", "flyby", "serpent", "stroll", "vases"}) {
    const Capture capture = scene::read_capture(test::shipped_capture(name));
    compare(capture, capture.settings.first_frame, name);
  }
  for (std::uint32_t seed = 1; seed <= 12; ++seed)
    compare(*test::slow_scene(seed), 0, "slow scene " + std::to_string(seed));
  for (std::uint32_t seed = 1; seed <= 5; ++seed)
    compare(*test::partly_displaced_scene(seed), 0, "displaced scene " + std::to_string(seed));
  for (std::uint32_t seed = 1; seed <= 5; ++seed)
    compare(*test::masked_scene(seed), 0, "masked scene " + std::to_string(seed));
}

TEST(Effects, EveryVisibilityMethodElidesThemWithoutAChange) {
  for (std::uint32_t seed = 2; seed <= 6; seed += 2) {
    const auto capture = test::slow_scene(seed);
    const std::string expected = image_bytes(render(*capture, {}).targets);
    using tilecore::VisibilityMethod;
    for (const VisibilityMethod method :
         {VisibilityMethod::kBrute, VisibilityMethod::kSegments, VisibilityMethod::kPartition,
          VisibilityMethod::kClusters, VisibilityMethod::kClusterPartition}) {
      gpu::GpuConfiguration gpu = small_tiles();
      gpu.tilecore.visibility.method = method;
      for (const gpu::EffectMode force : {gpu::EffectMode::kAuto, gpu::EffectMode::kOn})
        EXPECT_EQ(image_bytes(render(*capture, forced(force), 0, gpu).targets), expected)
            << seed << " " << word(method) << " " << word(force);
    }
    gpu::GpuConfiguration gpu = small_tiles();
    gpu.tilecore.visibility.traversal = tilecore::Traversal::kRay;
    for (const gpu::EffectMode force : {gpu::EffectMode::kAuto, gpu::EffectMode::kOn})
      EXPECT_EQ(image_bytes(render(*capture, forced(force), 0, gpu).targets), expected)
          << seed << " rays " << word(force);
  }
}

TEST(Effects, ForcedOffTheyGiveTheImageOfTheCaptureWithoutThem) {
  const auto same = [](const Capture& with, const char* key, const Capture& without) {
    gpu::RunSettings off;
    gpu::GpuConfiguration gpu;
    gpu::apply_setting(std::string(key) + "=off", off, gpu);
    const gpu::FrameResult plain = render(without, {}), result = render(with, off);
    EXPECT_EQ(image_bytes(result.targets), image_bytes(plain.targets)) << key;
    EXPECT_NE(image_bytes(render(with, {}).targets), image_bytes(plain.targets)) << key << " makes no difference here";
    const std::string name = std::string(key).substr(8);
    EXPECT_FALSE(result.effects.at(name));
    EXPECT_EQ(result.effect_places.at(name).tiles, 0u);
    EXPECT_EQ(result.effect_reasons.at(name), std::string(key) + "=off");
  };
  const auto moving = test::one_moving_ball({0.8, 0.1, 0});
  Capture still = *moving;
  still.settings.shutter_close = 0;
  same(*moving, "effects.motion", still);

  auto lens = test::one_moving_ball({0, 0, 0});
  const Capture pinhole = *lens;
  lens->cameras[0].lens = {0.05f, 3.0f};
  same(*lens, "effects.defocus", pinhole);

  const auto displaced = test::partly_displaced_scene(3);
  Capture smooth = *displaced;
  for (scene::Material& m : smooth.materials) m.displacement.reset();
  same(*displaced, "effects.displacement", smooth);

  const auto masked = test::masked_scene(1);
  Capture opaque = *masked;
  for (scene::Material& m : opaque.materials) m.alpha_mode = scene::AlphaMode::kOpaque;
  same(*masked, "effects.alpha_test", opaque);

  Capture blended = *masked;
  for (scene::Material& m : blended.materials) m.alpha_mode = scene::AlphaMode::kBlend;
  same(blended, "effects.blending", opaque);

  const Capture workshop = scene::read_capture(test::shipped_capture("workshop"));
  Capture empty = workshop;
  for (scene::Node& node : empty.nodes) node.procedure = scene::kNone;
  same(workshop, "effects.procedures", empty);
}

// ---- Motion -----------------------------------------------------------------------------------------------------

TEST(Effects, TilesThatTheMovingObjectDoesNotTouchDoTheWorkOfAStillScene) {
  const auto capture = test::one_moving_ball({0.5, 0.1, 0});
  gpu::RunSettings off;
  off.effects.motion = gpu::EffectMode::kOff;
  const gpu::FrameResult moving = render(*capture, {}), still = render(*capture, off);
  std::size_t without = 0, with = 0;
  for (std::size_t t = 0; t < moving.maps.tiles.size(); ++t) {
    const gpu::TileCounts &a = moving.maps.tiles[t], &b = still.maps.tiles[t];
    if (a.moving_sub_patches > 0) {
      ++with;
      continue;
    }
    ++without;
    EXPECT_EQ(a.triangle_tests, b.triangle_tests) << t;
    EXPECT_EQ(a.box_tests, b.box_tests) << t;
    EXPECT_EQ(a.sample_hits, b.sample_hits) << t;
  }
  EXPECT_GT(with, 5u);
  EXPECT_GT(without, 3 * with);
  EXPECT_EQ(moving.effect_places.at("motion").tiles, with);
  EXPECT_EQ(moving.effect_places.at("motion").sub_patches, moving.counters.frontend.sub_patches_moving);
  EXPECT_LT(moving.counters.frontend.sub_patches_moving, moving.counters.frontend.sub_patches / 2);
  EXPECT_TRUE(moving.effects.at("motion"));
  EXPECT_EQ(moving.effect_reasons.at("motion"), "1 of 2 drawables move on screen");
}

// The twin of forcing: taking a moving sub-patch for still changes the image.
TEST(Effects, AMovingSubPatchThatRanWithoutMotionWouldBeNoticed) {
  const auto capture = test::one_moving_ball({0.5, 0.1, 0});
  const scene::Assembly assembly = scene::assemble(*capture);
  const frontend::PyramidLibrary pyramids(assembly);
  scene::FrameRequest request;
  request.width = 192;
  request.height = 112;
  request.close_time = 1;
  const auto frame = scene::pose_frame(assembly, scene::choose_camera(*capture, 192, 112), request);
  const binner::TileGrid grid(192, 112, 16, 16, {0, 0, 192, 112});
  const tilecore::SamplePattern pattern({4, 0, 0});
  tilecore::TileJob job;
  job.frame = frame.get();
  job.grid = &grid;
  job.pattern = &pattern;
  const gpu::GpuConfiguration gpu = small_tiles();
  binner::Binner binner(gpu.binner_spec(), grid);
  binner::Binner::Cursor cursor;
  ASSERT_TRUE(binner.run(*frame, frontend::run_front_end(*frame, pyramids, gpu.front_end_spec()).sub_patches, cursor));
  const auto patches_seen = [&](bool forced_on, bool cleared) {
    tilecore::TileCore core;
    job.forced.motion = forced_on;
    std::vector<std::uint32_t> seen;
    for (binner::TileIndex t = 0; t < grid.tile_count(); ++t) {
      memory::Ledger ledger;
      std::uint64_t bytes = 0;
      std::vector<binner::ListEntry> entries = binner.read_tile(*frame, t, ledger, bytes);
      for (binner::ListEntry& e : entries)
        if (cleared) e.flags &= static_cast<std::uint8_t>(~binner::ListEntry::kMoving);
      tilecore::TileState state;
      core.render_entries(job, t, std::move(entries), state);
      seen.insert(seen.end(), state.patch.begin(), state.patch.end());
    }
    return seen;
  };
  EXPECT_EQ(patches_seen(false, false), patches_seen(true, false));
  EXPECT_NE(patches_seen(false, true), patches_seen(true, false));
}

TEST(Effects, AnObjectThatMovesByLessThanASubPixelNeedsNoCodeForMotion) {
  // A pixel at the ball is 0.026 wide; a sub-pixel a 256th of that, 0.0001.
  const auto slow = test::one_moving_ball({0.00002, 0, 0}), faster = test::one_moving_ball({0.0004, 0, 0});
  const gpu::FrameResult result = render(*slow, {});
  EXPECT_EQ(result.counters.frontend.sub_patches_moving, 0u);
  EXPECT_GT(result.counters.frontend.motion_elided, 0u);
  EXPECT_EQ(sum(result.maps, &gpu::TileCounts::moving_sub_patches), 0u);
  EXPECT_EQ(result.effect_reasons.at("motion"),
            "1 of 2 drawables move on screen, but no vertex moves by more than a sub-pixel");
  EXPECT_EQ(image_bytes(render(*slow, forced(gpu::EffectMode::kOn)).targets), image_bytes(result.targets));
  EXPECT_GT(render(*faster, {}).counters.frontend.sub_patches_moving, 0u);
}

TEST(Effects, ACameraThatMovesAloneMovesEverythingThatItSees) {
  const auto capture = test::one_moving_ball({0, 0, 0}, {0.2, 0, 0});
  const gpu::FrameResult result = render(*capture, {});
  EXPECT_EQ(result.counters.frontend.sub_patches_moving, result.counters.frontend.sub_patches);
  EXPECT_EQ(result.effect_reasons.at("motion"), "the camera moves, 2 of 2 drawables move on screen");
  // A camera and an object that move alike: the object stands still on screen.
  const auto together = test::one_moving_ball({0.25, 0, 0}, {0.25, 0, 0});
  const gpu::FrameResult followed = render(*together, {});
  std::uint64_t ball = 0;
  for (const gpu::TileCounts& tile : followed.maps.tiles) ball += tile.sub_patches - tile.moving_sub_patches;
  EXPECT_GT(ball, 0u);
  EXPECT_EQ(image_bytes(render(*together, forced(gpu::EffectMode::kOn)).targets), image_bytes(followed.targets));
}

TEST(Effects, ACutBetweenTwoFramesIsNoMotionAndOneInsideTheShutterIs) {
  for (const float cut : {0.75f, 0.25f}) {  // the shutter is open for half of each second
    auto capture = test::one_moving_ball({0, 0, 0});
    capture->settings.shutter_close = 0.5;
    const int camera = static_cast<int>(capture->nodes.size()) - 1;
    test::add_motion(*capture, camera, {1.0, 0, 0});
    scene::AnimationChannel& channel = capture->animations[0].channels.back();
    channel.interpolation = scene::Interpolation::kStep;
    channel.times = {0.0f, cut};
    const gpu::FrameResult first = render(*capture, {}, 0), second = render(*capture, {}, 1);
    EXPECT_EQ(first.effects.at("motion"), cut < 0.5f) << cut;
    EXPECT_FALSE(second.effects.at("motion")) << cut;
    EXPECT_EQ(second.effect_reasons.at("motion"), "nothing moves between shutter open and close");
    EXPECT_NE(image_bytes(first.targets), image_bytes(second.targets));
    EXPECT_EQ(image_bytes(render(*capture, forced(gpu::EffectMode::kOn), 0).targets), image_bytes(first.targets));
  }
}

// ---- Defocus ----------------------------------------------------------------------------------------------------

// A wall of patches, seen straight on at a distance of 4, tilted by `tilt`, through a lens that is focused at `focus`.
std::unique_ptr<Capture> wall_in_focus(float tilt, float focus) {
  auto capture = std::make_unique<Capture>();
  scene::Material grey;
  grey.double_sided = true;
  const int material = test::add_material(*capture, grey);
  std::vector<Vec3> points;
  for (int i = 0; i < 8; ++i)
    for (const Vec3& p :
         test::flat_patch({-2.0f + 0.5f * static_cast<float>(i), -1, tilt * (-2.0f + 0.5f * static_cast<float>(i))},
                          {0.5f, 0, 0.5f * tilt}, {0, 2, 0}))
      points.push_back(p);
  test::add_node(*capture, test::patches(points, material));
  scene::Camera camera;
  camera.lens = {0.05f, focus};
  test::add_camera(*capture, {0, 0, 4}, camera);
  return capture;
}

TEST(Effects, OnlyPatchesInFocusAllOverNeedNoCodeForTheLens) {
  const gpu::FrameResult focused = render(*wall_in_focus(0, 4), {}), nearer = render(*wall_in_focus(0, 3.5f), {});
  EXPECT_EQ(focused.counters.frontend.sub_patches_defocused, 0u);
  EXPECT_EQ(focused.effect_places.at("defocus").tiles, 0u);
  EXPECT_EQ(focused.effect_reasons.at("defocus"), "the camera has a lens, but all points are in focus");
  EXPECT_EQ(nearer.counters.frontend.defocus_elided, 0u);
  EXPECT_TRUE(nearer.effects.at("defocus"));
  // Tilted: a line through the wall is in focus, but no sub-patch is.
  const auto tilted = wall_in_focus(1.0f, 4);
  const gpu::FrameResult crossing = render(*tilted, {});
  EXPECT_EQ(crossing.counters.frontend.defocus_elided, 0u);
  // Nearly straight on, some are.
  const auto slanted = wall_in_focus(0.00006f, 4);
  const gpu::FrameResult partly = render(*slanted, {});
  EXPECT_GT(partly.counters.frontend.defocus_elided, 0u);
  EXPECT_GT(partly.counters.frontend.sub_patches_defocused, 0u);
  for (const auto& capture : {wall_in_focus(0, 4), wall_in_focus(1.0f, 4), wall_in_focus(0.00006f, 4)})
    EXPECT_EQ(image_bytes(render(*capture, forced(gpu::EffectMode::kOn)).targets),
              image_bytes(render(*capture, {}).targets));
}

// ---- Displacement and alpha -------------------------------------------------------------------------------------

TEST(Effects, AMapThatIsZeroReadsNoHeights) {
  auto capture = test::partly_displaced_scene(1);
  for (scene::Material& m : capture->materials)
    m.displacement = test::displacement(32, 32, std::vector<float>(32 * 32, 0.0f), 0.3f, 0.0f);
  const gpu::FrameResult zero = render(*capture, {}), on = render(*capture, forced(gpu::EffectMode::kOn));
  EXPECT_EQ(zero.counters.frontend.sub_patches_displaced, 0u);
  EXPECT_GT(zero.counters.frontend.displacement_elided, 0u);
  EXPECT_EQ(sum(zero.maps, &gpu::TileCounts::displaced_sub_patches), 0u);
  EXPECT_EQ(image_bytes(on.targets), image_bytes(zero.targets));
  EXPECT_LT(zero.counters.l2.requests, on.counters.l2.requests);  // lines of the map
  // A constant that is not zero moves everything.
  for (scene::Material& m : capture->materials) m.displacement->bias = 0.001f;
  EXPECT_EQ(render(*capture, {}).counters.frontend.displacement_elided, 0u);
}

TEST(Effects, OpaquePartsOfAMaskedMaterialAreNotTested) {
  const auto capture = test::masked_scene(2);
  const gpu::FrameResult result = render(*capture, {}), on = render(*capture, forced(gpu::EffectMode::kOn));
  EXPECT_GT(result.counters.frontend.alpha_test_elided, 0u);
  EXPECT_GT(result.counters.tilecore.alpha_tests, 0u);
  EXPECT_LT(result.counters.tilecore.alpha_tests, on.counters.tilecore.alpha_tests);
  EXPECT_EQ(image_bytes(on.targets), image_bytes(result.targets));
}

// ---- Reported reasons ------------------------------------------------------------------------------------------

TEST(Effects, EachHasAReasonAndPlacesInEveryFrame) {
  const gpu::FrameResult result = render(scene::read_capture(test::shipped_capture("eggs")), {}, 14);
  for (const char* name : {"advection", "alpha_test", "blending", "defocus", "desampling", "displacement", "foveation",
                           "frame_buffer_compression", "motion", "procedures", "stereo"}) {
    ASSERT_TRUE(result.effects.contains(name)) << name;
    EXPECT_FALSE(result.effect_reasons.at(name).empty()) << name;
    EXPECT_EQ(result.effect_places.at(name).tiles > 0, result.effects.at(name)) << name;
  }
  EXPECT_TRUE(result.effects.at("defocus"));
  EXPECT_TRUE(result.effects.at("displacement"));
  EXPECT_FALSE(result.effects.at("alpha_test"));
}

}  // namespace
}  // namespace tessera::replay::effects_test

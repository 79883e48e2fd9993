// Rates and splits of slow blocks, larger blocks, half pixels, and a focus that moves, in whole replays.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "base/error.h"
#include "base/simd_targets.h"
#include "gpu/moving_focus.h"
#include "tests/replay/desampling_replays.h"
#include "tests/support/temporary_folder.h"

namespace tessera::replay {
namespace {

using testing::HasSubstr;

std::string fault_of(const Machine& machine, const Capture& capture) {
  try {
    machine.renderer(capture);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

// ---- Rates and splits -------------------------------------------------------------------------------------------

// A static scene stays exact, and so much of it is not shaded as is asked for.
TEST(DesamplingSplits, AStaticSceneIsExactWhateverShareIsTakenOver) {
  const Capture capture = shipped("vases");
  const gpu::FrameResult full = plain().renderer(capture).render(0);
  double last = 0;
  for (const int advected : {4, 8, 12}) {
    const auto frames = Machine().set("resolve.advected_pixels=" + std::to_string(advected)).frames(capture, 0, 6);
    for (const gpu::FrameResult& frame : frames) EXPECT_EQ(frame.targets.color.values, full.targets.color.values);
    const double saved = 1 - static_cast<double>(frames.back().counters.shading.pixel_shader_invocations) /
                                 static_cast<double>(full.counters.shading.pixel_shader_invocations);
    EXPECT_NEAR(saved, advected / 16.0, 0.03);
    EXPECT_GT(saved, last);
    last = saved;
    const std::uint64_t rate = advected == 4   ? counters(frames.back()).blocks_rate_12
                               : advected == 8 ? counters(frames.back()).blocks_rate_8
                                               : counters(frames.back()).blocks_rate_4;
    EXPECT_EQ(counters(frames.back()).blocks_advected, rate);
  }
}

TEST(DesamplingSplits, TwelveOfSixteenAreShadedAndTheOthersComeCloserThanEightDo) {
  const Capture capture = shipped("stroll");
  Machine m;
  m.request.resolve_auxiliary = true;
  const gpu::FrameResult full = plain().renderer(capture).render(30),
                         twelve = m.set("resolve.desampling=fixed_12").renderer(capture).render(30),
                         eight = m.set("resolve.desampling=fixed_8").renderer(capture).render(30);
  EXPECT_GT(counters(twelve).blocks_rate_12, 100u);
  std::size_t made = 0;
  for (std::size_t p = 0; p < 160 * 90; ++p) {
    made += twelve.targets.origin.values[p] != 0;
    for (std::size_t c = 4 * p; c < 4 * p + 4 && twelve.targets.origin.values[p] == 0; ++c)
      ASSERT_EQ(twelve.targets.color.values[c], full.targets.color.values[c]);  // RU3
  }
  EXPECT_GT(made, 160u * 90 / 8);
  EXPECT_LE(made, 160u * 90 / 4);
  EXPECT_LT(rmse(twelve.targets.color, full.targets.color), 0.8 * rmse(eight.targets.color, full.targets.color));
}

TEST(DesamplingSplits, BlocksBetweenTwoThresholdsAreShadedAtTwelve) {
  const Capture capture = shipped("stroll");
  const auto get = [&](const char* fast0) {
    return counters(
        Machine().thresholds("0", "2", "8").set(std::string("resolve.k_fast0=") + fast0).frames(capture, 34, 37)[2]);
  };
  EXPECT_EQ(get("0").blocks_rate_12, 0u);
  EXPECT_GT(get("0.5").blocks_rate_12, 20u);
  EXPECT_EQ(get("0.5").blocks_rate_8, get("0").blocks_rate_8);
}

TEST(DesamplingSplits, ValuesThatDoNotFitAreRefusedWithTheRemedy) {
  const Capture capture = shipped("vases");
  EXPECT_THAT(fault_of(Machine().set("resolve.advected_pixels=6"), capture), HasSubstr("4, 8 or 12"));
  EXPECT_THAT(fault_of(Machine().set("resolve.supersampled_groups=20"), capture), HasSubstr("16, 24 or 32"));
  EXPECT_THAT(fault_of(Machine().set("resolve.block=12"), capture), HasSubstr("4, 8 or 16"));
  EXPECT_THAT(fault_of(Machine().set("resolve.k_fast0=1"), capture), HasSubstr("between resolve.reuse_speed"));
  EXPECT_THAT(fault_of(Machine().set("resolve.block=16").set("tile.width=8"), capture), HasSubstr("tiles of 8x"));
  EXPECT_THAT(fault_of(Machine().set("resolve.supersampled_groups=16").set("shading.rate=cache"), capture),
              HasSubstr("shading.rate=pixel"));
}

// ---- Larger blocks ----------------------------------------------------------------------------------------------

TEST(DesamplingSplits, LargerBlocksHaveOneRateAndDoNotKnowTheTile) {  // RU1
  const Capture capture = shipped("stroll");
  for (const int side : {8, 16}) {
    std::vector<gpu::FrameResult> by_tile;
    for (const char* tile : {"16", "32"}) {
      Machine m;
      m.set("resolve.block=" + std::to_string(side))
          .set(std::string("tile.width=") + tile)
          .set(std::string("tile.height=") + tile)
          .set("resolve.stencil_reach=neighbours");
      m.request.resolve_auxiliary = true;
      by_tile.push_back(std::move(m.frames(capture, 34, 37).back()));
    }
    EXPECT_EQ(by_tile[0].targets.rate.values, by_tile[1].targets.rate.values);
    EXPECT_EQ(by_tile[0].targets.color.values, by_tile[1].targets.color.values);
    std::set<float> rates;
    for (int y = 0; y < 90; ++y)
      for (int x = 0; x < 160; ++x) {
        std::set<float> in_block;
        for (int j = y & -side; j < std::min(90, (y & -side) + side); ++j)
          for (int i = x & -side; i < (x & -side) + side; ++i)
            if (by_tile[0].targets.rate.at(i, j)[0] != 0) in_block.insert(by_tile[0].targets.rate.at(i, j)[0]);
        EXPECT_LE(in_block.size(), 1u) << x << " " << y;
        rates.merge(in_block);
      }
    EXPECT_GT(rates.size(), 1u);
  }
}

TEST(DesamplingSplits, LargerBlocksSaveLessAndAStaticSceneStaysExact) {
  const Capture walk = shipped("stroll"), still = shipped("vases");
  const gpu::FrameResult full = plain().renderer(still).render(0);
  std::uint64_t last = 0;
  for (const char* side : {"4", "8", "16"}) {
    const Machine m = Machine().set(std::string("resolve.block=") + side);
    for (const gpu::FrameResult& frame : m.frames(still, 0, 3))
      EXPECT_EQ(frame.targets.color.values, full.targets.color.values) << side;
    const std::uint64_t invocations = m.frames(walk, 20, 24).back().counters.shading.pixel_shader_invocations;
    EXPECT_GT(invocations, last) << side;
    last = invocations;
  }
}

// ---- Half pixels ------------------------------------------------------------------------------------------------

TEST(DesamplingSplits, HalfPixelsAreMadeFromThoseOfTheirSurface) {
  const Capture capture = shipped("stroll");
  const auto at = [&](const char* groups) {
    Machine m;
    m.set("resolve.supersampling=true").set(std::string("resolve.supersampled_groups=") + groups);
    return m.frames(capture, 30, 32);
  };
  const auto all = at("32"), most = at("24"), half = at("16");
  EXPECT_EQ(counters(all[0]).half_pixels_reconstructed, 0u);
  EXPECT_GT(counters(most[0]).half_pixels_reconstructed, 50u);
  EXPECT_GT(counters(half[0]).half_pixels_reconstructed, counters(most[0]).half_pixels_reconstructed);
  for (std::size_t f = 0; f < 2; ++f) {
    EXPECT_LT(half[f].counters.shading.pixel_shader_invocations, most[f].counters.shading.pixel_shader_invocations);
    EXPECT_LT(most[f].counters.shading.pixel_shader_invocations, all[f].counters.shading.pixel_shader_invocations);
    // DS2: what is skipped, shared and shaded is what is visible.
    for (const gpu::FrameResult* r : {&all[f], &most[f], &half[f]}) {
      const tilecore::ShadingCounters& s = r->counters.shading;
      EXPECT_EQ(s.pixel_shader_invocations + s.pixel_shader_invocations_saved + counters(*r).samples_skipped,
                s.samples_visible + s.blended_layers);
    }
  }
  // Three quarters with stencils are closer to all than one invocation for both halves is. (Half of them are not.)
  const gpu::FrameResult once = Machine().renderer(capture).render(30);
  EXPECT_LT(rmse(most[0].targets.color, all[0].targets.color), rmse(once.targets.color, all[0].targets.color));
}

TEST(DesamplingSplits, HalfPixelsDoNotHangOnThreadsOrInstructionSets) {
  const Capture capture = shipped("serpent");
  Machine m;
  m.set("resolve.supersampling=true")
      .set("resolve.supersampled_groups=16")
      .set("resolve.block=8")
      .set("resolve.advected_pixels=12");
  std::vector<float> first;
  for (const std::string& target : simd_target_names()) {
    force_simd_target(target);
    const auto frames = m.frames(capture, 12, 15);
    if (first.empty()) first = frames.back().targets.color.values;
    EXPECT_EQ(frames.back().targets.color.values, first) << target;
  }
  force_simd_target("");
}

// ---- A focus that moves -----------------------------------------------------------------------------------------

// The middle of the blocks that foveation leaves alone.
Vec2 middle_of_focus(const gpu::FrameResult& frame) {
  Vec2 sum(0.0f);
  float count = 0;
  for (int y = 0; y < 90; ++y)
    for (int x = 0; x < 160; ++x)
      if (frame.targets.rate.at(x, y)[0] == 16) sum += Vec2(static_cast<float>(x), static_cast<float>(y)), count += 1;
  return sum / count;
}

TEST(DesamplingSplits, TheFocusFollowsATrackAndANode) {
  Capture capture = shipped("vases");
  const test::TemporaryFolder folder;
  test::write_text(folder / "eye.csv", "time,x,y\n0,0.25,0.5\n1,0.75,0.5\n");
  Machine m;
  m.set("resolve.foveation_r0=20").set("resolve.foveation_r1=40").set("resolve.advection=false");
  m.request.resolve_auxiliary = true;
  Machine tracked = m;
  tracked.set("resolve.focus_track=" + (folder / "eye.csv").string());
  const gpu::FrameResult at_start = tracked.renderer(capture).render(0),
                         later = tracked.renderer(capture).render(static_cast<int>(capture.settings.frame_rate / 2));
  EXPECT_NEAR(middle_of_focus(at_start).x, 40, 8);
  EXPECT_NEAR(middle_of_focus(later).x, 80, 8);
  // The image is that of a focus which stays where the track is then.
  const gpu::FrameResult fixed = m.set("resolve.focus_x=0.25").set("resolve.focus_y=0.5").renderer(capture).render(0);
  if (capture.settings.shutter_open == 0 && capture.settings.shutter_close == 0) {
    EXPECT_EQ(at_start.targets.color.values, fixed.targets.color.values);
  }

  // A node a metre before the camera, to the left of it and above.
  scene::Node eye;
  eye.name = "eye";
  capture.nodes.push_back(eye);
  capture.roots.push_back(static_cast<int>(capture.nodes.size()) - 1);
  const scene::CameraChoice camera = scene::choose_camera(capture, 160, 90);
  const scene::Pose pose = scene::pose_at(capture, 0);
  capture.nodes.back().transform.translation = DVec3(camera.view(pose).camera_to_world * DVec4(-0.2, 0.1, -1, 1));
  const tilecore::FoveationSettings follow{20, 40, 0.5, 0.5, "", "eye"};
  const double scale = scene::make_projection(camera.camera, 160, 90).scale;
  const DVec2 seen = gpu::MovingFocus(follow, capture).at(0, camera, 160, 90);
  EXPECT_NEAR(seen.x, 0.5 - 0.2 * scale / 160, 1e-9);
  EXPECT_NEAR(seen.y, 0.5 - 0.1 * scale / 90, 1e-9);
  // Behind the camera: the settings' place.
  capture.nodes.back().transform.translation = DVec3(camera.view(pose).camera_to_world * DVec4(0, 0, 1, 1));
  EXPECT_EQ(gpu::MovingFocus(follow, capture).at(0, camera, 160, 90), DVec2(0.5, 0.5));
}

TEST(DesamplingSplits, AFocusThatMovesIsRefusedWhereNothingIsFoveated) {
  Capture capture = shipped("vases");
  EXPECT_THAT(fault_of(Machine().set("resolve.focus_track=eye.csv"), capture), HasSubstr("resolve.foveation_r0"));
  EXPECT_THAT(
      fault_of(plain().set("resolve.foveation_r0=20").set("resolve.foveation_r1=40").set("resolve.focus_node=a"),
               capture),
      HasSubstr("resolve.desampling=adaptive"));
  Machine m;
  m.set("resolve.foveation_r0=20").set("resolve.foveation_r1=40");
  Machine both = m;
  EXPECT_THAT(fault_of(both.set("resolve.focus_track=a").set("resolve.focus_node=b"), capture),
              HasSubstr("one of them"));
  Machine missing = m;
  EXPECT_THAT(fault_of(missing.set("resolve.focus_track=/nowhere/eye.csv"), capture), HasSubstr("/nowhere/eye.csv"));
  Machine unknown = m;
  scene::Node left, right;
  left.name = right.name = "pair";
  for (const scene::Node& node : {left, right}) {
    capture.nodes.push_back(node);
    capture.roots.push_back(static_cast<int>(capture.nodes.size()) - 1);
  }
  EXPECT_THAT(fault_of(unknown.set("resolve.focus_node=pairs"), capture), HasSubstr("did you mean 'pair'?"));
  EXPECT_THAT(fault_of(unknown.set("resolve.focus_node=pair"), capture), HasSubstr("several nodes"));
}

}  // namespace
}  // namespace tessera::replay

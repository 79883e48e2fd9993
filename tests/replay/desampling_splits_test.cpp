// Rates and splits of slow blocks, larger blocks, half pixels, and a focus that moves, in whole replays.
#include "base/error.h"
#include "base/simd_targets.h"
#include "gpu/moving_focus.h"
#include "tests/replay/desampling_replays.h"
#include "tests/support/tests.h"

namespace tessera::replay::desampling_splits_test {
namespace {

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
  for (const int advected : {8, 12}) {
    const auto frames = Machine().set("resolve.advected_pixels=" + std::to_string(advected)).frames(capture, 0, 6);
    for (const gpu::FrameResult& frame : frames) EXPECT_EQ(frame.targets.color.values, full.targets.color.values);
    const double saved = 1 - static_cast<double>(frames.back().counters.shading.pixel_shader_invocations) /
                                 static_cast<double>(full.counters.shading.pixel_shader_invocations);
    EXPECT_NEAR(saved, advected / 16.0, 0.03);
    EXPECT_GT(saved, last);
    last = saved;
    const std::uint64_t rate =
        advected == 8 ? counters(frames.back()).blocks_rate_8 : counters(frames.back()).blocks_rate_4;
    EXPECT_EQ(counters(frames.back()).blocks_advected, rate);
  }
}

TEST(DesamplingSplits, ValuesThatDoNotFitAreRefusedWithTheRemedy) {
  const Capture capture = shipped("vases");
  EXPECT_THAT(fault_of(Machine().set("resolve.advected_pixels=9"), capture), HasSubstr("8 or 12"));
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

TEST(DesamplingSplits, TheFocusFollowsANode) {
  Capture capture = shipped("vases");
  Machine m;
  m.set("resolve.foveation_r0=20").set("resolve.foveation_r1=40").set("resolve.advection=false");
  m.request.resolve_auxiliary = true;
  // A node a metre before the camera, to the left of it and above.
  scene::Node eye;
  eye.name = "eye";
  capture.nodes.push_back(eye);
  capture.roots.push_back(static_cast<int>(capture.nodes.size()) - 1);
  const scene::CameraChoice camera = scene::choose_camera(capture, 160, 90);
  const scene::Pose pose = scene::pose_at(capture, 0);
  capture.nodes.back().transform.translation = DVec3(camera.view(pose).camera_to_world * DVec4(-0.2, 0.1, -1, 1));
  const tilecore::FoveationSettings follow{20, 40, 0.5, 0.5, "eye"};
  const double scale = scene::make_projection(camera.camera, 160, 90).scale;
  const DVec2 seen = gpu::MovingFocus(follow, capture).at(0, camera, 160, 90);
  EXPECT_NEAR(seen.x, 0.5 - 0.2 * scale / 160, 1e-9);
  EXPECT_NEAR(seen.y, 0.5 - 0.1 * scale / 90, 1e-9);
  // The image equals the image with a focus that rests at the node's place.
  capture.nodes.back().transform.translation = DVec3(camera.view(pose).camera_to_world * DVec4(-40 / scale, 0, -1, 1));
  const gpu::FrameResult followed = Machine(m).set("resolve.focus_node=eye").renderer(capture).render(0),
                         fixed = m.set("resolve.focus_x=0.25").renderer(capture).render(0);
  EXPECT_NEAR(middle_of_focus(followed).x, 40, 8);
  EXPECT_EQ(followed.targets.color.values, fixed.targets.color.values);
  // Behind the camera: the settings' place.
  capture.nodes.back().transform.translation = DVec3(camera.view(pose).camera_to_world * DVec4(0, 0, 1, 1));
  EXPECT_EQ(gpu::MovingFocus(follow, capture).at(0, camera, 160, 90), DVec2(0.5, 0.5));
}

TEST(DesamplingSplits, AFocusThatMovesIsRefusedWhereNothingIsFoveated) {
  Capture capture = shipped("vases");
  EXPECT_THAT(fault_of(Machine().set("resolve.focus_node=eye"), capture), HasSubstr("resolve.foveation_r0"));
  EXPECT_THAT(
      fault_of(plain().set("resolve.foveation_r0=20").set("resolve.foveation_r1=40").set("resolve.focus_node=a"),
               capture),
      HasSubstr("resolve.desampling=adaptive"));
  Machine m;
  m.set("resolve.foveation_r0=20").set("resolve.foveation_r1=40");
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
}  // namespace tessera::replay::desampling_splits_test

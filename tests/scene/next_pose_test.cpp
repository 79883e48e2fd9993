// Frames that follow others: poses are kept where nothing differs, and equal the poses of a fresh start.
#include "scene/frame_geometry.h"
#include "scene/view.h"
#include "tests/support/tests.h"

namespace tessera::scene::next_pose_test {
namespace {

constexpr int kSide = 120;

std::shared_ptr<const FrameGeometry> pose(const Assembly& assembly, double open, double close,
                                          std::shared_ptr<const FrameGeometry> before, int segments = 1) {
  FrameRequest request;
  request.width = request.height = kSide;
  request.open_time = open, request.close_time = close;
  request.motion_segments = segments;
  return pose_frame(assembly, choose_camera(*assembly.capture, kSide, kSide), request, std::move(before));
}

// A displaced sphere, a mesh and a light before a camera, where each number stands for something that may be animated.
struct Stage {
  Capture capture;
  int sphere = 0, mesh = 0, lamp = 0;
  Stage() {
    Material bumpy;
    bumpy.displacement = test::displacement(2, 2, {0, 1, 1, 0}, 0.2f, 0);
    sphere = test::add_node(capture, test::closed_patches(test::add_material(capture, bumpy)));
    Primitive triangle = test::triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {0, 1, 2});
    MorphTarget target;
    target.positions.assign(3, Vec3(0, 0, 0.5f));
    triangle.vertices.morph_targets.push_back(target);
    mesh = test::add_node(capture, std::move(triangle), {1, 0, 0});
    capture.lights.push_back({});
    lamp = test::add_node(capture, test::triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {0, 1, 2}), {-2, 0, 0});
    capture.nodes[static_cast<std::size_t>(lamp)].light = 0;
    test::add_camera(capture, {0, 0, 6});
  }
  void play(AnimationChannel channel) {
    if (capture.animations.empty()) capture.animations.emplace_back();
    capture.animations[0].channels.push_back(std::move(channel));
    capture.played_animations = {0};
  }
};

bool same_patterns(const FrameGeometry& a, const FrameGeometry& b) {
  return a.patterns.size() == b.patterns.size() &&
         std::memcmp(a.patterns.data(), b.patterns.data(), a.patterns.size() * sizeof(TessellationPattern)) == 0 &&
         a.displacement_lod == b.displacement_lod;
}

TEST(NextPose, FG1AStillFrameIsTheOneBefore) {
  const Stage stage;
  const Assembly assembly = assemble(stage.capture);
  const auto first = pose(assembly, 0, 0.5, nullptr), second = pose(assembly, 1, 1.5, first);
  EXPECT_EQ(second, first);
  EXPECT_NE(pose(assembly, 1, 1, first), first) << "without a shutter";
  CameraChoice moved = choose_camera(stage.capture, kSide, kSide), wide = moved;
  moved.eye_offset = 0.1;
  wide.camera.vertical_fov *= 1.5f;
  for (const CameraChoice& camera : {moved, wide})
    EXPECT_NE(pose_frame(assembly, camera, second->request, second), second) << "of another camera";
}

// An animation that came to its end leaves the scene at rest.
TEST(NextPose, FG1MovingNodesArePosedAnewUntilTheyRest) {
  Stage stage;
  test::add_motion(stage.capture, stage.mesh, {1, 0, 0});
  const Assembly assembly = assemble(stage.capture);
  const auto a = pose(assembly, 0.25, 0.5, nullptr), b = pose(assembly, 0.5, 0.75, a), c = pose(assembly, 1, 1.5, b),
             d = pose(assembly, 2, 2.5, c);
  EXPECT_NE(b, a);
  EXPECT_NE(c, b);
  EXPECT_EQ(d, c);
  EXPECT_EQ(pose(assembly, 2, 2.5, nullptr)->poses[0].world, d->poses[0].world);
}

TEST(NextPose, FG1AnythingThatIsAnimatedMakesANewPose) {
  const std::pair<const char*, AnimationChannel> animated[] = {
      {"a node",
       {.node = 0, .path = AnimatedPath::kTranslation, .components = 3, .times = {0, 1}, .values = {0, 0, 0, 1, 0, 0}}},
      {"a weight", {.node = 1, .path = AnimatedPath::kWeights, .components = 1, .times = {0, 1}, .values = {0, 1}}},
      {"the light",
       {.node = 2,
        .path = AnimatedPath::kTranslation,
        .components = 3,
        .times = {0, 1},
        .values = {-2, 0, 0, 2, 0, 0}}},
      {"the camera",
       {.node = 3,
        .path = AnimatedPath::kTranslation,
        .components = 3,
        .times = {0, 1},
        .values = {0, 0, 6, 0, 0, 7}}}};
  for (const auto& [what, channel] : animated) {
    Stage stage;
    stage.play(channel);
    const Assembly assembly = assemble(stage.capture);
    const auto first = pose(assembly, 0, 0, nullptr), second = pose(assembly, 0.5, 0.5, first);
    EXPECT_NE(second, first) << what;
    EXPECT_TRUE(same_patterns(*second, *pose(assembly, 0.5, 0.5, nullptr))) << what;
  }
}

// Both ends of a motion there and back look alike, and the times between do not.
TEST(NextPose, FG1CurvedMotionIsNotTakenForRest) {
  Stage stage;
  stage.play({.node = 0,
              .path = AnimatedPath::kTranslation,
              .components = 3,
              .times = {0, 0.5f, 1},
              .values = {0, 0, 0, 3, 0, 0, 0, 0, 0}});
  const Assembly assembly = assemble(stage.capture);
  const auto way = pose(assembly, 0, 1, nullptr, 4), rest = pose(assembly, 1, 2, way, 4);
  ASSERT_EQ(way->segments.size(), 2u) << "there and back: no more are of any use";
  EXPECT_NE(rest, way);
  EXPECT_TRUE(rest->segments.empty());
}

// Patterns are kept for objects at rest under a camera at rest, and for nothing else.
TEST(NextPose, FG1PatternsEqualAFreshStarts) {
  test::Random random(7);
  for (int trial = 0; trial < 40; ++trial) {
    Stage stage;
    for (int k = 0; k < 3; ++k)
      test::add_node(stage.capture, test::closed_patches(random.coin() ? 0 : test::add_material(stage.capture)),
                     DVec3(random.in_box(2)));
    const int nodes = static_cast<int>(stage.capture.nodes.size());
    for (int n = 0; n < nodes; ++n)
      if (stage.capture.nodes[static_cast<std::size_t>(n)].mesh != kNone && random.coin())
        test::add_motion(stage.capture, n, DVec3(random.in_box(4)));
    if (random.integer(0, 3) == 0) test::add_motion(stage.capture, 3, DVec3(random.in_box(1)));
    const Assembly assembly = assemble(stage.capture);
    std::shared_ptr<const FrameGeometry> before;
    for (int frame = 0; frame < 4; ++frame) {
      before = pose(assembly, 0.3 * frame, 0.3 * frame + 0.2, before, frame % 2 == 0 ? 1 : 3);
      EXPECT_TRUE(
          same_patterns(*before, *pose(assembly, 0.3 * frame, 0.3 * frame + 0.2, nullptr, frame % 2 == 0 ? 1 : 3)));
    }
  }
}

}  // namespace
}  // namespace tessera::scene::next_pose_test

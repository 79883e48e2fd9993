#include <glm/gtc/matrix_transform.hpp>

#include "scene/framing.h"
#include "scene/view.h"
#include "tests/support/tests.h"

namespace tessera::scene::view_test {
namespace {

DVec4 to_raster(const Projection& p, const DVec3& camera_point) { return p.matrix() * DVec4(camera_point, 1.0); }

TEST(Projection, PerspectivePutsTheFieldOfViewOnTheTopAndBottomEdge) {
  Camera camera;
  camera.vertical_fov = 0.9f;
  const Projection p = make_projection(camera, 640, 480);
  const double t = std::tan(0.45);
  const DVec4 top = to_raster(p, {0, 2 * t, -2}), side = to_raster(p, {2 * t * 640 / 480, 0, -2});
  EXPECT_NEAR(top.y / top.w, 0.0, 1e-4);
  EXPECT_NEAR(top.x / top.w, 320.0, 1e-9);
  EXPECT_NEAR(side.x / side.w, 640.0, 1e-4);
  EXPECT_NEAR(top.z, 2.0, 1e-12);
  EXPECT_EQ(top.z, top.w);
}

TEST(Projection, OrthographicKeepsSquarePixelsAndShowsTheWholeVolume) {
  Camera camera;
  camera.type = Camera::Type::kOrthographic;
  camera.x_mag = 4;
  camera.y_mag = 1;
  const Projection p = make_projection(camera, 400, 400);
  const DVec4 right = to_raster(p, {4, 0, -7}), up = to_raster(p, {0, 1, -7});
  EXPECT_NEAR(right.x / right.w, 400, 1e-9);
  EXPECT_NEAR(up.y / up.w, 150, 1e-9);
  EXPECT_EQ(right.w, 1.0);
  EXPECT_EQ(right.z, 7.0);
}

TEST(View, IgnoresScaleAndMirroringOfTheCameraNode) {
  DMat4 world = glm::translate(DMat4(1.0), DVec3(1, 2, 3)) * glm::rotate(DMat4(1.0), 0.7, DVec3(0, 1, 0));
  const View plain = view_from_world(world), scaled = view_from_world(world * glm::scale(DMat4(1.0), DVec3(5, 5, 5)));
  for (int c = 0; c < 4; ++c)
    for (int r = 0; r < 4; ++r) EXPECT_NEAR(plain.world_to_camera[c][r], scaled.world_to_camera[c][r], 1e-12);
  const DMat4 identity = plain.world_to_camera * plain.camera_to_world;
  for (int c = 0; c < 4; ++c)
    for (int r = 0; r < 4; ++r) EXPECT_NEAR(identity[c][r], c == r ? 1.0 : 0.0, 1e-12);
}

TEST(View, OfADegenerateNodeIsStillARotation) {
  const View view = view_from_world(DMat4(0.0));
  EXPECT_NEAR(glm::determinant(DMat3(view.camera_to_world)), 1.0, 1e-12);
}

TEST(ChooseCamera, AutomaticFramingShowsEveryPointOfTheScene) {
  for (const double scale : {1e-3, 1.0, 1e4}) {
    Capture capture;
    const int node = test::add_node(capture, test::closed_patches(kNone), DVec3(30, -5, 2) * scale);
    capture.nodes[static_cast<std::size_t>(node)].transform.scale = DVec3(scale);
    for (const auto& [width, height] : {std::pair{640, 480}, {200, 900}}) {
      const CameraChoice choice = choose_camera(capture, width, height);
      EXPECT_EQ(choice.node, kNone);
      const Pose pose = pose_at(capture, 0);
      const DMat4 m =
          make_projection(choice.camera, width, height).matrix() * choice.view(pose).world_to_camera * pose.world[0];
      for (const Vec3& point : capture.meshes[0].primitives[0].vertices.positions) {
        const DVec4 r = m * DVec4(DVec3(point), 1.0);
        EXPECT_GT(r.z, static_cast<double>(choice.camera.near));
        EXPECT_TRUE(r.x / r.w > 0 && r.x / r.w < width && r.y / r.w > 0 && r.y / r.w < height);
      }
    }
  }
}

// Rows and columns of the image that the scene's points cover in any of the given frames.
struct Covered {
  double left = 1e30, right = -1e30, top = 1e30, bottom = -1e30;
};
Covered covered(const Capture& capture, const CameraChoice& choice, int width, int height,
                const std::vector<double>& times) {
  Covered all;
  for (const double time : times) {
    const Pose pose = pose_at(capture, time);
    const DMat4 m =
        make_projection(choice.camera, width, height).matrix() * choice.view(pose).world_to_camera * pose.world[0];
    for (const Vec3& point : capture.meshes[0].primitives[0].vertices.positions) {
      const DVec4 r = m * DVec4(DVec3(point), 1.0);
      all.left = std::min(all.left, r.x / r.w), all.right = std::max(all.right, r.x / r.w);
      all.top = std::min(all.top, r.y / r.w), all.bottom = std::max(all.bottom, r.y / r.w);
    }
  }
  return all;
}

TEST(ChooseCamera, AutomaticFramingFillsThreeQuartersOfTheHeight) {
  for (const double scale : {1e-3, 1.0, 1e4}) {
    Capture capture;
    const int node = test::add_node(capture, test::closed_patches(kNone), DVec3(30, -5, 2) * scale);
    capture.nodes[static_cast<std::size_t>(node)].transform.scale = DVec3(scale);
    const Covered wide = covered(capture, choose_camera(capture, 640, 480), 640, 480, {0});
    EXPECT_NEAR(wide.top, 60, 0.01);
    EXPECT_NEAR(wide.bottom, 420, 0.01);
    const Covered high = covered(capture, choose_camera(capture, 200, 900), 200, 900, {0});
    EXPECT_NEAR(high.left, 10, 0.01);
    EXPECT_NEAR(high.right, 190, 0.01);
  }
}

TEST(ChooseCamera, AutomaticFramingHoldsForAllFrames) {
  Capture capture;
  const int node = test::add_node(capture, test::closed_patches(kNone));
  test::add_motion(capture, node, {0, 12, -3});
  const Covered all = covered(capture, choose_camera(capture, 640, 480), 640, 480, {0, 0.31, 0.5, 1});
  EXPECT_NEAR(all.top, 60, 0.01);
  EXPECT_NEAR(all.bottom, 420, 0.01);
  // Of a file that declares its frames those alone count: the first tenth of the motion.
  capture.settings.declared = true;
  capture.settings.frame_rate = 10;
  capture.settings.frame_count = 2;
  const Covered declared = covered(capture, choose_camera(capture, 640, 480), 640, 480, {0, 0.1});
  EXPECT_NEAR(declared.top, 60, 0.01);
  EXPECT_NEAR(declared.bottom, 420, 0.01);
  EXPECT_EQ(framed_times(capture).back(), 0.1);
  capture.settings.frame_count = 1;
  EXPECT_EQ(framed_times(capture), std::vector<double>{0});
}

TEST(ChooseCamera, TakesTheFirstCameraOfTheSceneUnlessTheSettingsNameOne) {
  Capture capture;
  test::add_camera(capture, {0, 0, 5});
  test::add_camera(capture, {0, 0, 9});
  EXPECT_EQ(choose_camera(capture, 10, 10).node, 0);
  capture.settings.camera_node = 1;
  EXPECT_EQ(choose_camera(capture, 10, 10).node, 1);
}

TEST(ChooseCamera, AnEmptySceneIsFramedToo) {
  const Capture capture;
  EXPECT_NO_THROW(choose_camera(capture, 10, 10));
}

}  // namespace
}  // namespace tessera::scene::view_test

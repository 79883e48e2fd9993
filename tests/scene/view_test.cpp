#include <functional>

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

TEST(View, IsARotationForADegenerateNode) {
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
  // Where a file declares its frames, automatic framing looks at these alone: the first tenth of the motion.
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

// Objects far away from a ball that no camera sees: each is a mistake that people make, or a way to hide something.
struct NotDrawn {
  const char* name;
  std::function<void(Capture&)> add;
};
const std::vector<NotDrawn>& unseen_things() {
  const auto triangle = [](const Vec3& a, const Vec3& b, const Vec3& c) {
    return test::triangles({a, b, c}, {0, 1, 2}, kNone);
  };
  const DVec3 away(900, -700, 400);
  static const std::vector<NotDrawn> all = {
      {"a vertex that no index names",
       [=](Capture& capture) {
         Primitive extra = triangle({0, 0, 0}, {0.1f, 0, 0}, {0, 0.1f, 0});
         extra.vertices.positions.emplace_back(away);
         test::add_node(capture, extra);
       }},
      {"a hidden node",
       [=](Capture& capture) {
         capture.nodes[static_cast<std::size_t>(test::add_node(capture, test::closed_patches(kNone), away))].visible =
             false;
       }},
      {"a node below a hidden one",
       [=](Capture& capture) {
         const int child = test::add_node(capture, test::closed_patches(kNone), away), parent = child + 1;
         Node hidden;
         hidden.visible = false;
         hidden.children = {child};
         capture.nodes.push_back(hidden);
         capture.nodes[static_cast<std::size_t>(child)].parent = parent;
         std::ranges::replace(capture.roots, child, parent);
       }},
      {"a node of no size",
       [=](Capture& capture) {
         const int node = test::add_node(capture, test::closed_patches(kNone), away);
         capture.nodes[static_cast<std::size_t>(node)].transform.scale = DVec3(0);
       }},
      {"a node squeezed to a line",
       [=](Capture& capture) {
         const int node = test::add_node(capture, test::closed_patches(kNone), away);
         capture.nodes[static_cast<std::size_t>(node)].transform.scale = DVec3(0, 5, 0);
       }},
      {"instances of no size",
       [=](Capture& capture) {
         const int node = test::add_node(capture, triangle({0, 0, 0}, {0.1f, 0, 0}, {0, 0.1f, 0}));
         auto& instances = capture.nodes[static_cast<std::size_t>(node)].instances;
         instances.resize(2);
         instances[1].translation = {900, 0, 0};
         instances[1].scale = {0, 0, 0};
       }},
      {"triangles of two corners, and of three in a row",
       [=](Capture& capture) {
         test::add_node(capture, triangle({0, 0, 0}, {0, 0, 0}, Vec3(away)));
         test::add_node(capture, triangle({0, 0, 0}, Vec3(away) * 0.25f, Vec3(away)));
       }},
      {"a patch on a line",
       [=](Capture& capture) {
         test::add_node(capture, test::patches(test::flat_patch({0, 0, 0}, Vec3(away), Vec3(away) * 0.5f), kNone));
       }},
      {"a morph target that shrinks to a point",
       [=](Capture& capture) {
         Primitive extra = triangle(Vec3(away), Vec3(away) + Vec3(1, 0, 0), Vec3(away) + Vec3(0, 1, 0));
         MorphTarget target;
         target.positions = {{0, 0, 0}, {-1, 0, 0}, {0, -1, 0}};
         extra.vertices.morph_targets = {target};
         const int node = test::add_node(capture, extra);
         capture.nodes[static_cast<std::size_t>(node)].weights = {1.0f};
       }},
  };
  return all;
}

TEST(ChooseCamera, IgnoresInvisibleObjectsInFramingAndFocus) {
  const auto ball = [] {
    Capture capture;
    test::add_node(capture, test::closed_patches(kNone), DVec3(0));  // around the little that is seen of the others
    return capture;
  };
  const Capture plain = ball();
  const CameraChoice wanted = choose_camera(plain, 640, 480);
  for (const NotDrawn& thing : unseen_things()) {
    Capture capture = ball();
    thing.add(capture);
    EXPECT_EQ(choose_camera(capture, 640, 480).fixed_world, wanted.fixed_world) << thing.name;
    EXPECT_EQ(middle_distance(capture, wanted.fixed_world, 0), middle_distance(plain, wanted.fixed_world, 0))
        << thing.name;
  }
  // The twin: the same where it is seen.
  Capture seen = ball();
  test::add_node(seen, test::closed_patches(kNone), DVec3(900, -700, 400));
  EXPECT_NE(choose_camera(seen, 640, 480).fixed_world, wanted.fixed_world);
  EXPECT_NE(middle_distance(seen, wanted.fixed_world, 0), middle_distance(plain, wanted.fixed_world, 0));
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

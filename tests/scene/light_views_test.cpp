// Views of light maps (scene/light_views.cpp) and the grids that patches have in them (scene/view_grids.cpp): every
// place that the camera sees is in a map with all texels around it, and everything that may keep light off lies
// between the map's planes.
#include "scene/light_views.h"
#include "tests/support/tests.h"

namespace tessera::scene::light_views_test {
namespace {

// A crowd of cards, a camera and a light, at random.
struct Crowd {
  Capture capture;
  std::vector<DVec3> corners;  // of all cards

  Crowd(test::Random& random, const shaders::Light& light, const DVec3& place, const DVec3& direction, int cascades) {
    const int material = made::add_material(capture);
    for (int k = 0; k < 20; ++k) {
      std::vector<Vec3> card;
      const Vec3 middle = random.in_box(20);
      for (int c = 0; c < 3; ++c) card.push_back(middle + random.in_box(3)), corners.emplace_back(card.back());
      made::add_node(capture, made::triangles(card, {0, 1, 2}, material));
    }
    made::add_light(capture, light, place, direction, {.size = 128, .cascades = cascades});
    Camera lens;
    lens.near = 0.5f;
    const int camera = made::add_camera(capture, DVec3(random.in_box(20)), lens);
    capture.nodes[static_cast<std::size_t>(camera)].transform.rotation = made::looking(DVec3(random.in_box(1)));
  }
};

std::unique_ptr<FrameGeometry> pose(const Assembly& assembly) {
  FrameRequest request;
  request.width = 160, request.height = 90;
  return pose_frame(assembly, choose_camera(*assembly.capture, 160, 90), request);
}

// A world place in texels of a map, and its depth.
DVec3 in_map(const LightView& view, const DVec3& place) {
  const DVec4 at =
      light_projection(view).matrix() * view_from_world(view.camera.fixed_world).world_to_camera * DVec4(place, 1.0);
  const double w = light_projection(view).orthographic ? 1.0 : at.w;
  return {at.x / w, at.y / w, at.z};
}

bool inside(const LightView& view, const DVec3& at, double border) {
  return at.z > 0 && at.x >= border && at.y >= border && at.x <= view.size - border && at.y <= view.size - border;
}

class Fits : public testing::TestWithParam<ShadowFit> {};
INSTANTIATE_TEST_SUITE_P(All, Fits, testing::Values(ShadowFit::kSphere, ShadowFit::kFrustum, ShadowFit::kReceivers),
                         [](const auto& instance) { return std::string(word(instance.param)); });

// An oracle over random suns: corners of cards that the camera sees are in a cascade, inside of its border; corners of cards
// before them along the rays are between its planes.
TEST_P(Fits, ACascadeHoldsTheCamerasViewAndAllCastersThatMayShadeIt) {
  test::Random random(5);
  int seen = 0;
  for (int round = 0; round < 300; ++round) {
    const Crowd crowd(random, {}, DVec3(0.0), DVec3(random.in_box(1)), random.integer(1, 4));
    const Assembly assembly = assemble(crowd.capture);
    const auto frame = pose(assembly);
    ShadowSettings settings;
    settings.fit = GetParam();
    const auto lights = shadow_lights(*frame, settings);
    ASSERT_EQ(lights.size(), 1u);
    const auto views = light_views(*frame, lights, settings).front();
    const DMat4 to_raster = frame->projection.matrix() * frame->views[0].world_to_camera;
    for (const DVec3& corner : crowd.corners) {
      const DVec4 raster = to_raster * DVec4(corner, 1.0);
      const DVec2 pixel(raster.x / raster.w, raster.y / raster.w);
      if (raster.z < 0.5 || pixel.x < 0 || pixel.y < 0 || pixel.x > 160 || pixel.y > 90) continue;
      ++seen;
      // Floats of the map's camera, and whole texels of a sphere.
      const double border = GetParam() == ShadowFit::kSphere ? kShadowBorder - 1.0 : kShadowBorder - 0.1;
      const auto holds = [&](const LightView& view) { return inside(view, in_map(view, corner), border); };
      const auto view = std::ranges::find_if(views, holds);
      ASSERT_NE(view, views.end()) << round;
      for (const DVec3& other : crowd.corners)
        if (const DVec3 at = in_map(*view, other); inside(*view, at, 0)) {
          EXPECT_GE(at.z, static_cast<double>(view->camera.camera.near)) << round;
          EXPECT_LE(at.z, static_cast<double>(view->camera.camera.far)) << round;
        }
    }
  }
  EXPECT_GT(seen, 1000);
}

// Faces of a cube leave no direction out, and a cone's map holds the cone.
TEST(LightViews, EveryDirectionOfALampIsInAMap) {
  test::Random random(6);
  for (int round = 0; round < 200; ++round) {
    shaders::Light light;
    light.type = random.coin() ? shaders::Light::Type::kPoint : shaders::Light::Type::kSpot;
    const double cone = static_cast<double>(random.uniform(0.05f, 1.5f));
    light.cos_outer = light.cos_inner = static_cast<float>(std::cos(cone));
    const DVec3 place(random.in_box(5)), direction(random.in_box(1));
    const Crowd crowd(random, light, place, direction, 1);
    const Assembly assembly = assemble(crowd.capture);
    const auto frame = pose(assembly);
    const ShadowSettings settings;
    const auto views = light_views(*frame, shadow_lights(*frame, settings), settings).front();
    EXPECT_EQ(views.size(), needs_cube(light) ? 6u : 1u);
    for (int k = 0; k < 50; ++k) {
      const DVec3 way = glm::normalize(DVec3(random.in_box(1)));
      if (light.type == shaders::Light::Type::kSpot && glm::dot(way, glm::normalize(direction)) < std::cos(cone))
        continue;
      EXPECT_TRUE(std::ranges::any_of(views, [&](const LightView& view) {
        return inside(view, in_map(view, place + 3.0 * way), kShadowBorder - 0.1);
      })) << round;
    }
  }
}

TEST(LightViews, AConeOf120DegreesHasOneMapAndAWiderOneACube) {
  shaders::Light light;
  light.type = shaders::Light::Type::kSpot;
  light.cos_outer = static_cast<float>(std::cos(glm::radians(60.0)));
  EXPECT_FALSE(needs_cube(light));
  light.cos_outer = static_cast<float>(std::cos(glm::radians(60.1)));
  EXPECT_TRUE(needs_cube(light));
}

// A camera that walks moves maps by whole texels.
TEST(LightViews, MapsOverSpheresMoveByWholeTexels) {
  test::Random random(7);
  Crowd crowd(random, {}, DVec3(0.0), DVec3(0.3, -1, 0.2), 3);
  const auto views = [&] {
    const Assembly assembly = assemble(crowd.capture);
    const auto frame = pose(assembly);
    return light_views(*frame, shadow_lights(*frame, {}), {}).front();
  };
  // The distance is given, because the distance of the farthest geometry changes as the camera moves.
  crowd.capture.settings.shadows.front().distance = 30;
  const auto before = views();
  crowd.capture.nodes.back().transform.translation += DVec3(0.123, 0.045, -0.067);
  const auto after = views();
  for (std::size_t k = 0; k < before.size(); ++k) {
    EXPECT_EQ(before[k].camera.camera.x_mag, after[k].camera.camera.x_mag);
    const DVec3 a = in_map(before[k], DVec3(0.0)), b = in_map(after[k], DVec3(0.0));
    for (const double moved : {a.x - b.x, a.y - b.y}) EXPECT_NEAR(moved, std::round(moved), 1e-6);
  }
}

// Another view of a scene refers to its vertices, deformed ones too, as they are at shutter open.
TEST(LightViews, LightsArePosedAtShutterOpen) {
  Capture capture;
  const int material = made::add_material(capture);
  Primitive card = made::triangles({{-1, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {0, 1, 2}, material);
  card.vertices.morph_targets.resize(1);
  card.vertices.morph_targets[0].positions = {{0, 0, 2}, {0, 0, 2}, {0, 0, 2}};
  const int node = made::add_node(capture, card);
  made::add_morph(capture, node);
  made::add_light(capture, {}, DVec3(0.0), {0, 0, -1});
  made::add_camera(capture, {0, 0, 9});
  const Assembly assembly = assemble(capture);
  FrameRequest request;
  request.open_time = 0.25, request.close_time = 0.75;
  const auto frame = pose_frame(assembly, choose_camera(capture, 64, 64), request);
  ASSERT_TRUE(frame->drawables[0].deforming);
  const ShadowSettings settings;
  const auto views = light_views(*frame, shadow_lights(*frame, settings), settings).front();
  const auto posed = pose_for_light(*frame, views.front(), settings);
  EXPECT_FALSE(posed->drawables[0].deforming);
  for (const auto& positions : posed->drawables[0].positions)
    EXPECT_EQ(positions.data(), frame->drawables[0].positions[0].data());
  EXPECT_FLOAT_EQ(posed->drawables[0].positions[1][0].z, 0.5f);
}

// A moment of a shutter is the scene at that time.
TEST(LightViews, AMomentOfAShutterIsTheSceneAtThatTime) {
  Capture capture;
  const int node = made::add_node(capture, made::closed_patches(made::add_material(capture)));
  test::add_motion(capture, node, {4, 0, 0});
  made::add_camera(capture, {0, 0, 9});
  const Assembly assembly = assemble(capture);
  FrameRequest request;
  request.open_time = 0.25, request.close_time = 0.75;
  const auto frame = pose_frame(assembly, choose_camera(capture, 64, 64), request);
  const auto moment = pose_moment(*frame, 0.75);
  EXPECT_FALSE(moment->any_motion);
  EXPECT_FLOAT_EQ(moment->drawables[0].to_world[1][3][0], 4 * (0.25f + 0.75f * 0.5f));
  EXPECT_EQ(moment->patterns.size(), frame->patterns.size());
  EXPECT_EQ(shadow_times(*frame, {.times = 2}), (std::vector<double>{0.25, 0.75}));
  EXPECT_TRUE(shadow_times(*moment, {.times = 2}).empty());
}

// Patches that meet have the same vertices on their edge, patches that the camera sees have its grids, and other
// patches have no more cells than they need.
TEST(LightViews, GridsOfTheCameraFitTogetherAndCostNothingOutsideOfTheImage) {
  test::Random random(11);
  int kept = 0, changed = 0, finer = 0;
  for (int round = 0; round < 40; ++round) {
    Capture capture;
    made::add_node(capture, made::closed_patches(made::add_material(capture)));
    capture.nodes[0].transform.scale = DVec3(3.0);
    made::add_light(capture, {}, DVec3(random.in_box(9)), DVec3(random.in_box(1)), {.size = 256});
    const int camera = made::add_camera(capture, DVec3(random.in_box(6)));
    capture.nodes[static_cast<std::size_t>(camera)].transform.rotation = made::looking(DVec3(random.in_box(1)));
    const Assembly assembly = assemble(capture);
    const auto frame = pose(assembly);
    const auto views = light_views(*frame, shadow_lights(*frame, {}), {}).front();
    const auto posed = pose_for_light(*frame, views.front(), {}),
               own = pose_for_light(*frame, views.front(), {.grids = CasterGrids::kLight});
    for (std::uint32_t patch = 0; patch < frame->patterns.size(); ++patch) {
      const TessellationPattern &pattern = posed->patterns[patch], &seen = frame->patterns[patch];
      ASSERT_LE(std::max(pattern.edge[0], pattern.edge[1]), pattern.nu);
      ASSERT_LE(std::max(pattern.edge[2], pattern.edge[3]), pattern.nv);
      ASSERT_LE(pattern.nu, seen.nu);
      const bool same = pattern.nu == seen.nu && pattern.nv == seen.nv && pattern.edge == seen.edge;
      (same ? kept : changed) += 1;
      finer += own->patterns[patch].nu > pattern.nu ? 1 : 0;
      for (std::size_t e = 0; e < 4; ++e) {
        const auto& owner = assembly.neighbours[0][patch].edges[e];
        if (!owner.collapsed) {
          ASSERT_EQ(pattern.edge[e], posed->patterns[owner.patch].edge[owner.edge]) << round;
        }
      }
    }
  }
  EXPECT_GT(kept, 60);
  EXPECT_GT(changed, 20);
  EXPECT_GT(finer, 0);
}

}  // namespace
}  // namespace tessera::scene::light_views_test

// KHR_lights_punctual from the file to where its lights shine.
#include "scene/frame_geometry.h"
#include "tests/support/read_asset.h"
#include "tests/support/tests.h"

namespace tessera::scene::lights_test {
namespace {

// One light on node 0 and its parent, node 1, beside a triangle.
Capture lit_by(const json& light, const json& node = json::object(), const json& parent = json::object()) {
  test::GltfAsset asset;
  const int points = asset.add_accessor<float>("VEC3", {0, 0, 0, 1, 0, 0, 0, 1, 0});
  json lamp = node, above = parent;
  lamp["extensions"]["KHR_lights_punctual"]["light"] = 0;
  above["children"] = {0};
  asset.add("meshes", {{"primitives", {{{"attributes", {{"POSITION", points}}}}}}});
  asset.add("nodes", lamp);
  asset.add("nodes", above);
  asset.add("nodes", {{"mesh", 0}});
  asset.add("scenes", {{"nodes", {1, 2}}});
  asset.document["extensionsUsed"] = {"KHR_lights_punctual"};
  asset.document["extensions"]["KHR_lights_punctual"]["lights"] = json::array({light});
  return test::read_asset(asset);
}

shaders::Light placed(const Capture& capture) {
  const Assembly assembly = assemble(capture);
  return pose_frame(assembly, choose_camera(capture, 32, 32), {})->lights[0].at(0);
}

TEST(PunctualLights, HaveTheDefaultsOfTheExtension) {
  const shaders::Light spot = lit_by({{"type", "spot"}, {"spot", json::object()}}).lights.at(0);
  EXPECT_EQ(spot.color, Vec3(1.0f));
  EXPECT_EQ(spot.range, 0.0f) << "unlimited";
  EXPECT_EQ(spot.cos_inner, 1.0f);
  EXPECT_NEAR(spot.cos_outer, std::sqrt(0.5f), 1e-7f);
  const shaders::Light bare = lit_by({{"type", "spot"}}).lights.at(0);
  EXPECT_EQ(bare.cos_inner, spot.cos_inner);
  EXPECT_EQ(bare.cos_outer, spot.cos_outer);
}

TEST(PunctualLights, ShineAlongMinusZFromTheirNode) {
  // A quarter turn about y takes -z to -x.
  const double s = std::sqrt(0.5);
  const shaders::Light light =
      placed(lit_by({{"type", "directional"}}, {{"rotation", {0, s, 0, s}}, {"translation", {1, 2, 3}}}));
  EXPECT_NEAR(light.direction.x, -1, 1e-6f);
  EXPECT_NEAR(light.direction.z, 0, 1e-6f);
  EXPECT_EQ(light.position, Vec3(1, 2, 3));
}

TEST(PunctualLights, ScaleMovesThemAndChangesNothingElse) {
  const json lamp = {{"type", "spot"}, {"intensity", 6}, {"range", 5}, {"spot", {{"outerConeAngle", 0.5}}}};
  const json turned = {{"rotation", {0, 0.6, 0, 0.8}}, {"translation", {1, 2, 3}}};
  json stretched = turned;
  stretched["scale"] = {2, 3, 4};
  const shaders::Light plain = placed(lit_by(lamp, turned));
  const shaders::Light own = placed(lit_by(lamp, stretched)),
                       above = placed(lit_by(lamp, turned, {{"scale", {7, 7, 7}}}));
  for (const shaders::Light& light : {own, above}) {
    EXPECT_EQ(light.color, plain.color);
    EXPECT_EQ(light.range, plain.range);
    EXPECT_EQ(light.cos_inner, plain.cos_inner);
    EXPECT_EQ(light.cos_outer, plain.cos_outer);
    EXPECT_LT(glm::length(light.direction - plain.direction), 1e-6f);
    EXPECT_NEAR(glm::length(light.direction), 1, 1e-6f);
  }
  EXPECT_EQ(own.position, plain.position);
  EXPECT_EQ(above.position, Vec3(7, 14, 21));
}

}  // namespace
}  // namespace tessera::scene::lights_test

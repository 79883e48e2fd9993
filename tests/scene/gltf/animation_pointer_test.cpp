// KHR_animation_pointer and KHR_node_visibility: the values that channels move, and their effect on a frame.
#include "base/error.h"
#include "scene/animation.h"
#include "scene/assembly.h"
#include "scene/frame_geometry.h"
#include "scene/pose.h"
#include "tests/support/read_asset.h"
#include "tests/support/tests.h"

namespace tessera::scene::animation_pointer_test {
namespace {

using test::GltfAsset;
using testing::Contains;
using testing::ElementsAre;

// everything_asset() with one more animation, which moves the value at `pointer` from the first half of `values` to
// the second within a second.
template <class T>
GltfAsset animated(const std::string& pointer, const char* type, const std::vector<T>& values,
                   const json& sampler = json::object(), const json& accessor = json::object()) {
  GltfAsset asset = test::everything_asset();
  for (const char* used : {"KHR_animation_pointer", "KHR_texture_transform", "KHR_node_visibility"})
    asset.document["extensionsUsed"].push_back(used);
  // Both are there to be animated.
  asset.document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] = {
      {"KHR_texture_transform", json::object()}};
  asset.document["materials"][0]["normalTexture"] = {{"index", 0}};
  asset.document["materials"][0]["occlusionTexture"] = {{"index", 0}};
  asset.document["nodes"][2]["extensions"]["KHR_node_visibility"] = {{"visible", true}};
  const int times = asset.add_accessor<float>("SCALAR", {0, 1}, {{"min", {0}}, {"max", {1}}});
  json full = {{"input", times}, {"output", asset.add_accessor(type, values, accessor)}};
  full.update(sampler);
  const json target = {{"path", "pointer"}, {"extensions", {{"KHR_animation_pointer", {{"pointer", pointer}}}}}};
  asset.add("animations", {{"channels", {{{"sampler", 0}, {"target", target}}}}, {"samplers", {full}}});
  return asset;
}

Material material_at(const Capture& capture, double time) {
  std::vector<Material> materials = {capture.materials[0]};
  animate_materials(capture, time, std::vector<int>{0}, materials);
  return materials[0];
}

TEST(AnimationPointer, MovesTheFactorsOfAMaterial) {
  const auto at_half = [](const char* rest, const char* type, std::vector<float> values) {
    const Capture capture =
        test::read_asset(animated(std::string("/materials/0/") + rest, type, values), {.strict = true});
    EXPECT_TRUE(capture.notices.empty());
    return material_at(capture, 0.5);
  };
  EXPECT_EQ(at_half("pbrMetallicRoughness/baseColorFactor", "VEC4", {0, 1, 0, 1, 1, 0, 0, 0}).base_color,
            Vec4(0.5f, 0.5f, 0, 0.5f));
  EXPECT_EQ(at_half("pbrMetallicRoughness/metallicFactor", "SCALAR", {0, 1}).metallic, 0.5f);
  EXPECT_EQ(at_half("pbrMetallicRoughness/roughnessFactor", "SCALAR", {0.5f, 1}).roughness, 0.75f);
  EXPECT_EQ(at_half("emissiveFactor", "VEC3", {0, 0, 0, 1, 0.5f, 0}).emissive, Vec3(0.5f, 0.25f, 0));
  EXPECT_EQ(at_half("alphaCutoff", "SCALAR", {0, 3}).alpha_cutoff, 1.5f);
  EXPECT_EQ(at_half("normalTexture/scale", "SCALAR", {0, 3}).normal_scale, 1.5f);
  EXPECT_EQ(at_half("occlusionTexture/strength", "SCALAR", {0, 1}).occlusion_strength, 0.5f);
}

TEST(AnimationPointer, MovesTheTransformationOfATexture) {
  const std::string base = "/materials/0/pbrMetallicRoughness/baseColorTexture/extensions/KHR_texture_transform/";
  const auto transform = [&](const char* member, const char* type, std::vector<float> values) {
    return material_at(test::read_asset(animated(base + member, type, values)), 0.5).base_color_texture.transform;
  };
  EXPECT_EQ(transform("offset", "VEC2", {0, 0, 1, 3}).offset, Vec2(0.5f, 1.5f));
  EXPECT_EQ(transform("scale", "VEC2", {1, 1, 3, 5}).apply(Vec2(1.0f)), Vec2(2.0f, 3.0f));
  const Vec2 turned = transform("rotation", "SCALAR", {0, 3.14159265f}).apply(Vec2(1, 0));
  EXPECT_NEAR(static_cast<double>(turned.x), 0, 1e-6);
  EXPECT_NEAR(static_cast<double>(turned.y), -1, 1e-6);
}

TEST(AnimationPointer, MovesNodesAsTheirOwnPathsDo) {
  const Capture capture =
      test::read_asset(animated<float>("/nodes/4/translation", "VEC3", {0, 0, 0, 2, 4, 6}), {.strict = true});
  EXPECT_EQ(DVec3(pose_at(capture, 0.5).world[4][3]), DVec3(1, 2, 3));
  const Capture turned = test::read_asset(animated<float>("/nodes/4/rotation", "VEC4", {0, 0, 0, 1, 1, 0, 0, 0}));
  EXPECT_NEAR(pose_at(turned, 0.5).world[4][1][2], 1, 1e-9) << "a quarter turn about x, by slerp";
  GltfAsset weights = animated<float>("/nodes/1/weights", "SCALAR", {0, 1});
  weights.document["animations"][0]["channels"].erase(3);
  EXPECT_THAT(pose_at(test::read_asset(weights), 0.25).weights[1], ElementsAre(0.25f));
}

TEST(AnimationPointer, MovesCamerasAndLightsAtShutterOpen) {
  const Camera opened = animate_camera(
      test::read_asset(animated<float>("/cameras/0/perspective/yfov", "SCALAR", {0.5f, 1.5f})), 0.5, 0, {});
  EXPECT_EQ(opened.vertical_fov, 1.0f);
  const Capture wide = test::read_asset(animated<float>("/cameras/1/orthographic/xmag", "SCALAR", {1, 3}));
  EXPECT_EQ(animate_camera(wide, 0.5, 1, wide.cameras[1]).x_mag, 2.0f);
  EXPECT_EQ(animate_camera(wide, 0.5, 0, wide.cameras[0]).x_mag, wide.cameras[0].x_mag);
  const std::string light = "/extensions/KHR_lights_punctual/lights/0/";
  EXPECT_EQ(
      animate_lights(test::read_asset(animated<float>(light + "color", "VEC3", {0, 0, 0, 1, 0.5f, 0})), 0.5)[0].color,
      Vec3(0.5f, 0.25f, 0));
  EXPECT_EQ(animate_lights(test::read_asset(animated<float>(light + "intensity", "SCALAR", {0, 6})), 0.5)[0].color,
            Vec3(3.0f));
  EXPECT_EQ(animate_lights(test::read_asset(animated<float>(light + "range", "SCALAR", {10, 20})), 0.5)[0].range,
            15.0f);
  EXPECT_NEAR(
      static_cast<double>(
          animate_lights(test::read_asset(animated<float>(light + "spot/outerConeAngle", "SCALAR", {0.6f, 1})), 0.5)[0]
              .cos_outer),
      std::cos(0.8), 1e-6);
}

TEST(AnimationPointer, FramesTakeMaterialsLightsAndCameraWhereTheShutterOpens) {
  GltfAsset asset =
      animated<float>("/materials/0/pbrMetallicRoughness/baseColorFactor", "VEC4", {0, 0, 0, 1, 1, 1, 1, 1});
  json more = asset.document["animations"][1];
  asset.add_accessor<float>("SCALAR", {0.5f, 1.5f});
  more["samplers"][0]["output"] = asset.document["accessors"].size() - 1;
  more["channels"][0]["target"]["extensions"]["KHR_animation_pointer"]["pointer"] = "/cameras/0/perspective/yfov";
  asset.document["animations"].push_back(more);
  const Capture capture = test::read_asset(asset);
  const Assembly assembly = assemble(capture);
  FrameRequest request;
  request.width = request.height = 100;
  request.open_time = 0.5;
  request.close_time = 1.0;
  const auto frame = pose_frame(assembly, choose_camera(capture, 100, 100), request);
  EXPECT_EQ(frame->drawables[0].material->base_color, Vec4(0.5f, 0.5f, 0.5f, 1));
  EXPECT_EQ(frame->drawables[0].material->base_color_texture.texture, capture.materials[0].base_color_texture.texture);
  EXPECT_NEAR(frame->projection.scale, 50 / std::tan(0.5), 1e-9);
  request.open_time = 0.25;
  EXPECT_NE(pose_frame(assembly, choose_camera(capture, 100, 100), request)->material_values, frame->material_values);
}

TEST(AnimationPointer, ValuesWithoutAChannelStay) {  // AV1
  const Capture capture = test::read_asset(animated<float>("/materials/1/alphaCutoff", "SCALAR", {0, 1}));
  const Material &before = capture.materials[0], after = material_at(capture, 0.5);
  EXPECT_EQ(after.alpha_cutoff, before.alpha_cutoff);
  EXPECT_EQ(after.base_color, before.base_color);
  EXPECT_EQ(animate_lights(capture, 0.5)[0].color, capture.lights[0].color);
  EXPECT_EQ(animate_lights(capture, 0.5)[0].cos_inner, capture.lights[0].cos_inner);
  EXPECT_EQ(animate_camera(capture, 0.5, 0, capture.cameras[0]).vertical_fov, capture.cameras[0].vertical_fov);
}

TEST(AnimationPointer, ValuesStayInTheRangesOfTheirProperties) {  // AV2
  const std::string pbr = "/materials/0/pbrMetallicRoughness/";
  EXPECT_EQ(material_at(test::read_asset(animated<float>(pbr + "roughnessFactor", "SCALAR", {-1, 5})), 1).roughness,
            1.0f);
  EXPECT_EQ(material_at(test::read_asset(animated<float>(pbr + "roughnessFactor", "SCALAR", {-1, 5})), 0).roughness,
            0.0f);
  for (const float fov : {-1.0f, 0.0f, 4.0f, 3e38f}) {
    const Camera camera = animate_camera(
        test::read_asset(animated<float>("/cameras/0/perspective/yfov", "SCALAR", {fov, fov})), 0, 0, {});
    EXPECT_TRUE(camera.vertical_fov > 0 && camera.vertical_fov < 3.1416f) << fov;
  }
  for (const char* plane : {"znear", "zfar"}) {
    const Capture capture =
        test::read_asset(animated<float>(std::string("/cameras/0/perspective/") + plane, "SCALAR", {-5, 1e30f}));
    for (const double time : {0.0, 1.0}) {
      const Camera camera = animate_camera(capture, time, 0, capture.cameras[0]);
      EXPECT_TRUE(camera.near > 0 && camera.far > camera.near) << plane;
    }
  }
}

TEST(AnimationPointer, IntegersAreValuesToo) {
  const std::string pointer = "/materials/0/pbrMetallicRoughness/metallicFactor";
  const auto at = [&](const GltfAsset& asset) { return material_at(test::read_asset(asset), 0).metallic; };
  EXPECT_EQ(at(animated<std::uint8_t>(pointer, "SCALAR", {1, 0})), 1.0f);
  EXPECT_EQ(at(animated<std::uint8_t>(pointer, "SCALAR", {51, 0}, json::object(), {{"normalized", true}})), 0.2f);
}

TEST(AnimationPointer, UnreadTargetsAreSkippedWithOneNote) {
  GltfAsset asset =
      animated<float>("/materials/0/extensions/KHR_materials_subsurface/subsurfaceFactor", "SCALAR", {0, 1});
  json more = asset.document["animations"][1];
  more["channels"][0]["target"]["extensions"]["KHR_animation_pointer"]["pointer"] = "/nodes/0/weights/0";
  asset.document["animations"].push_back(more);
  const Capture capture = test::read_asset(asset, {.strict = true});
  EXPECT_THAT(capture.notices, ElementsAre(testing::AllOf(HasSubstr("channels of unread properties are skipped"),
                                                          HasSubstr("subsurfaceFactor"), HasSubstr("and 1 more"))));
  EXPECT_TRUE(capture.animations[1].channels.empty() && capture.animations[2].channels.empty());
  EXPECT_THAT(test::read_asset(animated<float>("/materials/1/normalTexture/scale", "SCALAR", {0, 1})).notices,
              ElementsAre(HasSubstr("which the asset does not have")));
}

TEST(AnimationPointer, ThatDoesNotFitIsRefused) {
  const auto refused = [](const GltfAsset& asset, const char* fault) {
    try {
      test::read_asset(asset);
      ADD_FAILURE() << "read: " << fault;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr(fault));
    }
  };
  refused(animated<float>("/materials/7/alphaCutoff", "SCALAR", {0, 1}), "points at /materials/7, there are 2");
  refused(animated<float>("/materials/0/alphaCutoff", "VEC2", {0, 1, 0, 1}), "type VEC2");
  refused(animated<float>("/materials/0/alphaCutoff", "SCALAR", {0, 1, 2}), "3 output values for 2 keys");
  refused(animated<float>("/nodes/7/translation", "VEC3", {0, 0, 0, 1, 1, 1}), "has a matrix");
  refused(animated<float>("/nodes/0/weights", "SCALAR", {0, 1}), "without a mesh");
  refused(animated<float>("/nodes/2/extensions/KHR_node_visibility/visible", "SCALAR", {0, 1}), "component type 5126");
  GltfAsset twice = animated<float>("/nodes/2/translation", "VEC3", {0, 0, 0, 1, 1, 1});
  json& animations = twice.document["animations"];
  animations[1]["channels"].push_back({{"sampler", 0}, {"target", {{"node", 2}, {"path", "translation"}}}});
  EXPECT_THROW(test::read_asset(twice, {.strict = true}), InputError);  // without, the last one counts
}

// ---- Visibility -------------------------------------------------------------------------------------------------

TEST(NodeVisibility, HidesANodeWithAllBelowItAndItsLights) {
  GltfAsset asset = test::everything_asset();
  asset.document["nodes"][2]["children"] = {3, 7};
  asset.document["nodes"][0]["children"] = {1, 2, 4, 5, 6};
  asset.document["nodes"][3]["mesh"] = 1;
  asset.document["nodes"][2]["extensions"]["KHR_node_visibility"] = {{"visible", false}};
  asset.document["nodes"][3]["extensions"]["KHR_node_visibility"] = {{"visible", true}};
  asset.document["extensionsRequired"] = {"KHR_node_visibility"};
  asset.document["extensionsUsed"].push_back("KHR_node_visibility");
  const Capture capture = test::read_asset(asset, {.strict = true});
  EXPECT_THAT(pose_at(capture, 0).visible, ElementsAre(true, true, false, false, true, true, true, false));
  const Assembly assembly = assemble(capture);
  const auto frame = pose_frame(assembly, choose_camera(capture, 64, 32), {});
  for (const PosedDrawable& drawable : frame->drawables) EXPECT_EQ(drawable.visible, drawable.drawable->node != 3);
  EXPECT_TRUE(frame->lights[0].empty() && frame->lights[1].empty());
}

TEST(NodeVisibility, IsAnimatedInSteps) {
  const char* pointer = "/nodes/2/extensions/KHR_node_visibility/visible";
  const GltfAsset asset = animated<std::uint8_t>(pointer, "SCALAR", {1, 0}, {{"interpolation", "STEP"}});
  const Capture capture = test::read_asset(asset, {.strict = true});
  EXPECT_TRUE(pose_at(capture, 0.99).visible[3]);
  EXPECT_FALSE(pose_at(capture, 1).visible[3]);
  const GltfAsset linear = animated<std::uint8_t>(pointer, "SCALAR", {1, 0});
  EXPECT_TRUE(pose_at(test::read_asset(linear), 0.99).visible[3]) << "in steps all the same";
  EXPECT_THROW(test::read_asset(linear, {.strict = true}), InputError);
}

TEST(NodeVisibility, HiddenNodesDoNotCountForTheAutomaticCamera) {
  Capture capture;
  test::add_node(capture, test::triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {0, 1, 2}));
  const DMat4 first = choose_camera(capture, 64, 64).fixed_world;
  test::add_node(capture, test::triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {0, 1, 2}), DVec3(5, 0, 0));
  EXPECT_NE(choose_camera(capture, 64, 64).fixed_world, first);
  capture.nodes[1].visible = false;
  EXPECT_EQ(choose_camera(capture, 64, 64).fixed_world, first);
}

}  // namespace
}  // namespace tessera::scene::animation_pointer_test

#include "scene/pose.h"
#include "tests/support/read_asset.h"
#include "tests/support/tests.h"

namespace tessera::scene::capture_reader_test {
namespace {

using test::GltfAsset;

// everything_asset() with some members replaced, by JSON pointer.
Capture read_with(const std::vector<std::pair<const char*, json>>& edits) {
  GltfAsset asset = test::everything_asset();
  for (const auto& [pointer, value] : edits) asset.document[json::json_pointer(pointer)] = value;
  return test::read_asset(asset);
}

// ---- Files ------------------------------------------------------------------------------------------------------

void expect_same_geometry(const Capture& a, const Capture& b) {
  ASSERT_EQ(a.meshes.size(), b.meshes.size());
  for (std::size_t m = 0; m < a.meshes.size(); ++m) {
    EXPECT_EQ(a.meshes[m].primitives.at(0).vertices.positions, b.meshes[m].primitives.at(0).vertices.positions);
    EXPECT_EQ(a.meshes[m].primitives.at(0).indices, b.meshes[m].primitives.at(0).indices);
  }
  ASSERT_EQ(a.materials.size(), b.materials.size());
  EXPECT_EQ(a.materials[0].base_color_texture.texture->texel(0, 1, 2),
            b.materials[0].base_color_texture.texture->texel(0, 1, 2));
}

TEST(CaptureFiles, MeanTheSameAsGlbDataUriOrFilesBeside) {
  const GltfAsset asset = test::everything_asset();
  const Capture glb = test::read_asset(asset);
  const test::TemporaryFolder folder;
  test::write_text(folder / "data.gltf", asset.gltf());
  expect_same_geometry(read_capture(folder / "data.gltf"), glb);
  std::filesystem::create_directory(folder / "dir");
  for (const auto& [uri, file] :
       {std::pair{"a.bin", "a.bin"}, {"dir/b%20c.bin", "dir/b c.bin"}, {"./dir/../%64.bin", "d.bin"}}) {
    test::write_text(folder / file, std::string(asset.binary.begin(), asset.binary.end()));
    test::write_text(folder / "files.gltf", asset.gltf_with_file(uri));
    const Capture capture = read_capture(folder / "files.gltf");
    expect_same_geometry(capture, glb);
    EXPECT_EQ(capture.file_bytes, std::filesystem::file_size(folder / "files.gltf") + asset.binary.size()) << uri;
  }
}

// ---- Scene ------------------------------------------------------------------------------------------------------

TEST(CaptureScene, PlacesNodesAsTransformsAndMatricesSay) {
  const double half = std::sqrt(0.5);
  const Capture capture = read_with(
      {{"/nodes/0/translation", {1, 2, 3}}, {"/nodes/3/rotation", {0, 0, half, half}}, {"/nodes/3/scale", {2, 3, 4}}});
  const Pose pose = pose_at(
      [&] {
        Capture still = capture;
        still.played_animations.clear();
        return still;
      }(),
      0);
  // Node 3 inside 2 (identity) inside 0: x is scaled by 2, turned to y, and moved by (0,1,0) and (1,2,3).
  const DVec4 p = pose.world[3] * DVec4(1, 0, 0, 1);
  EXPECT_NEAR(p.x, 1, 1e-12);
  EXPECT_NEAR(p.y, 5, 1e-12);
  EXPECT_NEAR(p.z, 3, 1e-12);
  // Node 7 has a matrix whose fourth column is (0,2,0).
  EXPECT_EQ(pose.world[7] * DVec4(0, 0, 0, 1), DVec4(1, 4, 3, 1));
}

TEST(CaptureScene, DrawsTheDefaultSceneElseTheFirstElseEveryRoot) {
  EXPECT_EQ(read_with({{"/scenes/1", {{"nodes", json::array()}}}, {"/scene", 1}}).roots, std::vector<int>{});
  GltfAsset asset = test::everything_asset();
  asset.document.erase("scene");
  EXPECT_EQ(test::read_asset(asset).roots, std::vector<int>{0});
  asset.document.erase("scenes");
  asset.add("nodes", json::object());
  EXPECT_EQ(test::read_asset(asset).roots, (std::vector<int>{0, 8}));
}

TEST(CaptureScene, KeepsSkinsWithTheirInverseBindMatrices) {
  const Capture capture = test::read_asset(test::everything_asset());
  ASSERT_EQ(capture.skins.size(), 1u);
  EXPECT_EQ(capture.skins[0].joints, (std::vector<int>{2, 3}));
  EXPECT_EQ(capture.skins[0].inverse_bind[0], DMat4(1.0));
  GltfAsset without = test::everything_asset();
  without.document["skins"][0].erase("inverseBindMatrices");
  EXPECT_EQ(test::read_asset(without).skins[0].inverse_bind[1], DMat4(1.0)) << "the default is the identity";
}

TEST(CaptureScene, ReadsCameras) {
  const Capture capture = read_with({{"/cameras/1/orthographic/xmag", -2.5}, {"/cameras/1/orthographic/ymag", 1.5}});
  const Camera &perspective = capture.cameras.at(0), &orthographic = capture.cameras.at(1);
  EXPECT_EQ(perspective.type, Camera::Type::kPerspective);
  EXPECT_EQ(perspective.vertical_fov, 0.8f);
  EXPECT_EQ(perspective.near, 0.1f);
  EXPECT_EQ(perspective.far, 100.0f);
  EXPECT_EQ(perspective.lens.aperture_radius, 0.1f);
  EXPECT_EQ(perspective.lens.focus_distance, 5.0f);
  EXPECT_EQ(orthographic.type, Camera::Type::kOrthographic);
  EXPECT_EQ(orthographic.x_mag, 2.5f) << "half extents have no sign";
  EXPECT_EQ(orthographic.y_mag, 1.5f);
  EXPECT_EQ(orthographic.lens.aperture_radius, 0.0f);
  GltfAsset endless = test::everything_asset();
  endless.document["cameras"][0]["perspective"].erase("zfar");
  endless.document["cameras"][0]["extensions"]["TESSERA_lens"].erase("focusDistance");
  EXPECT_EQ(test::read_asset(endless).cameras[0].far, 0.0f);
  EXPECT_EQ(test::read_asset(endless).cameras[0].lens.focus_distance, std::numeric_limits<float>::infinity());
}

TEST(CaptureScene, ReadsLights) {
  const char* light = "/extensions/KHR_lights_punctual/lights/0";
  const Capture spot = read_with({{"/extensions/KHR_lights_punctual/lights/0/color", {0.5, 1, 0}},
                                  {"/extensions/KHR_lights_punctual/lights/0/intensity", 8}});
  EXPECT_EQ(spot.lights.at(0).type, shaders::Light::Type::kSpot);
  EXPECT_EQ(spot.lights[0].color, Vec3(4, 8, 0));
  EXPECT_EQ(spot.lights[0].range, 10.0f);
  EXPECT_NEAR(static_cast<double>(spot.lights[0].cos_inner), std::cos(0.2), 1e-7);
  EXPECT_NEAR(static_cast<double>(spot.lights[0].cos_outer), std::cos(0.6), 1e-7);
  EXPECT_EQ(spot.nodes[7].light, 0);
  EXPECT_EQ(read_with({{light, {{"type", "point"}}}}).lights.at(0).type, shaders::Light::Type::kPoint);
  EXPECT_EQ(read_with({{light, {{"type", "directional"}}}}).lights.at(0).color, Vec3(1.0f));
}

TEST(CaptureScene, ReadsAnimationsWithTheirDuration) {
  const Capture capture = test::read_asset(test::everything_asset());
  const Animation& animation = capture.animations.at(0);
  ASSERT_EQ(animation.channels.size(), 4u);
  EXPECT_EQ(animation.duration(), 1.0f);
  EXPECT_EQ(animation.channels[0].interpolation, Interpolation::kLinear);
  EXPECT_EQ(animation.channels[1].interpolation, Interpolation::kStep);
  EXPECT_EQ(animation.channels[2].interpolation, Interpolation::kCubicSpline);
  EXPECT_EQ(animation.channels[3].path, AnimatedPath::kWeights);
  EXPECT_EQ(animation.channels[3].components, 1);
  EXPECT_EQ(animation.channels[2].values.size(), 2u * 3u * 3u);
  EXPECT_EQ(capture.played_animations, std::vector<int>{0});
}

TEST(CaptureScene, PlaysOnlyAnimationsThatDoNotFight) {
  GltfAsset asset = test::everything_asset();
  json baseline = asset.document["animations"][0], friendly = baseline;
  friendly["channels"] = json::array({{{"sampler", 0}, {"target", {{"node", 4}, {"path", "translation"}}}}});
  asset.add("animations", baseline);
  asset.add("animations", friendly);
  EXPECT_EQ(test::read_asset(asset).played_animations, (std::vector<int>{0, 2}));
}

// ---- Materials --------------------------------------------------------------------------------------------------

TEST(CaptureMaterials, ReadFactorsAndDefaults) {
  const Capture capture =
      read_with({{"/materials/0",
                  {{"pbrMetallicRoughness",
                    {{"baseColorFactor", {0.1, 0.2, 0.3, 0.4}}, {"metallicFactor", 0.25}, {"roughnessFactor", 0.75}}},
                   {"emissiveFactor", {0.5, 0.25, 1}},
                   {"alphaMode", "MASK"},
                   {"alphaCutoff", 0.7},
                   {"doubleSided", true},
                   {"extensions", {{"KHR_materials_unlit", json::object()}}}}},
                 {"/materials/2", {{"alphaMode", "BLEND"}}}});
  const Material &full = capture.materials.at(0), &plain = capture.materials.at(2);
  EXPECT_EQ(full.base_color, Vec4(0.1f, 0.2f, 0.3f, 0.4f));
  EXPECT_EQ(full.metallic, 0.25f);
  EXPECT_EQ(full.roughness, 0.75f);
  EXPECT_EQ(full.emissive, Vec3(0.5f, 0.25f, 1.0f));
  EXPECT_EQ(full.alpha_mode, AlphaMode::kMask);
  EXPECT_EQ(full.alpha_cutoff, 0.7f);
  EXPECT_TRUE(full.double_sided && full.unlit);
  EXPECT_EQ(plain.base_color, Vec4(1.0f));
  EXPECT_EQ(plain.metallic, 1.0f);
  EXPECT_EQ(plain.roughness, 1.0f);
  EXPECT_EQ(plain.emissive, Vec3(0.0f));
  EXPECT_EQ(plain.alpha_mode, AlphaMode::kBlend);
  EXPECT_FALSE(plain.double_sided || plain.unlit || plain.base_color_texture.texture);
}

TEST(CaptureMaterials, ReadSamplers) {
  struct Row {
    int filter;
    bool linear;
    shaders::MipFilter mip;
  };
  for (const Row& row : {Row{9728, false, shaders::MipFilter::kNone},
                         {9729, true, shaders::MipFilter::kNone},
                         {9984, false, shaders::MipFilter::kNearest},
                         {9985, true, shaders::MipFilter::kNearest},
                         {9986, false, shaders::MipFilter::kLinear},
                         {9987, true, shaders::MipFilter::kLinear}}) {
    const Capture capture = read_with(
        {{"/samplers/0", {{"minFilter", row.filter}, {"magFilter", 9728}, {"wrapS", 33071}, {"wrapT", 33648}}}});
    const shaders::Sampler& sampler = capture.materials.at(0).base_color_texture.sampler;
    EXPECT_EQ(sampler.minify_linear, row.linear) << row.filter;
    EXPECT_EQ(sampler.mip, row.mip) << row.filter;
    EXPECT_FALSE(sampler.magnify_linear);
    EXPECT_EQ(sampler.wrap_s, shaders::Wrap::kClampToEdge);
    EXPECT_EQ(sampler.wrap_t, shaders::Wrap::kMirroredRepeat);
  }
}

TEST(CaptureMaterials, TransformTextureCoordinatesByOffsetTurnAndScale) {
  const double turn = 0.3;
  const Capture capture =
      read_with({{"/materials/0/pbrMetallicRoughness/baseColorTexture",
                  {{"index", 0},
                   {"texCoord", 5},
                   {"extensions",
                    {{"KHR_texture_transform",
                      {{"offset", {0.1, 0.2}}, {"rotation", turn}, {"scale", {2, 3}}, {"texCoord", 0}}}}}}}});
  const TextureSlot& slot = capture.materials.at(0).base_color_texture;
  EXPECT_EQ(slot.texcoord, 0) << "the extension's set overrides";
  const Vec2 uv(0.7f, 0.4f), got = slot.transform.matrix * uv + slot.transform.offset;
  // Scaled to (1.4, 1.2), turned counter-clockwise with v pointing down, moved.
  EXPECT_NEAR(static_cast<double>(got.x), 1.4 * std::cos(turn) + 1.2 * std::sin(turn) + 0.1, 1e-6);
  EXPECT_NEAR(static_cast<double>(got.y), -1.4 * std::sin(turn) + 1.2 * std::cos(turn) + 0.2, 1e-6);
}

TEST(CaptureMaterials, ReadDisplacement) {
  const Capture capture = read_with({{"/materials/1/extensions/TESSERA_displacement/bias", -0.5}});
  EXPECT_FALSE(capture.materials.at(0).displacement.has_value());
  const Displacement& displacement = capture.materials.at(1).displacement.value();
  EXPECT_EQ(displacement.scale, 0.1f);
  EXPECT_EQ(displacement.bias, -0.5f);
  // Texel (x, y) of the 4 x 4 image has the red value 5 * 3 * (4 y + x).
  const auto& level = displacement.texture->levels().at(0);
  for (std::size_t k = 0; k < 16; ++k)
    EXPECT_NEAR(static_cast<double>(level.values[k]), static_cast<double>((15 * k) % 256) / 255.0, 1e-7);
}

// ---- Settings ---------------------------------------------------------------------------------------------------

TEST(CaptureSettings, AreReadFromTheExtension) {
  const CaptureSettings s = test::read_asset(test::everything_asset()).settings;
  EXPECT_TRUE(s.declared);
  EXPECT_EQ(s.width, 64);
  EXPECT_EQ(s.height, 32);
  EXPECT_EQ(s.frame_rate, 24.0);
  EXPECT_EQ(s.shutter_open, 0.0);
  EXPECT_EQ(s.shutter_close, 0.5);
  EXPECT_EQ(s.first_frame, 0);
  EXPECT_EQ(s.frame_count, 2);
  EXPECT_EQ(s.camera_node, 4);
  EXPECT_EQ(s.exposure, 1.0f);
  EXPECT_EQ(s.environment, 1.0f);
  EXPECT_EQ(s.background, Vec3(0.0f));
}

TEST(CaptureSettings, HaveTheDocumentedDefaults) {
  GltfAsset asset = test::everything_asset();
  asset.document["extensions"].erase("TESSERA_capture");
  const CaptureSettings undeclared = test::read_asset(asset).settings;
  EXPECT_FALSE(undeclared.declared);
  asset.document["extensions"]["TESSERA_capture"] = json::object();
  const CaptureSettings empty = test::read_asset(asset).settings;
  EXPECT_TRUE(empty.declared);
  for (const CaptureSettings& s : {undeclared, empty}) {
    EXPECT_EQ(s.width, 1280);
    EXPECT_EQ(s.height, 720);
    EXPECT_EQ(s.frame_rate, 30.0);
    EXPECT_EQ(s.shutter_open, s.shutter_close);
    EXPECT_EQ(s.camera_node, kNone);
    EXPECT_FALSE(s.environment.has_value() || s.background.has_value());
  }
}

}  // namespace
}  // namespace tessera::scene::capture_reader_test

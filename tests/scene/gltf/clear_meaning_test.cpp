// A file that breaks glTF and has one meaning is read as it is meant, with a note; strictly it is refused at its place.
#include "base/error.h"
#include "base/image_codec.h"
#include "base/png_codec.h"
#include "scene/animation.h"
#include "scene/assembly.h"
#include "scene/capture_reader.h"
#include "scene/pose.h"
#include "tests/support/read_asset.h"
#include "tests/support/tests.h"

namespace tessera::scene::clear_meaning_test {
namespace {

using test::GltfAsset;
using testing::Contains;

struct Clear {
  const char* pointer;  // where the value is put
  json value;
  const char *place, *fault;  // of the note, and of the refusal
};

GltfAsset with(const char* pointer, const json& value) {
  GltfAsset asset = test::everything_asset();
  asset.document[json::json_pointer(pointer)] = value;
  return asset;
}

void expect_clear(const GltfAsset& asset, const std::string& place, const std::string& fault) {
  const Capture capture = test::read_asset(asset);
  EXPECT_THAT(capture.notices, Contains(testing::AllOf(HasSubstr(place), HasSubstr(fault))));
  EXPECT_THROW(test::read_asset(asset, {.strict = true}), InputError);
}

TEST(ClearMeaning, OfAValueIsReadWithANote) {  // NT1
  const std::vector<Clear> cases = {
      {"/nodes/3/name", nullptr, "/nodes/3/name", "is null"},
      {"/nodes/1/skin", nullptr, "/nodes/1/skin", "is null"},
      {"/materials/0/alphaCutoff", nullptr, "/materials/0/alphaCutoff", "is null"},
      {"/meshes/0/primitives/0/material", nullptr, "/meshes/0/primitives/0/material", "is null"},
      {"/nodes/3/name", 7, "/nodes/3/name", "is not a text"},
      {"/materials/0/pbrMetallicRoughness/baseColorFactor",
       {1, 1, 1, 1.0000001},
       "baseColorFactor/3",
       "outside [0, 1]"},
      {"/materials/0/pbrMetallicRoughness/metallicFactor", 1.0000001, "metallicFactor", "outside [0, 1]"},
      {"/materials/0/pbrMetallicRoughness/roughnessFactor", -1e-9, "roughnessFactor", "outside [0, 1]"},
      {"/materials/0/emissiveFactor", {0, 2, 0}, "emissiveFactor/1", "outside [0, 1]"},
      {"/materials/0/extensions",
       {{"KHR_materials_clearcoat", {{"clearcoatFactor", 1.0001}}}},
       "clearcoatFactor",
       "outside"},
      {"/samplers/0/magFilter", 9987, "/samplers/0/magFilter", "a filter of mip levels"},
      {"/nodes/2/rotation", {0, 0, 1, 1}, "/nodes/2/rotation", "is not a unit quaternion"},
      {"/nodes/7/matrix/4", 1, "/nodes/7/matrix", "shears"},
      {"/nodes/7/matrix/15", 1.000001, "/nodes/7/matrix", "nearly"},
      {"/extensions/KHR_lights_punctual/lights/0/spot/innerConeAngle", 0.6, "/lights/0/spot", "inner cone"},
      {"/accessors/14/sparse/count", 0, "/accessors/14/sparse/count", "is 0"},
      {"/accessors/17", {{"componentType", 5126}, {"count", 0}, {"type", "VEC3"}}, "/accessors/17/count", "is 0"},
  };
  for (const Clear& clear : cases) {
    SCOPED_TRACE(clear.pointer + clear.value.dump());
    expect_clear(with(clear.pointer, clear.value), clear.place, clear.fault);
  }
}

TEST(ClearMeaning, FactorsAreTheNearestInsideAndLightIsAsBrightAsItSays) {
  const Capture capture = test::read_asset(with("/materials/0/emissiveFactor", {-1e-9, 2, 0.5}));
  EXPECT_EQ(capture.materials[0].emissive_factor, Vec3(0, 2, 0.5f));
  EXPECT_EQ(test::read_asset(with("/materials/0/pbrMetallicRoughness/metallicFactor", 1.0001)).materials[0].metallic,
            1.0f);
  EXPECT_EQ(test::read_asset(with("/materials/0/pbrMetallicRoughness/metallicFactor", -0.0001)).materials[0].metallic,
            0.0f);
}

TEST(ClearMeaning, ARotationIsNormalisedAndAMatrixTakenAsItIs) {
  const Capture turned = test::read_asset(with("/nodes/2/rotation", {0, 0, 3, 3}));
  EXPECT_NEAR(glm::length(turned.nodes[2].transform.rotation), 1.0, 1e-12);
  EXPECT_NEAR(turned.nodes[2].transform.rotation.z, std::sqrt(0.5), 1e-12);
  const Capture sheared = test::read_asset(with("/nodes/7/matrix/4", 1));
  EXPECT_EQ((*sheared.nodes[7].matrix)[1][0], 1.0);
}

// Keys of node 2's translation.
GltfAsset with_times(const std::vector<float>& times) {
  GltfAsset asset = test::everything_asset();
  for (std::size_t k = 0; k < times.size(); ++k) asset.poke(test::kTimes, k, times[k]);
  return asset;
}

const AnimationChannel& translation_of(const Capture& capture, int node) {
  for (const AnimationChannel& channel : capture.animations.at(0).channels)
    if (channel.path == AnimatedPath::kTranslation && channel.node == node) return channel;
  throw std::runtime_error("no such channel");
}

TEST(ClearMeaning, KeysBeforeZeroAreReadAndTwoAtOneTimeAreAJump) {
  const GltfAsset before = with_times({-1.0f, 0.5f, 1.0f});
  expect_clear(before, "/accessors/8", "key time 0 is negative");
  EXPECT_EQ(translation_of(test::read_asset(before), 2).times[0], -1.0f);
  for (const std::vector<float>& times : {std::vector<float>{0, 0, 1}, {0, 1, 1}, {0.5f, 0.5f, 0.5f}, {0, 0, 0}}) {
    const GltfAsset asset = with_times(times);
    expect_clear(asset, "/accessors/8", "does not increase");
    const Capture capture = test::read_asset(asset);
    const AnimationChannel& channel = translation_of(capture, 2);
    for (std::size_t k = 0; k < 3; ++k) {
      if (k > 0) {
        EXPECT_GT(channel.times[k], channel.times[k - 1]);
      }
      EXPECT_NEAR(channel.times[k], times[k], 1e-5f);
    }
    for (const double time : {-1.0, 0.0, 0.25, 0.5, 1.0, 2.0})
      for (const double v : evaluate_channel(channel, time)) {
        EXPECT_TRUE(std::isfinite(v));
      }
  }
  EXPECT_THROW(test::read_asset(with_times({0, 0.5f, 0.25f})), InputError);
}

TEST(ClearMeaning, OfTwoChannelsThatMoveTheSameTheLastOneCounts) {
  GltfAsset asset = test::everything_asset();
  json& channels = asset.document["animations"][0]["channels"];
  json twin = channels[0];
  const int other = asset.add_accessor("VEC3", std::vector<float>{9, 9, 9, 9, 9, 9, 9, 9, 9});
  asset.document["animations"][0]["samplers"].push_back({{"input", test::kTimes}, {"output", other}});
  twin["sampler"] = asset.document["animations"][0]["samplers"].size() - 1;
  channels.push_back(twin);
  expect_clear(asset, "/animations/0/channels/4/target", "is animated twice");
  EXPECT_EQ(translation_of(test::read_asset(asset), 2).values[0], 9.0f);
  // A pointer at the same is the same.
  channels.back()["target"] = {{"path", "pointer"},
                               {"extensions", {{"KHR_animation_pointer", {{"pointer", "/nodes/2/translation"}}}}}};
  expect_clear(asset, "/animations/0/channels/4/target", "is animated twice");
  const Capture capture = test::read_asset(asset);
  EXPECT_EQ(translation_of(capture, 2).values[0], 9.0f);
  EXPECT_EQ(capture.animations[0].channels.size(), 4u);
}

TEST(ClearMeaning, EmptyPartsDrawNothing) {
  GltfAsset asset = test::everything_asset();
  asset.document["accessors"].push_back({{"componentType", 5126}, {"count", 0}, {"type", "VEC3"}});
  const std::size_t empty = asset.document["accessors"].size() - 1;
  asset.document["meshes"].push_back({{"primitives", {{{"attributes", {{"POSITION", empty}}}}}}});
  asset.document["nodes"].push_back({{"mesh", 2}});
  asset.document["nodes"].push_back(
      {{"mesh", 0}, {"extensions", {{"EXT_mesh_gpu_instancing", {{"attributes", {{"TRANSLATION", empty}}}}}}}});
  for (const int node : {8, 9}) asset.document["scenes"][0]["nodes"].push_back(node);
  expect_clear(asset, "/accessors/17/count", "is 0");
  EXPECT_EQ(assemble(test::read_asset(asset)).drawables.size(),
            assemble(test::read_asset(test::everything_asset())).drawables.size());
}

TEST(ClearMeaning, AnIndexThatRestartsBeginsAPrimitiveAnew) {
  for (const int mode : {0, 1, 2, 3, 4, 5, 6}) {
    const auto indices_with = [&](auto restart) {
      GltfAsset asset = test::everything_asset();
      std::vector<decltype(restart)> indices = {0, 1, 2, restart, 1, 2, 3, 0};
      json& primitive = asset.document["meshes"][0]["primitives"][0];
      primitive["indices"] = asset.add_accessor("SCALAR", indices);
      primitive["mode"] = mode;
      return asset;
    };
    const std::vector<GltfAsset> assets = {indices_with(std::uint8_t{255}), indices_with(std::uint16_t{65535}),
                                           indices_with(std::uint32_t{4294967295u})};
    // Points and whole lines or triangles of the two runs.
    const std::size_t wanted[] = {7, 1 + 2, 3 + 4, 2 + 3, 1 + 1, 1 + 2, 1 + 2};
    const std::size_t per_part = mode == 0 || mode < 4 ? 6 : 3;
    for (const GltfAsset& asset : assets) {
      SCOPED_TRACE(mode);
      expect_clear(asset, "/accessors/17", "restarts primitives");
      const Capture capture = test::read_asset(asset);
      EXPECT_EQ(capture.meshes[0].primitives.at(0).indices.size(), per_part * wanted[mode]);
    }
  }
}

TEST(ClearMeaning, NoPaddingNeedFollowTheLastColumnOfAMatrix) {
  for (const auto& [type, bytes] : std::vector<std::pair<const char*, std::size_t>>{{"MAT2", 6}, {"MAT3", 11}}) {
    GltfAsset asset = test::everything_asset();
    const std::vector<std::uint8_t> data(bytes, 1);
    const int view = asset.add_view(data);
    asset.document["accessors"].push_back(
        {{"bufferView", view}, {"componentType", 5121}, {"count", 1}, {"type", type}});
    EXPECT_NO_THROW(test::read_asset(asset)) << type;
    asset.document["bufferViews"][static_cast<std::size_t>(view)]["byteLength"] = bytes - 1;
    EXPECT_THROW(test::read_asset(asset), InputError) << type;
  }
}

TEST(ClearMeaning, IntegersThatQuantizationAllowsAreReadWithoutItsDeclaration) {
  GltfAsset asset = test::everything_asset();
  asset.document["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = asset.add_accessor(
      "VEC3", std::vector<std::int8_t>{0, 0, 127, 0, 0, 127, 0, 0, 127, 0, 0, 127}, {{"normalized", true}});
  expect_clear(asset, "/attributes/NORMAL", "KHR_mesh_quantization");
  EXPECT_EQ(test::read_asset(asset).meshes[0].primitives[0].vertices.normals[0], Vec3(0, 0, 1));
}

// ---- Bytes ------------------------------------------------------------------------------------------------------

TEST(ClearMeaning, DataOfAUriMayHaveEscapesAndLines) {
  const std::string plain = test::everything_asset().gltf();
  std::string escaped, lines;
  const std::size_t begin = plain.find("base64,") + 7, end = plain.find('"', begin);
  std::size_t column = 0;
  for (const char c : plain.substr(begin, end - begin)) {
    escaped += c == '+' || c == '/' || c == '=' || c == 'A' ? fmt::format("%{:02X}", static_cast<unsigned char>(c))
                                                            : std::string(1, c);
    lines += c;
    if (++column % 76 == 0) lines += "\\r\\n";
  }
  for (const std::string& data : {escaped, lines}) {
    std::string text = plain;
    text.replace(begin, end - begin, data);
    EXPECT_EQ(test::read_contents(text).meshes[0].primitives[0].vertices.positions[1], Vec3(1, 0, 0));
  }
}

TEST(ClearMeaning, ExtrasMayNestAsDeepAsTheyLikeAndNothingElse) {
  for (const int depth : {10, 63, 100, 1000, 50000}) {
    const std::string nested =
        std::string(static_cast<std::size_t>(depth), '[') + std::string(static_cast<std::size_t>(depth), ']');
    std::string text = test::everything_asset().gltf();
    text.insert(1, "\"extras\": " + nested + ", ");
    EXPECT_NO_THROW(test::read_contents(text)) << depth;
    std::string other = test::everything_asset().gltf();
    other.insert(1, "\"extensions2\": " + nested + ", ");
    if (depth > 64) {
      EXPECT_THROW(test::read_contents(other), InputError) << depth;
    }
  }
  EXPECT_THROW(test::read_contents("{\"extras\": " + std::string(2000000, '[')), InputError);
}

TEST(ClearMeaning, OfGltf1AndOfBackslashesIsSaid) {
  const auto refusal = [](const std::string& text) {
    try {
      test::read_contents(text);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  for (const char* text :
       {R"({"asset": {"version": "1.0"}, "meshes": {}})", R"({"asset": {"version": 1.0}, "nodes": {}})",
        R"({"scenes": {"s": {}}, "nodes": {"n": {}}, "meshes": {}})"})
    EXPECT_THAT(refusal(text), HasSubstr("glTF 1.0 is not read")) << text;
  EXPECT_THAT(refusal(std::string("glTF\x01\0\0\0\x14\0\0\0\0\0\0\0\0\0\0\0", 20)),
              HasSubstr("glTF 1.0, which is not read"));
  for (const auto& [uri, said] :
       std::vector<std::pair<const char*, const char*>>{{"sub\\\\dir.png", "a backslash in a URI"},
                                                        {"a%5Cb.png", "a backslash in a URI"},
                                                        {"C:\\\\dir\\\\a.png", "a path of Windows"},
                                                        {"C:/a.png", "a path of Windows"},
                                                        {"/a.png", "relative path"},
                                                        {"file:///a.png", "a URI with a scheme"}}) {
    const GltfAsset asset = with("/images/0", json::parse(fmt::format("{{\"uri\": \"{}\"}}", uri)));
    EXPECT_THAT(refusal(asset.gltf()), HasSubstr(said)) << uri;
  }
}

// ---- Images -----------------------------------------------------------------------------------------------------

// A material whose texture `slot` names an image that is not there.
GltfAsset missing_image(const char* slot) {
  GltfAsset asset = test::everything_asset();
  asset.document["images"].push_back({{"uri", "missing.png"}});
  asset.document["textures"].push_back({{"source", 1}});
  asset.document[json::json_pointer(std::string("/materials/0") + slot)] = {{"index", 1}};
  return asset;
}

TEST(ClearMeaning, AnImageThatNothingSamplesMayBeMissing) {
  const auto unlit_with = [&](const char* slot) {
    GltfAsset asset = missing_image(slot);
    asset.document["materials"][0]["extensions"]["KHR_materials_unlit"] = json::object();
    return asset;
  };
  for (const char* slot : {"/normalTexture", "/occlusionTexture", "/emissiveTexture"})
    expect_clear(unlit_with(slot), "/images/1", "missing.png");
  // Images of a material that no drawn primitive has, and of a scene that is not drawn.
  GltfAsset unused = missing_image("/normalTexture");
  unused.document["materials"].push_back(unused.document["materials"][0]);
  unused.document["materials"][0].erase("normalTexture");
  expect_clear(unused, "/images/1", "missing.png");
  GltfAsset elsewhere = missing_image("/normalTexture");
  elsewhere.document["materials"].push_back(elsewhere.document["materials"][0]);
  elsewhere.document["materials"][0].erase("normalTexture");
  elsewhere.document["meshes"].push_back(elsewhere.document["meshes"][0]);
  elsewhere.document["meshes"][2]["primitives"][0]["material"] = 2;
  elsewhere.document["nodes"].push_back({{"mesh", 2}});
  elsewhere.document["scenes"].push_back({{"nodes", {8}}});
  elsewhere.document["scene"] = 0;
  expect_clear(elsewhere, "/images/1", "missing.png");
  // Images of a node that is hidden, or is below one that is, unless an animation shows it.
  for (const bool below : {false, true}) {
    GltfAsset hidden = elsewhere;
    hidden.document["scenes"].erase(hidden.document["scenes"].size() - 1);
    json hides = {{"extensions", {{"KHR_node_visibility", {{"visible", false}}}}}};
    if (below) {
      hides["children"] = {8};
      hidden.document["nodes"].push_back(hides);
    } else {
      hidden.document["nodes"][8].update(hides);
    }
    const std::size_t node = below ? 9 : 8;
    hidden.document["scenes"][0]["nodes"].push_back(node);
    hidden.document["extensionsUsed"].push_back("KHR_node_visibility");
    expect_clear(hidden, "/images/1", "missing.png");
    GltfAsset shown = hidden;
    shown.document["nodes"][node]["extensions"]["KHR_node_visibility"]["visible"] = true;
    EXPECT_THROW(test::read_asset(shown), InputError);
    shown = hidden;
    shown.document["extensionsUsed"].push_back("KHR_animation_pointer");
    const json pointer = {{"pointer", fmt::format("/nodes/{}/extensions/KHR_node_visibility/visible", node)}};
    json animation;
    animation["samplers"][0] = {{"input", shown.add_accessor("SCALAR", std::vector<float>{0, 1})},
                                {"output", shown.add_accessor("SCALAR", std::vector<std::uint8_t>{0, 1})},
                                {"interpolation", "STEP"}};
    animation["channels"][0] = {
        {"sampler", 0}, {"target", {{"path", "pointer"}, {"extensions", {{"KHR_animation_pointer", pointer}}}}}};
    shown.document["animations"].push_back(animation);
    try {
      test::read_asset(shown);
      ADD_FAILURE() << "read";
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("missing.png"));
    }
  }
  // Without the coordinates that it needs.
  GltfAsset without = missing_image("/normalTexture");
  without.document["materials"][0]["normalTexture"]["texCoord"] = 3;
  expect_clear(without, "/images/1", "missing.png");
  // Twins: sampled, it is refused.
  EXPECT_THROW(test::read_asset(missing_image("/normalTexture")), InputError);
  EXPECT_THROW(test::read_asset(unlit_with("/pbrMetallicRoughness/baseColorTexture")), InputError);
}

// ---- Attributes -------------------------------------------------------------------------------------------------

// Mesh 0 with `sets` sets of joints: vertex 0 follows joint k % 2 with the weight `weights[k]`.
Capture with_sets(const std::vector<float>& weights, std::vector<std::uint8_t> joints) {
  GltfAsset asset = test::everything_asset();
  for (std::size_t set = 0; 4 * set < weights.size(); ++set) {
    std::vector<std::uint8_t> j(16, 0);
    std::vector<float> w(16, 0.0f);
    for (std::size_t v = 0; v < 4; ++v)
      for (std::size_t k = 0; k < 4; ++k) j[4 * v + k] = joints[4 * set + k], w[4 * v + k] = weights[4 * set + k];
    json& attributes = asset.document["meshes"][0]["primitives"][0]["attributes"];
    attributes["JOINTS_" + std::to_string(set)] = asset.add_accessor("VEC4", j);
    attributes["WEIGHTS_" + std::to_string(set)] = asset.add_accessor("VEC4", w);
  }
  return test::read_asset(asset);
}

std::map<int, float> weights_of(const SkinInfluence& influence) {
  std::map<int, float> sums;
  for (std::size_t k = 0; k < 8; ++k)
    if (influence.weights[k] > 0) sums[influence.joints[k]] += influence.weights[k];
  return sums;
}

TEST(ClearMeaning, WeightsOfAllSetsCount) {
  std::vector<float> weights(12, 0.0f);
  std::vector<std::uint8_t> joints(12, 0);
  weights[0] = 0.25f, weights[9] = 0.75f, joints[9] = 1;
  const Capture capture = with_sets(weights, joints);
  const std::map<int, float> wanted = {{0, 0.25f}, {1, 0.75f}};
  EXPECT_EQ(weights_of(capture.meshes[0].primitives[0].vertices.influences[0]), wanted);
  EXPECT_THAT(capture.notices, testing::Not(Contains(HasSubstr("ninth"))));
  // Sixteen that name two joints are two.
  std::vector<std::uint8_t> alternate(16);
  for (std::size_t k = 0; k < 16; ++k) alternate[k] = k % 2;
  const auto two = weights_of(
      with_sets(std::vector<float>(16, 1.0f / 16), alternate).meshes[0].primitives[0].vertices.influences[0]);
  EXPECT_NEAR(two.at(0), 0.5f, 1e-6f);
}

TEST(ClearMeaning, DataThatAreNotReadAreNamed) {
  GltfAsset asset = test::everything_asset();
  json& primitive = asset.document["meshes"][0]["primitives"][0];
  const int colors = asset.add_accessor("VEC4", std::vector<float>(16, 1.0f));
  primitive["attributes"]["COLOR_0"] = colors;
  primitive["attributes"]["COLOR_1"] = colors;
  primitive["targets"][0]["COLOR_0"] = colors;
  primitive["targets"][0]["TEXCOORD_0"] = asset.add_accessor("VEC2", std::vector<float>(8, 1.0f));
  const Capture capture = test::read_asset(asset);
  EXPECT_THAT(capture.notices, Contains(HasSubstr("/attributes/COLOR_1: is not read")));
  EXPECT_THAT(capture.notices, Contains(HasSubstr("targets/0/COLOR_0: is a morph target that is not read; colours and "
                                                  "coordinates stay as they rest (and 1 more)")));
}

}  // namespace
}  // namespace tessera::scene::clear_meaning_test

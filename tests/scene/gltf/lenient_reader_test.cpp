// Mistakes of exporters whose meaning is clear: they are read as they are meant, with a note.
#include "base/error.h"
#include "scene/assembly.h"
#include "scene/capture_reader.h"
#include "scene/extensions.h"
#include "scene/pose.h"
#include "tests/support/gltf_asset.h"
#include "tests/support/tests.h"

namespace tessera::scene::lenient_reader_test {
namespace {

using test::GltfAsset;
using testing::Contains;
using testing::ElementsAre;

Capture read_file(const std::string& name, const std::string& contents, bool strict = false) {
  const test::TemporaryFolder folder;
  test::write_text(folder / name, contents);
  return read_capture(folder / name, {.strict = strict});
}
Capture read(const GltfAsset& asset, bool strict = false) { return read_file("f.glb", asset.glb(), strict); }

Capture read_with(const std::vector<std::pair<const char*, json>>& edits, bool strict = false) {
  GltfAsset asset = test::everything_asset();
  for (const auto& [pointer, value] : edits) asset.document[json::json_pointer(pointer)] = value;
  return read(asset, strict);
}

TEST(LenientReader, AViolationIsANoteOrWhenStrictARefusalAtItsPlace) {  // NT1
  const std::vector<std::pair<const char*, json>> edits = {{"/scenes/0/nodes", {0, 3}}};
  EXPECT_THAT(read_with(edits).notices, ElementsAre(HasSubstr("/scenes/0/nodes/1: is node 3, which is not a root")));
  try {
    read_with(edits, true);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_EQ(error.place(), "/scenes/0/nodes/1");
    EXPECT_EQ(error.fault(), "is node 3, which is not a root");
  }
  EXPECT_TRUE(read_with({}, true).notices.empty());
}

TEST(LenientReader, ViolationsAnsweredAlikeMakeOneNote) {  // NT2
  const Capture capture = read_with({{"/meshes/0/primitives/0/attributes/A", 0},
                                     {"/meshes/0/primitives/0/attributes/B", 0},
                                     {"/meshes/0/primitives/0/attributes/C", 0}});
  EXPECT_THAT(capture.notices,
              ElementsAre("/meshes/0/primitives/0/attributes/A: is not an attribute that glTF defines; such attributes "
                          "are ignored (and 2 more)"));
}

TEST(LenientReader, NotesShowNoControlCharacters) {
  const Capture capture = read_with({{"/meshes/0/primitives/0/attributes/A\x1b[31m", 0}});
  EXPECT_THAT(capture.notices, ElementsAre(HasSubstr("A\\x1B[31m: is not")));
}

TEST(LenientReader, OneNoteNamesEveryExtensionThatIsNotRead) {  // EC1
  const Capture capture = read_with({{"/extensionsUsed", {"MADE_used", "KHR_lights_punctual", "MADE_both"}},
                                     {"/materials/0/extensions", {{"MADE_both", {{"extras", 1}}}}},
                                     {"/materials/0/pbrMetallicRoughness/extensions", {{"MADE_inner", json::object()}}},
                                     {"/materials/1/extensions/MADE_both", {{"extensions", {{"MADE_deep", 1}}}}},
                                     {"/meshes/0/extensions/MADE_mesh", json::object()},
                                     {"/extensions/MADE_root", json::object()},
                                     {"/nodes/0/extras", {{"extensions", {{"MADE_extra", 1}}}}}});
  EXPECT_THAT(capture.notices,
              ElementsAre("not read: MADE_both (2 materials), MADE_deep (1 material), MADE_inner (1 material), "
                          "MADE_mesh (1 mesh), MADE_root, MADE_used"));
  EXPECT_THAT(capture.extensions_unread,
              ElementsAre("MADE_both", "MADE_deep", "MADE_inner", "MADE_mesh", "MADE_root", "MADE_used"));
}

TEST(RegisteredExtensions, AreReadOrNotedAndUnreadOnesRefuseFilesThatRequireThem) {
  for (const Extension& extension : extension_registry()) {
    const std::string name(extension.name);
    const Capture capture = read_with({{"/extensionsUsed", {name}}});
    if (extension.read()) {
      EXPECT_THAT(capture.extensions_unread, testing::IsEmpty()) << name;
      EXPECT_NO_THROW(read_with({{"/extensionsUsed", {name}}, {"/extensionsRequired", {name}}})) << name;
    } else {
      EXPECT_THAT(capture.notices, ElementsAre("not read: " + name));
      EXPECT_THROW(read_with({{"/extensionsUsed", {name}}, {"/extensionsRequired", {name}}}), InputError) << name;
    }
  }
}

TEST(RegisteredExtensions, HoldEverySupportedExtensionButTesserasOwn) {
  std::set<std::string_view> read, supported;
  for (const Extension& extension : extension_registry())
    if (extension.read()) read.insert(extension.name);
  for (const Extension& extension : supported_extensions())
    if (!extension.name.starts_with("TESSERA_")) supported.insert(extension.name);
  EXPECT_EQ(read, supported);
}

// ---- Drawn nodes ------------------------------------------------------------------------------------------------

TEST(LenientReader, AListedNodeThatIsNoRootIsDrawnWhereItsParentsPutIt) {
  // Node 3 is the child of node 2; neither 2 nor 0 is listed.
  const Capture capture = read_with({{"/scenes/0/nodes", {3}},
                                     {"/nodes/3/mesh", 1},
                                     {"/nodes/2/translation", {10, 0, 0}},
                                     {"/nodes/2/rotation", {0, 0, 0, 1}},
                                     {"/animations/0/channels", {{{"sampler", 2}, {"target", {{"path", "scale"}}}}}}});
  const Pose pose = pose_at(capture, 0);
  EXPECT_EQ(DVec3(pose.world[3][3]), DVec3(10, 1, 0));
  EXPECT_THAT(pose.in_scene, ElementsAre(false, false, false, true, false, false, false, false));
  EXPECT_EQ(assemble(capture).drawables.size(), 1u);
}

TEST(LenientReader, ANodeListedBesideItsAncestorIsDrawnOnce) {
  const std::size_t once = assemble(read_with({})).drawables.size();
  EXPECT_EQ(assemble(read_with({{"/scenes/0/nodes", {0, 1, 1, 5}}})).drawables.size(), once);
}

TEST(LenientReader, ATextureWithoutASourceThatIsReadLeavesTheFactorAlone) {
  const Capture capture =
      read_with({{"/textures/0", {{"sampler", 0}, {"extensions", {{"MADE_image", {{"source", 0}}}}}}}});
  EXPECT_EQ(capture.materials.at(0).base_color_texture.texture, nullptr);
  EXPECT_EQ(capture.materials.at(0).metallic, 0.5f);
  EXPECT_FALSE(capture.materials.at(1).displacement.has_value());
  EXPECT_THAT(capture.notices, Contains(HasSubstr("/textures/0: has no source")));
  EXPECT_THAT(capture.notices, Contains("not read: MADE_image (1 texture)"));
}

TEST(LenientReader, APrimitiveWithoutTheCoordinatesOfATextureIsDrawnWithoutIt) {
  GltfAsset asset = test::everything_asset();
  asset.document["meshes"][0]["primitives"][0]["attributes"].erase("TEXCOORD_0");
  asset.document["nodes"].push_back({{"mesh", 2}});
  asset.document["scenes"][0]["nodes"].push_back(8);
  json whole = asset.document["meshes"][0];
  whole["primitives"][0]["attributes"]["TEXCOORD_0"] = test::kTexcoords;
  asset.document["meshes"].push_back(whole);
  const Capture capture = read(asset);
  const Assembly assembly = assemble(capture);
  for (const Drawable& drawable : assembly.drawables) {
    if (drawable.mesh == 1) continue;
    const Material& material = assembly.materials[static_cast<std::size_t>(drawable.material)];
    EXPECT_EQ(material.base_color_texture.texture == nullptr, drawable.mesh == 0);
    EXPECT_EQ(assembly.material_source[static_cast<std::size_t>(drawable.material)], 0);
    EXPECT_EQ(material.metallic, 0.5f);
  }
}

TEST(LenientReader, SetsOfTextureCoordinatesKeepTheirNumbers) {
  const Capture capture = read_with({{"/meshes/0/primitives/0/attributes",
                                      {{"POSITION", test::kPositions},
                                       {"TEXCOORD_2", test::kTexcoords},
                                       {"JOINTS_0", test::kJoints},
                                       {"WEIGHTS_0", test::kWeights}}},
                                     {"/materials/0/pbrMetallicRoughness/baseColorTexture/texCoord", 2}});
  const auto& sets = capture.meshes[0].primitives[0].vertices.texcoords;
  ASSERT_EQ(sets.size(), 3u);
  EXPECT_TRUE(sets[0].empty() && sets[1].empty());
  EXPECT_EQ(sets[2].size(), 4u);
  const Assembly assembly = assemble(capture);
  EXPECT_EQ(assembly.drawables[0].material, 0) << "the material's texture has its coordinates";
}

TEST(LenientReader, PositionsWithoutDataAreZero) {
  GltfAsset asset = test::everything_asset();
  asset.document["accessors"][test::kPositions].erase("bufferView");
  const Capture capture = read(asset, true);  // which glTF allows
  EXPECT_THAT(capture.meshes[0].primitives[0].vertices.positions, testing::Each(Vec3(0.0f)));
  EXPECT_THAT(capture.notices, ElementsAre(HasSubstr("/POSITION: has an accessor without data")));
}

TEST(LenientReader, VerticesWithoutAnIndexNeedNotBeFinite) {
  GltfAsset asset = test::everything_asset();
  for (std::size_t k = 0; k < 3; ++k) asset.poke(test::kIndices, 3 + k, static_cast<std::uint16_t>(k));
  const float nan = std::numeric_limits<float>::quiet_NaN();
  asset.poke(test::kPositions, 9, nan);
  asset.poke(test::kMorph, 11, nan);
  const Capture capture = read(asset);
  const Vertices& vertices = capture.meshes[0].primitives[0].vertices;
  EXPECT_EQ(vertices.positions[3], Vec3(0, 1, 0)) << "x, the only scalar that is none, became zero";
  EXPECT_EQ(vertices.morph_targets[0].positions[3], Vec3(0.0f));
  asset.poke(test::kPositions, 0, nan);
  EXPECT_THROW(read(asset), InputError);
}

TEST(LenientReader, WeightsThatAreMissingAreZero) {
  GltfAsset asset = test::everything_asset();
  json& primitive = asset.document["meshes"][0]["primitives"][0];
  primitive["targets"].push_back(primitive["targets"][0]);
  asset.document["animations"][0]["channels"].erase(3);
  const Capture capture = read(asset);
  EXPECT_THAT(capture.meshes[0].default_weights, ElementsAre(0.5f, 0.0f));
  EXPECT_THAT(capture.nodes[1].weights, ElementsAre(0.25f, 0.0f));
}

// ---- Files ------------------------------------------------------------------------------------------------------

TEST(LenientReader, SchemesAndMarkersOfDataUrisMayBeInCapitals) {
  const GltfAsset asset = test::everything_asset();
  const std::string data = test::base64(asset.binary);
  for (const char* head : {"DATA:application/octet-stream;base64,", "Data:Application/Octet-Stream;BASE64,"}) {
    const Capture capture = read_file("f.gltf", asset.gltf_with_file(head + data));
    EXPECT_EQ(capture.meshes[0].primitives[0].vertices.positions[1], Vec3(1, 0, 0));
    EXPECT_THAT(capture.notices, ElementsAre(HasSubstr("/buffers/0/uri: has its scheme in capitals")));
  }
}

TEST(LenientReader, GlbChunksOfAnyLengthAreFound) {
  const GltfAsset asset = test::everything_asset();
  const std::string binary(asset.binary.begin(), asset.binary.end());
  const auto chunk = [](const std::string& type, const std::string& bytes) {
    return test::little_endian32(static_cast<std::uint32_t>(bytes.size())) + type + bytes;
  };
  std::string text = asset.document.dump();
  text.resize(text.size() / 4 * 4 + 5, ' ');
  // The binary chunk behind the text, and behind padding that the text's length does not count; padding at the end.
  for (const std::string& padding : {std::string(), std::string(3, ' ')})
    for (const std::string& end : {std::string(), std::string(1, '\0'), std::string(2, '\0')}) {
      const std::string odd = binary + (end.empty() ? "" : "x");
      const std::string chunks = chunk("JSON", text) + padding + chunk(std::string("BIN\0", 4), odd) + end;
      const std::string glb = "glTF" + test::little_endian32(2) +
                              test::little_endian32(static_cast<std::uint32_t>(12 + chunks.size())) + chunks;
      const Capture capture = read_file("f.glb", glb);
      EXPECT_EQ(capture.meshes[0].primitives[0].vertices.positions[1], Vec3(1, 0, 0));
      EXPECT_THAT(capture.notices, ElementsAre(HasSubstr("is not a multiple of 4")));
      EXPECT_THROW(read_file("f.glb", glb, true), InputError);
    }
}

}  // namespace
}  // namespace tessera::scene::lenient_reader_test

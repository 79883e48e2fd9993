// KHR_materials_variants: which material a primitive is drawn with.
#include "base/error.h"
#include "tests/support/read_asset.h"
#include "tests/support/tests.h"

namespace tessera::scene::material_variants_test {
namespace {

using test::GltfAsset;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Not;

// Three primitives of one mesh and one of another: red by themselves but for the last, which has no material.
GltfAsset cups() {
  GltfAsset asset;
  const int points = asset.add_accessor<float>("VEC3", {0, 0, 0, 1, 0, 0, 0, 1, 0});
  for (const char* name : {"red", "green", "blue"}) asset.add("materials", {{"name", name}});
  const auto primitive = [&](const json& mappings) {
    json out = {{"attributes", {{"POSITION", points}}}, {"material", 0}};
    if (!mappings.is_null()) out["extensions"]["KHR_materials_variants"]["mappings"] = mappings;
    return out;
  };
  const json both = {{{"variants", {0}}, {"material", 1}}, {{"variants", {1, 2}}, {"material", 2}}};
  const json one = {{{"variants", {2}}, {"material", 1}}};
  json bare = primitive(one);
  bare.erase("material");
  asset.add("meshes", {{"primitives", {primitive(both), primitive(json()), primitive(one)}}});
  asset.add("meshes", {{"primitives", {bare}}});
  asset.add("nodes", {{"mesh", 0}});
  asset.add("nodes", {{"mesh", 1}});
  asset.add("scenes", {{"nodes", {0, 1}}});
  asset.document["extensionsUsed"] = {"KHR_materials_variants"};
  asset.document["extensions"]["KHR_materials_variants"]["variants"] = {
      {{"name", "meadow"}}, {{"name", "sky"}}, {{"name", "sea"}}};
  return asset;
}

std::vector<int> materials_of(const Capture& capture) {
  std::vector<int> materials;
  for (const Mesh& mesh : capture.meshes)
    for (const Primitive& primitive : mesh.primitives) materials.push_back(primitive.material);
  return materials;
}

std::string complaint(const GltfAsset& asset, const std::string& variant) {
  try {
    test::read_asset(asset, {.variant = variant});
  } catch (const UsageError& error) {
    return error.what();
  }
  return "";
}

TEST(MaterialVariants, WithoutAChoicePrimitivesKeepTheirMaterials) {
  const Capture capture = test::read_asset(cups());
  EXPECT_THAT(capture.variants, ElementsAre("meadow", "sky", "sea"));
  EXPECT_EQ(capture.variant, kNone);
  EXPECT_THAT(materials_of(capture), ElementsAre(0, 0, 0, kNone));
  EXPECT_THAT(capture.notices, IsEmpty());
  EXPECT_THAT(capture.extensions_unread, IsEmpty());
}

TEST(MaterialVariants, AMappingOfTheChosenVariantReplacesTheMaterial) {
  const std::vector<std::pair<std::string, std::vector<int>>> cases = {
      {"meadow", {1, 0, 0, kNone}}, {"sky", {2, 0, 0, kNone}}, {"sea", {2, 0, 1, 1}}};
  for (std::size_t v = 0; v < cases.size(); ++v) {
    const Capture capture = test::read_asset(cups(), {.variant = cases[v].first});
    EXPECT_EQ(capture.variant, static_cast<int>(v));
    EXPECT_EQ(materials_of(capture), cases[v].second) << cases[v].first;
  }
}

TEST(MaterialVariants, AnUnknownNameIsAnsweredWithTheKnownOnes) {
  EXPECT_THAT(complaint(cups(), "Sky"), HasSubstr("no variant 'Sky' in "));
  EXPECT_THAT(complaint(cups(), "Sky"), HasSubstr("which has 'meadow', 'sky', 'sea'"));
  EXPECT_THAT(complaint(cups(), "1"), HasSubstr("no variant '1'"));
  EXPECT_THAT(complaint(test::everything_asset(), "sky"), HasSubstr("which has none"));
  GltfAsset many = cups();
  json& variants = many.document["extensions"]["KHR_materials_variants"]["variants"];
  for (int v = 0; v < 100; ++v) variants.push_back({{"name", "v\n" + std::to_string(v)}});
  EXPECT_THAT(complaint(many, "sand"), HasSubstr("'v\\x0A16' and 83 more"));
  EXPECT_THAT(complaint(many, "sand"), Not(HasSubstr("\n")));
}

TEST(MaterialVariants, TheFirstOfTwoWithOneNameIsChosenWithANote) {
  GltfAsset asset = cups();
  asset.document["extensions"]["KHR_materials_variants"]["variants"][1]["name"] = "sea";
  const Capture capture = test::read_asset(asset, {.variant = "sea"});
  EXPECT_EQ(capture.variant, 1);
  EXPECT_THAT(materials_of(capture), ElementsAre(2, 0, 0, kNone));
  EXPECT_THAT(capture.notices, ElementsAre(HasSubstr("/extensions/KHR_materials_variants/variants/2")));
  EXPECT_THAT(capture.notices, ElementsAre(HasSubstr("is called 'sea', as variant 1 is")));
}

TEST(MaterialVariants, EmptyNamesAndEmptyListsAreVariantsToo) {
  GltfAsset asset = cups();
  asset.document["extensions"]["KHR_materials_variants"]["variants"][0]["name"] = "";
  EXPECT_THAT(materials_of(test::read_asset(asset, {.variant = ""})), ElementsAre(1, 0, 0, kNone));
  asset.document["meshes"][0]["primitives"][0]["extensions"]["KHR_materials_variants"]["mappings"] = json::array();
  EXPECT_THAT(materials_of(test::read_asset(asset, {.variant = ""})), ElementsAre(0, 0, 0, kNone));
}

// Textures of the chosen material must exist; textures of other materials need not.
TEST(MaterialVariants, NotesAreAboutTheMaterialsThatAreDrawn) {
  GltfAsset asset = cups();
  asset.document["textures"] = json::array({json::object()});
  asset.document["materials"][1]["normalTexture"] = {{"index", 0}};
  const auto lacking = [&](const CaptureLimits& limits) {
    std::size_t count = 0;
    for (const std::string& notice : test::read_asset(asset, limits).notices)
      count += notice.find("lacks TEXCOORD_0") != std::string::npos ? 1 : 0;
    return count;
  };
  EXPECT_EQ(lacking({}), 0u);
  EXPECT_EQ(lacking({.variant = "meadow"}), 1u);
}

}  // namespace
}  // namespace tessera::scene::material_variants_test

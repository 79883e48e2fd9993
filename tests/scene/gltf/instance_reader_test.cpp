// EXT_mesh_gpu_instancing as it is read and refused.
#include <tessera/error.h>

#include "scene/assembly.h"
#include "tests/support/read_asset.h"
#include "tests/support/tests.h"

namespace tessera::scene::instance_reader_test {
namespace {

using test::GltfAsset;
using testing::ElementsAre;

const std::string kAttributes = "/nodes/0/extensions/EXT_mesh_gpu_instancing/attributes";

// A triangle drawn at two instances: accessors 1 TRANSLATION, 2 ROTATION (shorts), 3 SCALE.
GltfAsset instanced_asset() {
  GltfAsset asset;
  const int points = asset.add_accessor("VEC3", std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0});
  asset.add("meshes", {{"primitives", {{{"attributes", {{"POSITION", points}}}}}}});
  const int translation = asset.add_accessor("VEC3", std::vector<float>{1, 2, 3, 4, 5, 6}),
            rotation = asset.add_accessor("VEC4", std::vector<std::int16_t>{0, 0, 0, 32767, 32767, 0, 0, 0},
                                          {{"normalized", true}}),
            scale = asset.add_accessor("VEC3", std::vector<float>{1, 1, 1, -2, 3, 4});
  asset.add("nodes",
            {{"mesh", 0},
             {"extensions",
              {{"EXT_mesh_gpu_instancing",
                {{"attributes", {{"TRANSLATION", translation}, {"ROTATION", rotation}, {"SCALE", scale}}}}}}}});
  asset.document["extensionsUsed"] = {"EXT_mesh_gpu_instancing"};
  asset.document["extensionsRequired"] = {"EXT_mesh_gpu_instancing"};
  return asset;
}

// Message of the refusal of the asset with one member replaced.
std::string refusal(const std::string& pointer, const json& value) {
  GltfAsset asset = instanced_asset();
  asset.document[json::json_pointer(pointer)] = value;
  try {
    test::read_asset(asset);
  } catch (const InputError& error) {
    return error.what();
  }
  return "it loads";
}

TEST(InstanceReader, TakesFloatsAndNormalisedIntegers) {
  const Capture capture = test::read_asset(instanced_asset());
  const auto& instances = capture.nodes.at(0).instances;
  ASSERT_EQ(instances.size(), 2u);
  EXPECT_THAT(instances[0].translation, ElementsAre(1, 2, 3));
  EXPECT_THAT(instances[0].rotation, ElementsAre(0, 0, 0, 1));
  EXPECT_THAT(instances[1].rotation, ElementsAre(1, 0, 0, 0));
  EXPECT_THAT(instances[1].scale, ElementsAre(-2, 3, 4));
  EXPECT_TRUE(capture.notices.empty());
  EXPECT_EQ(assemble(capture).drawables.size(), 2u);
}

TEST(InstanceReader, AMissingAttributeIsTheIdentity) {
  GltfAsset asset = instanced_asset();
  asset.document[json::json_pointer(kAttributes)] = {{"TRANSLATION", 1}};
  const Capture capture = test::read_asset(asset);
  EXPECT_THAT(capture.nodes.at(0).instances.at(1).rotation, ElementsAre(0, 0, 0, 1));
  EXPECT_THAT(capture.nodes.at(0).instances.at(1).scale, ElementsAre(1, 1, 1));
  asset.document[json::json_pointer(kAttributes)] = json::object();
  EXPECT_TRUE(test::read_asset(asset).nodes.at(0).instances.empty());
}

TEST(InstanceReader, NotesAttributesOfTheApplication) {
  GltfAsset asset = instanced_asset();
  asset.document[json::json_pointer(kAttributes)] = {{"_ID", 3}};
  const Capture capture = test::read_asset(asset);
  EXPECT_EQ(capture.nodes.at(0).instances.size(), 2u);
  ASSERT_EQ(capture.notices.size(), 1u);
  EXPECT_THAT(capture.notices[0], HasSubstr("_ID: belongs to the application"));
}

TEST(InstanceReader, DrawsASkinnedMeshAsItRests) {
  GltfAsset asset = test::everything_asset();
  const int translation = asset.add_accessor("VEC3", std::vector<float>{1, 2, 3});
  asset.document["nodes"][1]["extensions"]["EXT_mesh_gpu_instancing"] = {
      {"attributes", {{"TRANSLATION", translation}}}};
  const Capture capture = test::read_asset(asset);
  EXPECT_EQ(capture.nodes.at(1).skin, kNone);
  ASSERT_EQ(capture.notices.size(), 1u);
  EXPECT_THAT(capture.notices[0], HasSubstr("/nodes/1: is skinned and has instances"));
}

TEST(InstanceReader, RefusesAttributesThatDoNotFit) {
  const std::string extension = "/nodes/0/extensions/EXT_mesh_gpu_instancing";
  EXPECT_THAT(refusal(extension, 3), HasSubstr("is not an object"));
  EXPECT_THAT(refusal(extension, json::object()), HasSubstr("lacks the property 'attributes'"));
  EXPECT_THAT(refusal(kAttributes + "/SCALE", 4), HasSubstr("points at accessors[4]"));
  EXPECT_THAT(refusal(kAttributes + "/SCALE", 2), HasSubstr("does not fit here"));
  EXPECT_THAT(refusal(kAttributes + "/ROTATION", 1), HasSubstr("does not fit here"));
  EXPECT_THAT(refusal(kAttributes + "/TRANSLATION", 0), HasSubstr("elements, other attributes have"));
  EXPECT_THAT(refusal(kAttributes + "/_ID", 0), HasSubstr("elements, other attributes have"));
  EXPECT_THAT(refusal("/accessors/2/normalized", false), HasSubstr("does not fit here"));
  EXPECT_THAT(refusal("/nodes/0", {{"extensions", instanced_asset().document["nodes"][0]["extensions"]}}),
              HasSubstr("/nodes/0/extensions/EXT_mesh_gpu_instancing"));
  GltfAsset zero = instanced_asset();
  zero.poke(2, 4, std::int16_t{0});
  try {
    test::read_asset(zero);
    FAIL() << "a rotation of no length";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr(kAttributes + "/ROTATION"));
    EXPECT_THAT(error.what(), HasSubstr("rotation of instance 1 is zero"));
  }
}

// An accessor without data may claim any number of instances.
TEST(InstanceReader, ChargesInstancesBeforeTheyAreMade) {
  GltfAsset asset = instanced_asset();
  asset.document[json::json_pointer(kAttributes)] = {{"TRANSLATION", 1}};
  asset.document["accessors"][1].erase("bufferView");
  asset.document["accessors"][1]["count"] = 2147483647;
  EXPECT_THROW(test::read_asset(asset), LimitError);
  asset.document["accessors"][1]["count"] = 1000;
  const Capture capture = test::read_asset(asset);
  const Assembly assembly = assemble(capture);
  EXPECT_GE(capture.charged_bytes, assembly.drawables.size() * sizeof(Drawable) + assembly.patch_count() * 4);
  CaptureLimits tight;
  tight.max_bytes = capture.charged_bytes - 1;
  EXPECT_THROW(test::read_asset(asset, tight), LimitError);
}

}  // namespace
}  // namespace tessera::scene::instance_reader_test

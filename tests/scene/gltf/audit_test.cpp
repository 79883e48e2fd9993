// An error of the Khronos validator is a note where anybody asks for an audit, and refused strictly.
#include "scene/gltf/audit.h"

#include "base/error.h"
#include "scene/capture_reader.h"
#include "tests/support/read_asset.h"
#include "tests/support/tests.h"

namespace tessera::scene::audit_test {
namespace {

using test::GltfAsset;
using testing::Contains;

// The asset that uses everything, without any fault.
GltfAsset sound() {
  GltfAsset asset = test::everything_asset();
  return asset;
}

struct Fault {
  const char* code;
  std::function<void(GltfAsset&)> make;
};

std::function<void(GltfAsset&)> put(const char* pointer, const json& value) {
  return [=](GltfAsset& asset) { asset.document[json::json_pointer(pointer)] = value; };
}
template <class T>
std::function<void(GltfAsset&)> poke(int accessor, std::size_t scalar, T value) {
  return [=](GltfAsset& asset) { asset.poke(accessor, scalar, value); };
}
std::function<void(GltfAsset&)> drop(const char* object, const char* member) {
  return [=](GltfAsset& asset) { asset.document[json::json_pointer(object)].erase(member); };
}

const std::vector<Fault>& faults() {
  static const std::vector<Fault> kFaults = {
      {"EMPTY_ENTITY", put("/nodes/3/children", json::array())},
      {"TYPE_MISMATCH", put("/asset/generator", 5)},
      {"TYPE_MISMATCH", put("/accessors/0/name", 5)},
      {"PATTERN_MISMATCH", put("/asset/version", "2.0b")},
      {"DUPLICATE_ELEMENTS", put("/extensionsUsed", {"KHR_lights_punctual", "KHR_lights_punctual", "TESSERA_lens"})},
      {"UNDECLARED_EXTENSION", put("/materials/0/extensions", {{"KHR_materials_unlit", json::object()}})},
      {"UNUSED_EXTENSION_REQUIRED", put("/extensionsRequired", {"KHR_materials_ior"})},
      {"UNEXPECTED_EXTENSION_OBJECT", put("/nodes/3/extensions", {{"KHR_materials_ior", json::object()}})},
      {"ARRAY_LENGTH_NOT_IN_LIST", put("/accessors/0/min", {0, 0})},
      {"ARRAY_TYPE_MISMATCH", put("/accessors/0/min", {0, "0", 0})},
      {"MESH_PRIMITIVE_POSITION_ACCESSOR_WITHOUT_BOUNDS", drop("/accessors/0", "max")},
      {"ANIMATION_SAMPLER_INPUT_ACCESSOR_WITHOUT_BOUNDS", drop("/accessors/8", "min")},
      {"ACCESSOR_MIN_MISMATCH", put("/accessors/0/min", {-1, 0, 0})},
      {"ACCESSOR_MAX_MISMATCH", put("/accessors/0/max", {1, 1, 0.5})},
      {"ACCESSOR_VECTOR3_NON_UNIT", poke(test::kNormals, 2, 0.0f)},
      {"ACCESSOR_WEIGHTS_NON_NORMALIZED", poke(test::kWeights, 0, 0.25f)},
      {"ACCESSOR_JOINTS_INDEX_OOB", poke(test::kJoints, 3, std::uint8_t{200})},
      {"ACCESSOR_INVALID_IBM", poke(test::kInverseBind, 3, 1e-6f)},
      {"ACCESSOR_ANIMATION_SAMPLER_OUTPUT_NON_NORMALIZED_QUATERNION", poke(test::kRotations, 3, 2.0f)},
      {"UNSATISFIED_DEPENDENCY", drop("/images/0", "mimeType")},
      {"ONE_OF_MISMATCH", put("/cameras/0/orthographic", {{"xmag", 1}, {"ymag", 1}, {"zfar", 2}, {"znear", 1}})},
      {"SKIN_SKELETON_INVALID", put("/skins/0/skeleton", 3)},
      {"BUFFER_VIEW_INVALID_BYTE_STRIDE",
       [](GltfAsset& a) {
         a.document["bufferViews"][0]["byteStride"] = 12;
         a.document["bufferViews"][0]["target"] = 34963;
       }},
      {"BUFFER_VIEW_TARGET_OVERRIDE", put("/bufferViews/0/target", 34963)},
      {"IO_ERROR", put("/images/1", {{"uri", "none.png"}})},
      {"IMAGE_MIME_TYPE_INVALID", put("/images/0/mimeType", "image/jpeg")},
      {"MESH_PRIMITIVE_NO_TANGENT_SPACE",
       [](GltfAsset& a) {
         a.document["materials"][0]["extensions"]["KHR_materials_anisotropy"] = json::object();
         a.document["extensionsUsed"].push_back("KHR_materials_anisotropy");
       }},
  };
  return kFaults;
}

TEST(Audit, FindsNothingInASoundAsset) {
  EXPECT_THAT(test::read_asset(sound(), {.audit = true}).notices, testing::IsEmpty());
  EXPECT_NO_THROW(test::read_asset(sound(), {.strict = true}));
}

TEST(Audit, NamesTheErrorsOfTheValidatorAndStrictlyRefusesThem) {  // AU1
  for (const Fault& fault : faults()) {
    SCOPED_TRACE(fault.code);
    GltfAsset asset = sound();
    fault.make(asset);
    EXPECT_THAT(test::read_asset(asset, {.audit = true}).notices, Contains(HasSubstr(fault.code)));
    EXPECT_THROW(test::read_asset(asset, {.strict = true}), InputError);
  }
}

TEST(Audit, ChangesNothingOfTheCapture) {  // AU2
  for (const Fault& fault : faults()) {
    SCOPED_TRACE(fault.code);
    GltfAsset asset = sound();
    fault.make(asset);
    const Capture with = test::read_asset(asset, {.audit = true}), without = test::read_asset(asset);
    EXPECT_EQ(with.charged_bytes, without.charged_bytes);
    ASSERT_EQ(with.meshes.size(), without.meshes.size());
    EXPECT_EQ(with.meshes[0].primitives[0].vertices.positions, without.meshes[0].primitives[0].vertices.positions);
  }
}

TEST(Audit, HasAnAnswerForEveryCodeOfTheValidatorAndTheDocumentHasThemAll) {
  const std::vector<gltf::ValidatorCode>& codes = gltf::validator_codes();
  EXPECT_TRUE(std::is_sorted(codes.begin(), codes.end(), [](const auto& a, const auto& b) { return a.code < b.code; }));
  std::set<std::string_view> names;
  for (const gltf::ValidatorCode& code : codes) EXPECT_TRUE(names.insert(code.code).second) << code.code;
  for (const Fault& fault : faults()) EXPECT_TRUE(names.contains(fault.code)) << fault.code;
  const std::string page = test::read_text(fs::path(TESSERA_SOURCE_DIR) / "docs" / "formats.md");
  for (const gltf::ValidatorCode& code : codes) EXPECT_THAT(page, HasSubstr("`" + std::string(code.code) + "`"));
}

}  // namespace
}  // namespace tessera::scene::audit_test

#include <string>

#include "tests/scene/broken_captures.h"

namespace tessera::test {
namespace {

using nlohmann::json;

constexpr double kTwoTo31 = 2147483648.0, kTwoTo53 = 9007199254740992.0;

json& accessor(GltfAsset& asset, int index) { return asset.document["accessors"][static_cast<std::size_t>(index)]; }
std::string at_accessor(int index, const std::string& rest = "") {
  return "/accessors/" + std::to_string(index) + rest;
}

// An edit of a member of an accessor.
BrokenCapture accessor_edit(std::string name, int index, const char* member, json value, std::string place = "",
                            std::string fault = "") {
  if (place.empty()) place = at_accessor(index);
  return damaged(
      std::move(name), [=](GltfAsset& a) { accessor(a, index)[member] = value; }, std::move(place), std::move(fault));
}

BrokenClass asset_and_extensions() {
  return {"AssetOrExtensionUnknown",
          {
              without("asset_missing", "/asset", "the document", "asset"),
              without("version_missing", "/asset/version", "/asset", "version"),
              edited("version_1", "/asset/version", "1.0"),
              edited("version_3", "/asset/version", "3.0"),
              edited("version_a_number", "/asset/version", 2.0),
              edited("min_version_2_1", "/asset/minVersion", "2.1"),
              edited("extension_required", "/extensionsRequired", {"EXT_structural_metadata"}, "",
                     "EXT_structural_metadata"),
              edited("extensions_required", "/extensionsRequired",
                     {"KHR_lights_punctual", "KHR_materials_subsurface", "MADE_up"}, "",
                     "KHR_materials_subsurface, MADE_up"),
              edited("extension_name_of_controls", "/extensionsRequired", {"A\nB\x1b[31m"}, "", "A\\x0AB"),
              edited("extensions_required_a_text", "/extensionsRequired", "KHR_lights_punctual"),
          }};
}

BrokenClass wrong_types() {
  return {
      "PropertyMissingOrOfAWrongType",
      {
          edited("accessors_an_object", "/accessors", json::object()),
          edited("node_a_number", "/nodes/3", 7),
          edited("mesh_a_text", "/nodes/1/mesh", "0"),
          edited("mesh_negative", "/nodes/1/mesh", -1),
          edited("mesh_a_fraction", "/nodes/1/mesh", 0.5),
          edited("mesh_out_of_range", "/nodes/1/mesh", 2),
          edited("mesh_null", "/nodes/1/mesh", nullptr),
          edited("translation_of_two", "/nodes/3/translation", {0, 1}),
          edited("translation_of_texts", "/nodes/3/translation", {"a", "b", "c"}, "/nodes/3/translation/0"),
          edited("scene_out_of_range", "/scene", 1),
          edited("scene_node_out_of_range", "/scenes/0/nodes/0", 8),
          edited("child_out_of_range", "/nodes/0/children/0", 4000000000.0),
          edited("camera_out_of_range", "/nodes/4/camera", 2),
          edited("skin_out_of_range", "/nodes/1/skin", 1),
          edited("light_out_of_range", "/nodes/7/extensions/KHR_lights_punctual/light", 1),
          edited("extensions_an_array", "/nodes/7/extensions", json::array({1})),
          without("primitives_missing", "/meshes/0/primitives", "/meshes/0", "primitives"),
          edited("primitives_empty", "/meshes/0/primitives", json::array()),
          without("attributes_missing", "/meshes/0/primitives/0/attributes", "/meshes/0/primitives/0", "attributes"),
          edited("mode_7", "/meshes/0/primitives/0/mode", 7),
          without("component_type_missing", "/accessors/0/componentType", "/accessors/0", "componentType"),
          without("type_missing", "/accessors/0/type", "/accessors/0", "type"),
          without("count_missing", "/accessors/0/count", "/accessors/0", "count"),
          edited("component_type_5124", "/accessors/0/componentType", 5124),
          edited("type_VEC5", "/accessors/0/type", "VEC5"),
          without("byte_length_missing", "/bufferViews/0/byteLength", "/bufferViews/0", "byteLength"),
          without("buffer_length_missing", "/buffers/0/byteLength", "/buffers/0", "byteLength"),
          without("camera_type_missing", "/cameras/0/type", "/cameras/0", "type"),
          without("camera_projection_missing", "/cameras/0/perspective", "/cameras/0", "perspective"),
          edited("wrap_unknown", "/samplers/0/wrapS", 10496),
          edited("alpha_mode_unknown", "/materials/0/alphaMode", "HALF"),
          edited("base_color_above_1", "/materials/0/pbrMetallicRoughness/baseColorFactor", {1, 1, 2, 1},
                 "/materials/0/pbrMetallicRoughness/baseColorFactor/2"),
          edited("number_beyond_float", "/nodes/3/translation/0", 1e39),
      }};
}

BrokenClass ranges() {
  return {
      "ViewOrAccessorOutOfRange",
      {
          accessor_edit("count_zero", kPositions, "count", 0, "/accessors/0/count"),
          accessor_edit("count_negative", kPositions, "count", -1, "/accessors/0/count"),
          accessor_edit("count_one_too_many", kPositions, "count", 5, "", "bytes 0 to 60"),
          accessor_edit("count_2_to_31", kPositions, "count", kTwoTo31, "/accessors/0/count"),
          accessor_edit("count_2_to_31_less_1", kPositions, "count", kTwoTo31 - 1),
          accessor_edit("count_2_to_53", kPositions, "count", kTwoTo53, "/accessors/0/count"),
          accessor_edit("count_times_stride_wraps_32_bits", kPositions, "count", 357913942),
          accessor_edit("offset_beyond_view", kPositions, "byteOffset", 48),
          accessor_edit("offset_one_element_on", kPositions, "byteOffset", 12),
          accessor_edit("offset_2_to_31", kPositions, "byteOffset", kTwoTo31, "/accessors/0/byteOffset"),
          accessor_edit("offset_2_to_53", kPositions, "byteOffset", kTwoTo53, "/accessors/0/byteOffset"),
          accessor_edit("offset_negative", kPositions, "byteOffset", -4, "/accessors/0/byteOffset"),
          accessor_edit("view_out_of_range", kPositions, "bufferView", 99, "/accessors/0/bufferView"),
          strictly(damaged(
              "view_length_zero",
              [](GltfAsset& a) {
                a.add("bufferViews", {{"buffer", 0}, {"byteLength", 0}});
              },
              "/byteLength", "is 0, outside [1, 9007199254740992]")),
          strictly(damaged(
              "buffer_length_zero",
              [](GltfAsset& a) {
                a.add("buffers", {{"byteLength", 0}});
              },
              "/buffers/1/byteLength", "is 0, outside [1, 9007199254740992]")),
          edited("view_length_zero_of_what_is_read", "/bufferViews/0/byteLength", 0, "/accessors/0"),
          strictly(edited("view_target_unknown", "/bufferViews/0/target", 1, "", "does not define")),
          edited("view_beyond_buffer", "/bufferViews/0/byteLength", 100000, "/bufferViews/0"),
          edited("view_length_2_to_53", "/bufferViews/0/byteLength", kTwoTo53, "/bufferViews/0"),
          edited("view_length_2_to_63", "/bufferViews/0/byteLength", 9223372036854775807ll),
          edited("view_offset_wraps", "/bufferViews/0/byteOffset", 18446744073709551600ull),
          edited("view_offset_2_to_53", "/bufferViews/0/byteOffset", kTwoTo53, "/bufferViews/0"),
          edited("view_offset_negative", "/bufferViews/0/byteOffset", -1),
          edited("buffer_length_2_to_53", "/buffers/0/byteLength", kTwoTo53, "/buffers/0"),
          edited("buffer_length_negative", "/buffers/0/byteLength", -1),
          edited("stride_below_element", "/bufferViews/0/byteStride", 8, "/accessors/0", "stride"),
          edited("stride_not_multiple_of_component", "/bufferViews/0/byteStride", 14, "/accessors/0", "component size"),
          strictly(damaged(
              "stride_not_multiple_of_4",
              [](GltfAsset& a) {
                const std::vector<std::uint16_t> pairs(16, 7);
                const int view =
                    a.add_view({reinterpret_cast<const std::uint8_t*>(pairs.data()), 32}, {{"byteStride", 6}});
                a.add("accessors", {{"bufferView", view}, {"componentType", 5123}, {"type", "VEC2"}, {"count", 4}});
              },
              "/byteStride", "is not a multiple of 4")),
          edited("stride_above_252", "/bufferViews/0/byteStride", 256),
          edited("stride_reaches_past_view", "/bufferViews/0/byteStride", 16, "/accessors/0"),
          damaged(
              "stride_on_indices",
              [](GltfAsset& a) {
                a.document["bufferViews"][3].update({{"byteStride", 4}, {"byteLength", 24}});
              },
              "/meshes/0/primitives/0/indices", "byteStride"),
          strictly(damaged(
              "stride_of_indices_as_they_are",
              [](GltfAsset& a) {
                const std::vector<std::uint32_t> list = {0, 1, 2, 2, 1, 3};
                a.document["meshes"][0]["primitives"][0]["indices"] = a.add_accessor("SCALAR", list);
                a.document["bufferViews"].back()["byteStride"] = 4;
              },
              "/meshes/0/primitives/0/indices", "byteStride")),
          damaged(
              "misaligned_in_view",
              [](GltfAsset& a) {
                accessor(a, kMorphWeights).update({{"byteOffset", 2}, {"count", 2}});
              },
              at_accessor(kMorphWeights), "multiple"),
          edited("misaligned_view", "/bufferViews/2/byteOffset", 97, "/accessors/2", "multiple"),
      }};
}

BrokenClass sparse_accessors() {
  const std::string place = at_accessor(kControlPoints, "/sparse");
  const auto edit = [&](const char* name, const char* pointer, json value, const char* rest) {
    return damaged(
        name, [=](GltfAsset& a) { accessor(a, kControlPoints)["sparse"][json::json_pointer(pointer)] = value; },
        place + rest);
  };
  const auto index = [&](const char* name, std::uint16_t first, std::uint16_t second) {
    return damaged(
        name,
        [=](GltfAsset& a) {
          const int view = accessor(a, kControlPoints)["sparse"]["indices"]["bufferView"];
          std::memcpy(&a.binary[a.first_byte_of_view(view)], &first, 2);
          std::memcpy(&a.binary[a.first_byte_of_view(view) + 2], &second, 2);
        },
        place + "/indices");
  };
  return {"SparseAccessorBroken",
          {
              edit("count_zero", "/count", 0, "/count"),
              edit("count_above_accessor", "/count", 17, "/count"),
              edit("count_beyond_views", "/count", 3, "/indices"),
              edit("index_type_signed", "/indices/componentType", 5122, "/indices/componentType"),
              edit("index_type_float", "/indices/componentType", 5126, "/indices/componentType"),
              edit("index_view_out_of_range", "/indices/bufferView", 77, "/indices/bufferView"),
              edit("index_offset_beyond_view", "/indices/byteOffset", 4, "/indices"),
              edit("index_misaligned", "/indices/byteOffset", 1, "/indices"),
              edit("value_view_out_of_range", "/values/bufferView", 77, "/values/bufferView"),
              edit("value_offset_beyond_view", "/values/byteOffset", 4, "/values"),
              edit("values_missing", "/values", json::object(), "/values"),
              index("index_out_of_range", 5, 16),
              index("index_minus_1", 5, 0xFFFF),
              index("indices_equal", 5, 5),
              index("indices_decrease", 6, 5),
          }};
}

BrokenClass meshes() {
  const auto primitive = [](const char* name, const char* pointer, json value, std::string place = "",
                            std::string fault = "") {
    const std::string full = std::string("/meshes/0/primitives/0") + pointer;
    return edited(name, full.c_str(), std::move(value), place.empty() ? full : place, std::move(fault));
  };
  const std::string attributes = "/meshes/0/primitives/0/attributes";
  return {
      "MeshThatDoesNotFitTogether",
      {
          primitive("position_vec2", "/attributes/POSITION", kTexcoords),
          primitive("position_out_of_range", "/attributes/POSITION", 99),
          primitive("position_bytes_without_quantization", "/attributes/POSITION", kJoints),
          primitive("normal_vec2", "/attributes/NORMAL", kTexcoords),
          primitive("tangent_vec3", "/attributes/TANGENT", kNormals),
          primitive("texcoord_vec3", "/attributes/TEXCOORD_0", kNormals),
          primitive("color_vec2", "/attributes/COLOR_0", kTexcoords),
          primitive("joints_float", "/attributes/JOINTS_0", kWeights),
          primitive("weights_integers", "/attributes/WEIGHTS_0", kJoints),
          strictly(primitive("attribute_unknown", "/attributes/COLOUR", kPositions)),
          strictly(primitive(
              "texcoord_1_without_0", "/attributes",
              {{"POSITION", kPositions}, {"TEXCOORD_1", kTexcoords}, {"JOINTS_0", kJoints}, {"WEIGHTS_0", kWeights}})),
          without("joints_0_missing", "/meshes/0/primitives/0/attributes/JOINTS_0", attributes, "JOINTS_0"),
          primitive("counts_differ", "/attributes/NORMAL", kControlPoints, attributes),
          without("joints_without_weights", "/meshes/0/primitives/0/attributes/WEIGHTS_0", attributes, "together"),
          without("weights_without_joints", "/meshes/0/primitives/0/attributes/JOINTS_0", attributes, "together"),
          damaged(
              "skin_without_joints",
              [](GltfAsset& a) {
                a.document["meshes"][0]["primitives"][0]["attributes"].erase("JOINTS_0");
                a.document["meshes"][0]["primitives"][0]["attributes"].erase("WEIGHTS_0");
              },
              "/nodes/1/skin", "JOINTS_0"),
          primitive("indices_float", "/indices", kMorphWeights),
          primitive("indices_vec4", "/indices", kJoints),
          accessor_edit("indices_signed", kIndices, "componentType", 5122, "/meshes/0/primitives/0/indices"),
          strictly(accessor_edit("indices_normalized", kIndices, "normalized", true, "/meshes/0/primitives/0/indices")),
          strictly(accessor_edit("floats_normalized", kPositions, "normalized", true, "/accessors/0/normalized")),
          primitive("material_out_of_range", "/material", 2),
          strictly(without("texcoord_of_material_missing", "/meshes/0/primitives/0/attributes/TEXCOORD_0", attributes,
                           "TEXCOORD_0")),
          strictly(edited("texcoord_1_of_material_missing",
                          "/materials/0/pbrMetallicRoughness/baseColorTexture/texCoord", 1, attributes, "TEXCOORD_1")),
          primitive("target_vec2", "/targets/0/POSITION", kTexcoords),
          primitive("target_count_differs", "/targets/0/POSITION", kControlPoints),
          strictly(primitive("target_moves_missing_attribute", "/targets/0/TANGENT", kMorph)),
          strictly(damaged(
              "target_counts_differ_between_primitives",
              [](GltfAsset& a) {
                json copy = a.document["meshes"][0]["primitives"][0];
                copy.erase("targets");
                a.document["meshes"][0]["primitives"].push_back(copy);
              },
              "/meshes/0/primitives/1/targets")),
          strictly(edited("mesh_weights_of_two", "/meshes/0/weights", {0, 1})),
          strictly(edited("node_weights_of_two", "/nodes/1/weights", {0, 1})),
          strictly(edited("node_weights_without_mesh", "/nodes/3/weights", {1})),
          edited("node_weights_of_empty_mesh", "/meshes/0", {{"primitives", json::array()}}, "/"),
          edited("patch_count_differs", "/meshes/1/primitives/0/extensions/TESSERA_bezier_patches/count", 2),
          edited("patch_count_zero", "/meshes/1/primitives/0/extensions/TESSERA_bezier_patches/count", 0),
          edited("patch_count_2_to_31", "/meshes/1/primitives/0/extensions/TESSERA_bezier_patches/count", kTwoTo31),
          without("patch_count_missing", "/meshes/1/primitives/0/extensions/TESSERA_bezier_patches/count",
                  "TESSERA_bezier_patches"),
          edited("patches_of_strips", "/meshes/1/primitives/0/mode", 5,
                 "/meshes/1/primitives/0/extensions/TESSERA_bezier_patches"),
      }};
}

BrokenClass materials() {
  const std::string displacement = "/materials/1/extensions/TESSERA_displacement";
  return {"MaterialOrTextureBroken",
          {
              edited("texture_out_of_range", "/materials/0/pbrMetallicRoughness/baseColorTexture/index", 1),
              edited("texture_a_number", "/materials/0/pbrMetallicRoughness/baseColorTexture", 0),
              edited("source_out_of_range", "/textures/0/source", 1),
              edited("sampler_out_of_range", "/textures/0/sampler", 1),
              strictly(without("source_missing", "/textures/0/source", "/textures/0")),
              edited("image_has_uri_and_view", "/images/0/uri", "a.png", "/images/0"),
              without("image_has_neither", "/images/0/bufferView", "/images/0"),
              edited("image_view_out_of_range", "/images/0/bufferView", 99),
              edited("transform_scale_of_one", "/materials/0/pbrMetallicRoughness/baseColorTexture/extensions",
                     {{"KHR_texture_transform", {{"scale", {1}}}}},
                     "/materials/0/pbrMetallicRoughness/baseColorTexture/extensions/KHR_texture_transform/scale"),
              without("displacement_texture_missing", (displacement + "/texture").c_str(), displacement, "texture"),
              edited("displacement_texture_out_of_range", (displacement + "/texture/index").c_str(), 5),
              edited("displacement_scale_a_text", (displacement + "/scale").c_str(), "high"),
          }};
}

// everything_asset() with two variants, "plain" and "dressed", after an edit of `pointer`.
BrokenCapture variant(std::string name, const std::string& pointer, json value, std::string place = "",
                      std::string fault = "") {
  if (place.empty()) place = pointer;
  return damaged(
      std::move(name),
      [=](GltfAsset& a) {
        a.document["extensions"]["KHR_materials_variants"]["variants"] = {{{"name", "plain"}}, {{"name", "dressed"}}};
        a.document["meshes"][0]["primitives"][0]["extensions"]["KHR_materials_variants"]["mappings"] = {
            {{"variants", {0}}, {"material", 0}}, {{"variants", {1}}, {"material", 1}}};
        a.document[json::json_pointer(pointer)] = value;
      },
      std::move(place), std::move(fault));
}

BrokenClass variants() {
  const std::string at = "/extensions/KHR_materials_variants", mapping = "/meshes/0/primitives/0" + at + "/mappings/1";
  return {
      "VariantsBroken",
      {
          variant("variants_an_object", at + "/variants", json::object(), "", "is not an array"),
          variant("variants_missing", at, json::object(), "", "lacks the property 'variants'"),
          variant("variant_a_text", at + "/variants/1", "dressed"),
          variant("variant_without_a_name", at + "/variants/1", json::object(), "", "'name'"),
          variant("variant_name_a_number", at + "/variants/1/name", 1),
          variant("mappings_an_object", "/meshes/0/primitives/0/extensions/KHR_materials_variants/mappings",
                  json::object(), "", "is not an array"),
          variant("mappings_missing", "/meshes/0/primitives/0/extensions/KHR_materials_variants", json::object(), "",
                  "'mappings'"),
          variant("mapping_a_number", mapping, 1),
          variant("mapping_without_variants", mapping, {{"material", 1}}, "", "'variants'"),
          variant("mapping_without_a_material", mapping, {{"variants", {1}}}, "", "'material'"),
          variant("mapped_variants_a_number", mapping + "/variants", 1, "", "is not an array"),
          variant("mapped_variant_out_of_range", mapping + "/variants/0", 2, "", "points at variant 2, there are 2"),
          variant("mapped_variant_negative", mapping + "/variants/0", -1),
          variant("mapped_variant_a_fraction", mapping + "/variants/0", 0.5),
          variant("mapped_variant_a_name", mapping + "/variants/0", "dressed"),
          variant("mapped_material_out_of_range", mapping + "/material", 2, "", "points at materials[2]"),
          variant("mapped_material_a_text", mapping + "/material", "ware"),
          variant("variants_mapped_but_not_listed", at + "/variants", json::array(),
                  "/meshes/0/primitives/0/extensions/KHR_materials_variants/mappings/0/variants/0",
                  "points at variant 0, there are 0"),
          variant("variant_of_two_materials", mapping + "/variants", {1, 0}, mapping + "/variants/1",
                  "gives variant 0 material 1, a mapping before gives it material 0"),
          strictly(variant("variant_mapped_twice", mapping + "/variants", {1, 1}, mapping + "/variants/1",
                           "is variant 1, which has a mapping already")),
      }};
}

BrokenClass node_graph() {
  return {"NodeGraphThatIsNoForest",
          {
              edited("own_child", "/nodes/3/children", {3}, "/nodes/"),
              edited("cycle_of_two", "/nodes/3/children", {2}, "/nodes/"),
              damaged(
                  "cycle_of_many",
                  [](GltfAsset& a) {
                    for (int i = 0; i < 1000; ++i) a.add("nodes", {{"children", {8 + (i + 1) % 1000}}});
                  },
                  "/nodes/", "ancestor"),
              damaged(
                  "long_chain_into_a_cycle",
                  [](GltfAsset& a) {
                    for (int i = 0; i < 100000; ++i) a.add("nodes", {{"children", {8 + (i + 1) % 100000}}});
                  },
                  "/nodes/", "ancestor"),
              edited("two_parents", "/nodes/4/children", {3}, "/nodes/4/children/0", "parent"),
              edited("child_twice", "/nodes/2/children", {3, 3}, "/nodes/2/children/1", "parent"),
              strictly(edited("scene_root_is_a_child", "/scenes/0/nodes", {0, 3}, "/scenes/0/nodes/1", "root")),
              strictly(edited("scene_root_twice", "/scenes/0/nodes", {0, 0}, "/scenes/0/nodes/1", "twice")),
              strictly(edited("matrix_and_translation", "/nodes/7/translation", {0, 0, 0}, "/nodes/7", "matrix")),
              edited("matrix_of_15", "/nodes/7/matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0}),
              edited("matrix_projective", "/nodes/7/matrix/3", 1, "/nodes/7/matrix"),
              edited("matrix_that_shears", "/nodes/7/matrix/4", 1, "/nodes/7/matrix", "shears"),
              edited("matrix_with_null", "/nodes/7/matrix/0", nullptr),
              edited("rotation_not_unit", "/nodes/2/rotation", {0, 0, 0.5, 0.5}, "", "unit"),
              edited("rotation_zero", "/nodes/2/rotation", {0, 0, 0, 0}, "", "unit"),
              edited("rotation_above_1", "/nodes/2/rotation", {0, 0, 0, 2}, "/nodes/2/rotation/3"),
              strictly(edited("skin_without_mesh", "/nodes/3/skin", 0, "/nodes/3/skin")),
              edited("joint_out_of_range", "/skins/0/joints/1", 99),
              strictly(edited("joint_twice", "/skins/0/joints/1", 2, "", "twice")),
              edited("joints_empty", "/skins/0/joints", json::array()),
              accessor_edit("inverse_bind_too_few", kInverseBind, "count", 1, "/skins/0/inverseBindMatrices"),
              edited("inverse_bind_of_vectors", "/skins/0/inverseBindMatrices", kPositions),
          }};
}

BrokenClass animations() {
  const auto edit = [](const char* name, const char* pointer, json value, std::string place, std::string fault = "") {
    return edited(name, (std::string("/animations/0") + pointer).c_str(), std::move(value), "/animations/0" + place,
                  std::move(fault));
  };
  return {
      "AnimationThatDoesNotFitTogether",
      {
          edit("sampler_out_of_range", "/channels/0/sampler", 4, "/channels/0/sampler"),
          edit("sampler_negative", "/channels/0/sampler", -1, "/channels/0/sampler"),
          edit("target_out_of_range", "/channels/0/target/node", 8, "/channels/0/target/node"),
          edit("channels_empty", "/channels", json::array(), "/channels", "moves nothing"),
          edit("pointer_without_extension", "/channels/0/target", {{"path", "pointer"}}, "/channels/0/target",
               "KHR_animation_pointer"),
          edit("path_unknown", "/channels/0/target/path", "visibility", "/channels/0/target/path"),
          edit("target_twice", "/channels/0/target/node", 3, "/channels/2/target", "twice"),
          edit("target_has_a_matrix", "/channels/0/target/node", 7, "/channels/0/target", "matrix"),
          edit("weights_without_mesh", "/channels/3/target/node", 3, "/channels/3/target", "mesh"),
          edit("weights_without_targets", "/channels/3/target/node", 5, "/channels/3/target", "targets"),
          edit("interpolation_unknown", "/samplers/0/interpolation", "BEZIER", "/samplers/0/interpolation"),
          edit("input_out_of_range", "/samplers/0/input", 99, "/samplers/0/input"),
          edit("input_vec3", "/samplers/0/input", kTranslations, "/channels/0"),
          edit("input_integers", "/samplers/0/input", kIndices, "/channels/0"),
          edit("output_of_another_type", "/samplers/0/output", kRotations, "/channels/0"),
          edit("output_too_few", "/samplers/0/input", kWeights, "/channels/0"),
          edit("output_count_differs", "/samplers/0/input", kSplineTimes, "/channels/0", "3 output values for 2 keys"),
          edit("spline_output_too_few", "/samplers/0/interpolation", "CUBICSPLINE", "/channels/0", "needs 9"),
          edit("spline_output_too_many", "/samplers/2/interpolation", "LINEAR", "/channels/2", "needs 2"),
          without("channels_missing", "/animations/0/channels", "/animations/0", "channels"),
          without("samplers_missing", "/animations/0/samplers", "/animations/0", "samplers"),
          without("path_missing", "/animations/0/channels/0/target/path", "/animations/0/channels/0/target", "path"),
      }};
}

BrokenClass cameras_and_lights() {
  const std::string light = "/extensions/KHR_lights_punctual/lights/0";
  return {
      "CameraOrLightImpossible",
      {
          edited("aspect_ratio_zero", "/cameras/0/perspective/aspectRatio", 0),
          edited("field_of_view_zero", "/cameras/0/perspective/yfov", 0),
          edited("field_of_view_pi", "/cameras/0/perspective/yfov", 3.14159265358979),
          edited("field_of_view_negative", "/cameras/0/perspective/yfov", -0.8),
          edited("field_of_view_below_float", "/cameras/0/perspective/yfov", 1e-320),
          without("field_of_view_missing", "/cameras/0/perspective/yfov", "/cameras/0/perspective", "yfov"),
          edited("near_zero", "/cameras/0/perspective/znear", 0),
          edited("near_below_float", "/cameras/0/perspective/znear", 1e-60),
          edited("far_equals_near", "/cameras/0/perspective/zfar", 0.1, "", "znear"),
          edited("far_equals_near_as_float", "/cameras/0/perspective/zfar", 0.1000000000001, "", "znear"),
          edited("far_below_near", "/cameras/1/orthographic/zfar", 0.05, "", "znear"),
          edited("magnification_zero", "/cameras/1/orthographic/xmag", 0),
          edited("magnification_below_float", "/cameras/1/orthographic/ymag", 1e-50),
          edited("lens_negative", "/cameras/0/extensions/TESSERA_lens/apertureRadius", -1),
          without("lens_radius_missing", "/cameras/0/extensions/TESSERA_lens/apertureRadius",
                  "/cameras/0/extensions/TESSERA_lens", "apertureRadius"),
          edited("focus_at_zero", "/cameras/0/extensions/TESSERA_lens/focusDistance", 0),
          edited("light_type_unknown", (light + "/type").c_str(), "area"),
          strictly(without("spot_missing", (light + "/spot").c_str(), light, "spot")),
          edited("cone_inner_above_outer", (light + "/spot/innerConeAngle").c_str(), 0.7, light + "/spot", "inner"),
          edited("cone_inner_equals_outer", (light + "/spot/innerConeAngle").c_str(), 0.6, light + "/spot", "inner"),
          edited("cone_above_half_pi", (light + "/spot/outerConeAngle").c_str(), 1.6),
          edited("range_zero", (light + "/range").c_str(), 0),
          edited("intensity_negative", (light + "/intensity").c_str(), -1),
          edited("color_of_two", (light + "/color").c_str(), {1, 1}),
      }};
}

BrokenClass capture_settings() {
  const auto edit = [](const char* name, const char* pointer, json value, std::string place = "") {
    const std::string full = std::string("/extensions/TESSERA_capture") + pointer;
    return edited(name, full.c_str(), std::move(value), place.empty() ? full : "/extensions/TESSERA_capture" + place);
  };
  return {"CaptureSettingImpossible",
          {
              edit("settings_a_list", "", json::array()),
              edit("resolution_zero", "/resolution", {0, 32}),
              edit("resolution_huge", "/resolution", {64, 16385}),
              edit("resolution_2_to_53", "/resolution", {kTwoTo53, 1}),
              edit("resolution_of_one", "/resolution", {64}),
              edit("resolution_a_fraction", "/resolution", {64.5, 32}),
              edit("frame_rate_zero", "/frameRate", 0),
              edit("frame_rate_negative", "/frameRate", -24),
              edit("shutter_reversed", "/shutter", {0.5, 0.25}),
              edit("shutter_of_three", "/shutter", {0, 0.5, 1}),
              edit("frame_count_zero", "/frames/count", 0),
              edit("first_frame_negative", "/frames/first", -1),
              edit("camera_without_camera", "/camera", 3),
              edit("camera_out_of_range", "/camera", 99),
              edit("exposure_zero", "/exposure", 0),
              edit("environment_negative", "/environment", -1),
              edit("environment_a_list", "/environment", {1, 2}),
              edit("environment_without_file", "/environment", "none.hdr"),
              edit("environment_no_image", "/environment", {{"bufferView", 0}}),
              edit("environment_view_out_of_range", "/environment", {{"bufferView", 99}}, "/environment/bufferView"),
              edit("environment_of_two_kinds", "/environment", {{"uniform", true}, {"bufferView", 0}}),
              edit("background_of_texts", "/background", {"red", "green", "blue"}),
          }};
}

}  // namespace

std::vector<BrokenClass> broken_documents() {
  return {asset_and_extensions(),
          wrong_types(),
          ranges(),
          sparse_accessors(),
          meshes(),
          materials(),
          variants(),
          node_graph(),
          animations(),
          cameras_and_lights(),
          capture_settings()};
}

}  // namespace tessera::test

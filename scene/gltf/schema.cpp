#include "scene/gltf/validation.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "base/text.h"
#include "scene/capture.h"
#include "scene/extensions.h"
#include "scene/gltf/procedure_builder.h"
#include "scene/material.h"
#include "scene/pass_graph.h"

namespace tessera::scene::gltf {
namespace {

using nlohmann::json;

// A rule checks one value and throws when it does not hold. Where a value breaks glTF and has only one meaning, the
// rule makes a note and replaces the value by its meaning.
using Rule = std::function<void(json&, const Place&, Notes&)>;

struct Property {
  std::string name;
  Rule rule;
  bool required = false;
};
constexpr bool kRequired = true;

constexpr double kFloatMax = static_cast<double>(std::numeric_limits<float>::max());

// Writers that have no value for a property write null.
void drop_nulls(json& object, const Place& place, Notes& notes) {
  for (auto member = object.begin(); member != object.end();) {
    if (!member->is_null() || member.key() == "extras") {
      ++member;
      continue;
    }
    notes.violation(place.at(member.key()), "such properties are not there", "is null");
    member = object.erase(member);
  }
}

Rule object(std::vector<Property> properties) {
  return [properties = std::move(properties)](json& value, const Place& place, Notes& notes) {
    if (!value.is_object()) place.refuse("is not an object");
    drop_nulls(value, place, notes);
    for (const Property& property : properties) {
      const auto found = value.find(property.name);
      if (found != value.end())
        property.rule(*found, place.at(property.name), notes);
      else if (property.required)
        place.refuse("lacks the property '{}'", property.name);
    }
  };
}

Rule number(double min = -kFloatMax, double max = kFloatMax, bool exclude_min = false) {
  return [=](json& value, const Place& place, Notes&) {
    if (!value.is_number()) place.refuse("is not a number");
    const double v = value.get<double>();
    // Numbers are kept as floats: a double slightly above the minimum would be rounded to the minimum.
    if (!(v >= min && v <= max) || (exclude_min && static_cast<double>(static_cast<float>(v)) <= min))
      place.refuse("is {}, outside {}{:g}, {:g}]", v, exclude_min ? "(" : "[", min, max);
  };
}

// A number that rounding put outside its range means the nearest one inside.
Rule factor(double min, double max) {
  return [=](json& value, const Place& place, Notes& notes) {
    constexpr double kRounding = 1e-3;
    number(min - kRounding, max == kFloatMax ? max : max + kRounding)(value, place, notes);
    const double v = value.get<double>();
    if (v >= min && v <= max) return;
    notes.violation(place, "taken for the nearest value inside", "is {}, outside [{:g}, {:g}]", v, min, max);
    value = std::clamp(v, min, max);
  };
}

Rule integer(double min = 0, double max = 2147483647.0) {
  return [=](json& value, const Place& place, Notes&) {
    if (!value.is_number() || value.get<double>() != std::floor(value.get<double>()))
      place.refuse("is not a whole number");
    const double v = value.get<double>();
    if (!(v >= min && v <= max)) place.refuse("is {:.0f}, outside [{:.0f}, {:.0f}]", v, min, max);
  };
}

Rule one_of(std::vector<int> allowed) {
  return [allowed = std::move(allowed)](json& value, const Place& place, Notes&) {
    if (value.is_number())
      for (const int a : allowed)
        if (value.get<double>() == a) return;
    place.refuse("is {}, which glTF does not define here", value.dump());
  };
}

Rule choice(std::vector<std::string> allowed) {
  return [allowed = std::move(allowed)](json& value, const Place& place, Notes&) {
    if (value.is_string())
      for (const std::string& a : allowed)
        if (value.get_ref<const std::string&>() == a) return;
    place.refuse("is {}, which glTF does not define here", value.dump());
  };
}

Rule text() {
  return [](json& value, const Place& place, Notes&) {
    if (!value.is_string()) place.refuse("is not a text");
  };
}

// Names are for people.
Rule name() {
  return [](json& value, const Place& place, Notes& notes) {
    if (value.is_string()) return;
    notes.violation(place, "written as it stands there", "is not a text");
    value = value.dump(-1, ' ', true).substr(0, 200);
  };
}

Rule boolean() {
  return [](json& value, const Place& place, Notes&) {
    if (!value.is_boolean()) place.refuse("is not true or false");
  };
}

// glTF forbids empty arrays; they are harmless, exporters write them, and so they load.
Rule list(const Rule& element, std::size_t min_size = 0,
          std::size_t max_size = std::numeric_limits<std::size_t>::max()) {
  return [=](json& value, const Place& place, Notes& notes) {
    if (!value.is_array()) place.refuse("is not an array");
    if (value.size() < min_size) place.refuse("has {} elements, needs at least {}", value.size(), min_size);
    if (value.size() > max_size) place.refuse("has {} elements, allowed are {}", value.size(), max_size);
    for (std::size_t i = 0; i < value.size(); ++i) element(value[i], place.at(i), notes);
  };
}

Rule numbers(std::size_t count, double min = -kFloatMax, double max = kFloatMax) {
  return list(number(min, max), count, count);
}

// Index into a top-level array of the document.
Rule index_of(const json& document, const char* array) {
  const auto found = document.find(array);
  const std::size_t count = found != document.end() && found->is_array() ? found->size() : 0;
  return [=](json& value, const Place& place, Notes& notes) {
    integer(0)(value, place, notes);
    if (value.get<double>() >= static_cast<double>(count))
      place.refuse("points at {}[{}], there are {}", array, value.get<std::int64_t>(), count);
  };
}

Rule map_of(const Rule& value_rule) {
  return [=](json& value, const Place& place, Notes& notes) {
    if (!value.is_object()) place.refuse("is not an object");
    drop_nulls(value, place, notes);
    for (auto& [key, v] : value.items()) value_rule(v, place.at(key), notes);
  };
}

// ---- glTF's objects ---------------------------------------------------------------------------------------------

Rule accessor_rule(const json& d) {
  const Rule sparse = object({
      {"count", integer(0), kRequired},
      {"indices",
       object({{"bufferView", index_of(d, "bufferViews"), kRequired},
               {"byteOffset", integer()},
               {"componentType", one_of({5121, 5123, 5125}), kRequired}}),
       kRequired},
      {"values", object({{"bufferView", index_of(d, "bufferViews"), kRequired}, {"byteOffset", integer()}}), kRequired},
  });
  return object({
      {"bufferView", index_of(d, "bufferViews")},
      {"byteOffset", integer()},
      {"componentType", one_of({5120, 5121, 5122, 5123, 5125, 5126}), kRequired},
      {"normalized", boolean()},
      {"count", integer(0), kRequired},
      {"type", choice({"SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"}), kRequired},
      {"sparse", sparse},
  });
}

Rule texture_info(const json& d, std::vector<Property> more = {}) {
  std::vector<Property> properties = {
      {"index", index_of(d, "textures"), kRequired},
      {"texCoord", integer(0, 63)},
      {"extensions", object({{"KHR_texture_transform", object({{"offset", numbers(2)},
                                                               {"rotation", number()},
                                                               {"scale", numbers(2)},
                                                               {"texCoord", integer(0, 63)}})}})},
  };
  for (Property& property : more) properties.push_back(std::move(property));
  return object(std::move(properties));
}

// Light that a surface gives off may be as bright as its writer says.
constexpr const char* kEmissiveFactor = "/emissiveFactor";

Rule material_number(const MaterialNumber& row) {
  const Rule one = [range = row.range, emissive = row.pointer == kEmissiveFactor](json& value, const Place& place,
                                                                                  Notes& notes) {
    number()(value, place, notes);
    const double v = value.get<double>();
    if (emissive && v > range.high) {
      notes.violation(place, "taken as it is", "is {}, outside [{:g}, {:g}]", v, range.low, range.high);
      return;
    }
    if (range.above_low) return number(range.low, range.high, true)(value, place, notes);
    factor(range.zero_besides ? 0 : range.low, range.high)(value, place, notes);
    if (range.zero_besides && value != 0 && value.get<double>() < range.low)
      place.refuse("is {}, must be 0 or at least {}", v, range.low);
  };
  const auto count = static_cast<std::size_t>(row.components);
  return row.components == 1 ? one : list(one, count, count);
}

// The parameters that an object of a material has by the rows of material_extensions.def.
std::vector<Property> material_parameters(const json& d, const std::string& object) {
  const auto numbers_of = [](const std::string& owner) {
    std::vector<Property> properties;
    for (const MaterialNumber& row : material_numbers())
      if (const std::size_t end = row.pointer.rfind('/'); row.pointer.substr(0, end) == owner)
        properties.push_back({row.pointer.substr(end + 1), material_number(row)});
    return properties;
  };
  std::vector<Property> properties = numbers_of(object);
  for (const MaterialTextureRow& row : material_textures())
    if (row.object == object) properties.push_back({row.name, texture_info(d, numbers_of(object + "/" + row.name))});
  return properties;
}

Rule material_rule(const json& d) {
  std::vector<Property> extensions = {
      {"TESSERA_displacement",
       object({{"texture", texture_info(d), kRequired}, {"scale", number()}, {"bias", number()}})}};
  for (const Extension& extension : supported_extensions())
    if (extension.extends == "material" && !extension.name.starts_with("TESSERA_")) {
      const std::string name(extension.name);
      extensions.push_back({name, object(material_parameters(d, "/extensions/" + name))});
    }
  std::vector<Property> properties = material_parameters(d, "");
  properties.insert(properties.end(),
                    {{"name", name()},
                     {"pbrMetallicRoughness", object(material_parameters(d, "/pbrMetallicRoughness"))},
                     {"alphaMode", choice({"OPAQUE", "MASK", "BLEND"})},
                     {"doubleSided", boolean()},
                     {"extensions", object(std::move(extensions))}});
  return object(std::move(properties));
}

Rule subdivision_rule() {
  const auto features = [](std::size_t min_vertices) {
    return list(
        object({{"vertices", list(integer(0, 4294967295.0), min_vertices), kRequired}, {"sharpness", number(0, 10)}}));
  };
  return object({
      {"scheme", choice({"catmullClark"})},
      {"levels", integer(0, 4)},
      {"quads", integer()},
      {"boundary", choice({"edge", "edgeAndCorner"})},
      {"creases", features(2)},
      {"corners", features(1)},
  });
}

// Index into a list that an extension has beside the document's arrays.
Rule index_below(std::size_t count, const char* what) {
  return [=](json& value, const Place& place, Notes& notes) {
    integer(0)(value, place, notes);
    if (value.get<double>() >= static_cast<double>(count))
      place.refuse("points at {} {}, there are {}", what, value.get<std::int64_t>(), count);
  };
}

// Elements of a list of an extension of the document, as far as it is one.
std::size_t extension_count(const json& d, const char* pointer) {
  const json::json_pointer list(pointer);
  return d.is_object() && d.contains(list) && d.at(list).is_array() ? d.at(list).size() : 0;
}

Rule mesh_rule(const json& d) {
  const Rule variant = index_below(extension_count(d, "/extensions/KHR_materials_variants/variants"), "variant");
  const Rule mapping =
      object({{"variants", list(variant), kRequired}, {"material", index_of(d, "materials"), kRequired}});
  const Rule attributes = map_of(index_of(d, "accessors"));
  const Rule primitive = object({
      {"attributes", attributes, kRequired},
      {"indices", index_of(d, "accessors")},
      {"material", index_of(d, "materials")},
      {"mode", integer(0, 6)},
      {"targets", list(attributes)},
      {"extensions",
       object({{"KHR_draco_mesh_compression", object({{"bufferView", index_of(d, "bufferViews"), kRequired},
                                                      {"attributes", map_of(integer()), kRequired}})},
               {"KHR_materials_variants", object({{"mappings", list(mapping), kRequired}})},
               {"TESSERA_bezier_patches", object({{"count", integer(1), kRequired}})},
               {"TESSERA_clusters", object({{"maxVertices", integer(3), kRequired},
                                            {"maxTriangles", integer(1), kRequired},
                                            {"range", integer(1), kRequired},
                                            {"encoding", choice({"quantised", "meshlet", "dgf"})},
                                            {"bits", integer(1, 24)},
                                            {"clusters", integer(1)},
                                            {"bufferView", index_of(d, "bufferViews")}})},
               {"TESSERA_subdivision", subdivision_rule()}})},
  });
  return object({{"name", name()}, {"primitives", list(primitive, 1), kRequired}, {"weights", list(number())}});
}

Rule camera_rule() {
  const Rule perspective = object({
      {"aspectRatio", number(0, kFloatMax, true)},
      {"yfov", number(0, 3.14159265, true), kRequired},
      {"zfar", number(0, kFloatMax, true)},
      {"znear", number(0, kFloatMax, true), kRequired},
  });
  const Rule orthographic = object({
      {"xmag", number(), kRequired},
      {"ymag", number(), kRequired},
      {"zfar", number(0, kFloatMax, true), kRequired},
      {"znear", number(0), kRequired},
  });
  return object({
      {"name", name()},
      {"type", choice({"perspective", "orthographic"}), kRequired},
      {"perspective", perspective},
      {"orthographic", orthographic},
      {"extensions", object({{"TESSERA_lens", object({{"apertureRadius", number(0), kRequired},
                                                      {"focusDistance", number(0, kFloatMax, true)}})}})},
  });
}

Rule node_rule(const json& d) {
  const Rule light = index_below(extension_count(d, "/extensions/KHR_lights_punctual/lights"), "light");
  return object({
      {"name", name()},
      {"camera", index_of(d, "cameras")},
      {"children", list(index_of(d, "nodes"))},
      {"skin", index_of(d, "skins")},
      {"matrix", numbers(16)},
      {"mesh", index_of(d, "meshes")},
      {"rotation", numbers(4)},
      {"scale", numbers(3)},
      {"translation", numbers(3)},
      {"weights", list(number())},
      {"extensions",
       object({{"EXT_mesh_gpu_instancing", object({{"attributes", map_of(index_of(d, "accessors")), kRequired}})},
               {"KHR_lights_punctual", object({{"light", light, kRequired}})},
               {"KHR_node_visibility", object({{"visible", boolean()}})},
               {"TESSERA_procedure",
                [&d, programs = std::make_shared<ProgramCache>()](json& value, const Place& place, Notes&) {
                  check_procedure_schema(d, value, *programs, place);
                }}})},
  });
}

Rule animation_rule(const json& d) {
  const Rule target = object({
      {"node", index_of(d, "nodes")},
      {"path", choice({"translation", "rotation", "scale", "weights", "pointer"}), kRequired},
      {"extensions", object({{"KHR_animation_pointer", object({{"pointer", text(), kRequired}})}})},
  });
  const Rule sampler = object({
      {"input", index_of(d, "accessors"), kRequired},
      {"interpolation", choice({"LINEAR", "STEP", "CUBICSPLINE"})},
      {"output", index_of(d, "accessors"), kRequired},
  });
  // An animation without channels is refused: its writer's channels are lost.
  const Rule channels = [channel = list(object({{"sampler", integer(), kRequired}, {"target", target, kRequired}}))](
                            json& value, const Place& place, Notes& notes) {
    channel(value, place, notes);
    if (value.empty()) place.refuse("are none: an animation without channels moves nothing");
  };
  return object({
      {"name", name()},
      {"channels", channels, kRequired},
      {"samplers", list(sampler), kRequired},
  });
}

Rule light_rule() {
  constexpr double kHalfPi = 1.5707963267948966;
  return object({
      {"name", name()},
      {"type", choice({"directional", "point", "spot"}), kRequired},
      {"color", list(factor(0, kFloatMax), 3, 3)},
      {"intensity", number(0)},
      {"range", number(0, kFloatMax, true)},
      {"spot", object({{"innerConeAngle", number(0, kHalfPi)}, {"outerConeAngle", number(0, kHalfPi + 1e-6, true)}})},
  });
}

Rule environment_rule(const json& d) {
  const Rule names = object({
      {"image", text()},
      {"bufferView", index_of(d, "bufferViews")},
      {"uniform", boolean()},
      {"intensity", number(0, 1e6)},
      {"rotation", number(-1e6, 1e6)},
  });
  return [=](json& value, const Place& place, Notes& notes) {
    if (value.is_number()) return number(0, 1e6)(value, place, notes);
    if (value.is_string()) return;
    if (!value.is_object()) place.refuse("is neither a number, a text nor an object");
    names(value, place, notes);
    if (int{value.contains("image")} + int{value.contains("bufferView")} + int{value.value("uniform", false)} > 1)
      place.refuse("names more than one of image, bufferView and uniform");
  };
}

Rule shadows_rule(const json& d) {
  const Rule light = index_below(extension_count(d, "/extensions/KHR_lights_punctual/lights"), "light");
  const Rule shadow = object({
      {"light", light, kRequired},
      {"size", integer(1, ShadowRequest::kMaxSize)},
      {"cascades", integer(1, ShadowRequest::kMaxCascades)},
      {"distance", number(0)},
  });
  return [=](json& value, const Place& place, Notes& notes) {
    list(shadow)(value, place, notes);
    if (value.size() > ShadowRequest::kMaxLights)
      place.refuse("are of {} lights, at most {} may cast", value.size(), ShadowRequest::kMaxLights);
  };
}

// One of an enumeration's names.
Rule word_of(std::span<const std::string_view> names) {
  return [=](json& value, const Place& place, Notes&) {
    if (!value.is_string() || std::find(names.begin(), names.end(), value.get_ref<const std::string&>()) == names.end())
      place.refuse("is {}, not one of {}", escape_control(value.dump(-1, ' ', true), 60), fmt::join(names, ", "));
  };
}

constexpr std::size_t kMaxNameBytes = 64;  // of an attachment or a pass

Rule short_name() {
  return [](json& value, const Place& place, Notes&) {
    if (!value.is_string()) place.refuse("is not a text");
    const std::size_t bytes = value.get_ref<const std::string&>().size();
    if (bytes == 0 || bytes > kMaxNameBytes)
      place.refuse("is a name of {} bytes, allowed are 1 to {}", bytes, kMaxNameBytes);
  };
}

Rule attachments_rule() {
  const Rule attachment = object({
      {"format", word_of(kAttachmentFormatNames), kRequired},
      {"size", list(integer(1, Attachment::kMaxSize), 2, 2)},
      {"scale", number(0, 16, true)},
      {"samples", one_of({1, 2, 4, 8, Attachment::kMaxSamples})},
      {"layers", integer(1, Attachment::kMaxLayers)},
      {"levels", integer(1, Attachment::kMaxLevels)},
      {"life", word_of(kAttachmentLifeNames)},
  });
  return [=](json& value, const Place& place, Notes& notes) {
    map_of(attachment)(value, place, notes);
    if (value.size() > PassGraph::kMaxAttachments)
      place.refuse("are {}, allowed are {}", value.size(), PassGraph::kMaxAttachments);
    for (const auto& [name, a] : value.items()) {
      json key = name;
      short_name()(key, place.at(name), notes);
      if (a.contains("size") && a.contains("scale")) place.at(name).refuse("has both a size and a scale");
    }
  };
}

Rule passes_rule() {
  const Rule names = list(short_name(), 0, PassGraph::kMaxAttachments);
  const std::vector<Property> of_subpass = {
      {"draw", word_of(std::span(kDrawFilterNames).subspan(1))},
      {"shader", word_of(kPassShaderNames)},
      {"input", names},
      {"write", names},
      {"sample", names},
  };
  std::vector<Property> subpass = of_subpass, pass = of_subpass;
  subpass[1].required = true;
  pass.insert(pass.end(), {
                              {"name", short_name(), kRequired},
                              {"view", word_of(kPassViewNames)},
                              {"subpasses", list(object(subpass), 1, Pass::kMaxSubpasses)},
                              {"load", map_of(word_of(kLoadActionNames))},
                              {"store", map_of(word_of(kStoreActionNames))},
                          });
  const Rule one = [=, fields = object(pass)](json& value, const Place& place, Notes& notes) {
    fields(value, place, notes);
    const bool listed = value.contains("subpasses");
    if (!listed && !value.contains("shader")) place.refuse("lacks the property 'shader', or 'subpasses'");
    for (const Property& property : of_subpass)
      if (listed && value.contains(property.name)) place.at(property.name).refuse("belongs to one of the subpasses");
  };
  return list(one, 1, PassGraph::kMaxPasses);
}

Rule capture_settings_rule(const json& d) {
  return object({
      {"resolution", list(integer(1, 16384), 2, 2)},
      {"frameRate", number(0, 1e6, true)},
      {"shutter", numbers(2, -1, 2)},
      {"frames", object({{"first", integer(0, 1e8)}, {"count", integer(1, 1e8)}})},
      {"camera", index_of(d, "nodes")},
      {"animations", list(index_of(d, "animations"))},
      {"exposure", number(0, 1e6, true)},
      {"environment", environment_rule(d)},
      {"background", numbers(3, 0)},
      {"shadows", shadows_rule(d)},
      {"attachments", attachments_rule()},
      {"passes", passes_rule()},
  });
}

// EXT_meshopt_compression and KHR_meshopt_compression of a buffer view.
Rule meshopt_rule(const json& d, std::vector<std::string> filters) {
  return object({
      {"buffer", index_of(d, "buffers"), kRequired},
      {"byteOffset", integer(0, 9007199254740992.0)},
      {"byteLength", integer(1, 9007199254740992.0), kRequired},
      {"byteStride", integer(2, 256), kRequired},
      {"count", integer(1), kRequired},
      {"mode", choice({"ATTRIBUTES", "TRIANGLES", "INDICES"}), kRequired},
      {"filter", choice(std::move(filters))},
  });
}

Rule buffer_view_rule(const json& d) {
  return object({
      {"buffer", index_of(d, "buffers"), kRequired},
      {"byteOffset", integer(0, 9007199254740992.0)},
      {"byteLength", integer(0, 9007199254740992.0), kRequired},
      {"byteStride", integer(4, 252)},
      {"extensions",
       object({{"EXT_meshopt_compression", meshopt_rule(d, {"NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL"})},
               {"KHR_meshopt_compression",
                meshopt_rule(d, {"NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"})}})},
  });
}

Rule buffer_rule() {
  const Rule meshopt = object({{"fallback", boolean()}});
  return object({
      {"uri", text()},
      {"byteLength", integer(0, 9007199254740992.0), kRequired},
      {"extensions", object({{"EXT_meshopt_compression", meshopt}, {"KHR_meshopt_compression", meshopt}})},
  });
}

// A magnified texture uses no mip levels: for a filter with mip levels, its part within one level counts.
Rule magnifying_filter() {
  return [](json& value, const Place& place, Notes& notes) {
    one_of({9728, 9729, 9984, 9985, 9986, 9987})(value, place, notes);
    if (value == 9728 || value == 9729) return;
    notes.violation(place, "no levels are read where a texture is magnified", "is {}, a filter of mip levels",
                    value.dump());
    value = value == 9984 || value == 9986 ? 9728 : 9729;
  };
}

Rule document_rule(const json& d) {
  const Rule sampler = object({
      {"magFilter", magnifying_filter()},
      {"minFilter", one_of({9728, 9729, 9984, 9985, 9986, 9987})},
      {"wrapS", one_of({33071, 33648, 10497})},
      {"wrapT", one_of({33071, 33648, 10497})},
  });
  return object({
      {"asset", object({{"version", text(), kRequired}, {"minVersion", text()}}), kRequired},
      {"extensionsUsed", list(text())},
      {"extensionsRequired", list(text())},
      // First, because other members point into it.
      {"extensions", object({{"KHR_lights_punctual", object({{"lights", list(light_rule()), kRequired}})},
                             {"KHR_materials_variants",
                              object({{"variants", list(object({{"name", text(), kRequired}})), kRequired}})},
                             {"TESSERA_capture", capture_settings_rule(d)},
                             {"TESSERA_procedure", object({{"programs", list(text())}})}})},
      {"accessors", list(accessor_rule(d))},
      {"animations", list(animation_rule(d))},
      {"buffers", list(buffer_rule())},
      {"bufferViews", list(buffer_view_rule(d))},
      {"cameras", list(camera_rule())},
      {"images", list(object({{"uri", text()}, {"mimeType", text()}, {"bufferView", index_of(d, "bufferViews")}}))},
      {"materials", list(material_rule(d))},
      {"meshes", list(mesh_rule(d))},
      {"nodes", list(node_rule(d))},
      {"samplers", list(sampler)},
      {"scene", index_of(d, "scenes")},
      {"scenes", list(object({{"name", name()}, {"nodes", list(index_of(d, "nodes"))}}))},
      {"skins", list(object({{"inverseBindMatrices", index_of(d, "accessors")},
                             {"skeleton", index_of(d, "nodes")},
                             {"joints", list(index_of(d, "nodes"), 1), kRequired}}))},
      {"textures",
       list(object({{"sampler", index_of(d, "samplers")},
                    {"source", index_of(d, "images")},
                    {"extensions", object({{"EXT_texture_webp", object({{"source", index_of(d, "images")}})},
                                           {"KHR_texture_basisu", object({{"source", index_of(d, "images")}})}})}}))},
  });
}

// glTF 1.0 has objects where glTF 2.0 has arrays, and may leave out its version.
void check_generation(const json& document, const Place& root) {
  if (!document.is_object()) return;
  const json* asset = find(document, "asset");
  const json* version = asset != nullptr && asset->is_object() ? find(*asset, "version") : nullptr;
  const bool says_1 =
      version != nullptr && (version->is_string() ? version->get_ref<const std::string&>().starts_with("1.")
                                                  : version->is_number() && *version == 1.0);
  const bool looks_so =
      version == nullptr && document.value("meshes", json()).is_object() && document.value("nodes", json()).is_object();
  if (says_1 || looks_so)
    root.at("asset").at("version").refuse(
        "glTF 1.0 is not read; convert it to glTF 2.0, for example with gltf-pipeline");
}

}  // namespace

void check_schema(json& document, const Place& root, Notes& notes) {
  check_generation(document, root);
  document_rule(document)(document, root, notes);
}

}  // namespace tessera::scene::gltf

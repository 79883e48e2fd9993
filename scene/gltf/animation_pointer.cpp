#include "scene/gltf/animation_pointer.h"

#include <charconv>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

namespace tessera::scene::gltf {
namespace {

using nlohmann::json;

// A property as the glTF 2.0 Asset Object Model names it; "#" is a number.
struct PointedProperty {
  std::string_view pointer;
  AnimatedPath path;
  int components;
  bool has_default = true;
};
constexpr PointedProperty kProperties[] = {
    {"/nodes/#/translation", AnimatedPath::kTranslation, 3},
    {"/nodes/#/rotation", AnimatedPath::kRotation, 4},
    {"/nodes/#/scale", AnimatedPath::kScale, 3},
    {"/nodes/#/weights", AnimatedPath::kWeights, 1},
    {"/nodes/#/extensions/KHR_node_visibility/visible", AnimatedPath::kVisible, 1},
    {"/cameras/#/perspective/yfov", AnimatedPath::kFieldOfView, 1},
    {"/cameras/#/perspective/znear", AnimatedPath::kNear, 1},
    {"/cameras/#/perspective/zfar", AnimatedPath::kFar, 1, false},
    {"/cameras/#/orthographic/xmag", AnimatedPath::kXMag, 1},
    {"/cameras/#/orthographic/ymag", AnimatedPath::kYMag, 1},
    {"/cameras/#/orthographic/znear", AnimatedPath::kNear, 1},
    {"/cameras/#/orthographic/zfar", AnimatedPath::kFar, 1},
    {"/extensions/KHR_lights_punctual/lights/#/color", AnimatedPath::kLightColor, 3},
    {"/extensions/KHR_lights_punctual/lights/#/intensity", AnimatedPath::kLightIntensity, 1},
    {"/extensions/KHR_lights_punctual/lights/#/range", AnimatedPath::kLightRange, 1, false},
    {"/extensions/KHR_lights_punctual/lights/#/spot/innerConeAngle", AnimatedPath::kInnerCone, 1},
    {"/extensions/KHR_lights_punctual/lights/#/spot/outerConeAngle", AnimatedPath::kOuterCone, 1},
};

// The members that KHR_texture_transform adds to a texture.
constexpr PointedProperty kShifts[] = {
    {"/extensions/KHR_texture_transform/offset", AnimatedPath::kTextureOffset, 2},
    {"/extensions/KHR_texture_transform/rotation", AnimatedPath::kTextureRotation, 1},
    {"/extensions/KHR_texture_transform/scale", AnimatedPath::kTextureScale, 2},
};

// The rest of `pointer` after `pattern`, or nothing where it does not begin with it; `digits` gets the text that
// matched "#".
std::optional<std::string_view> rest_behind(std::string_view pointer, std::string_view pattern,
                                            std::string_view& digits) {
  const std::size_t hash = pattern.find('#');
  if (!pointer.starts_with(pattern.substr(0, hash))) return std::nullopt;
  pointer.remove_prefix(hash);
  digits = pointer.substr(0, pointer.find('/'));
  pointer.remove_prefix(digits.size());
  const std::string_view tail = pattern.substr(hash + 1);
  if (!pointer.starts_with(tail)) return std::nullopt;
  return pointer.substr(tail.size());
}

// The number of an object of the list that holds it. Nothing for a text that is no index (RFC 6901 section 4).
std::optional<int> object_of(const json& document, std::string_view pointer, std::string_view digits,
                             const Place& place) {
  int number = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  if (digits.empty() || error != std::errc() || end != digits.data() + digits.size() || number < 0 ||
      (digits.size() > 1 && digits[0] == '0'))
    return std::nullopt;
  const json::json_pointer list(
      std::string(pointer.substr(0, static_cast<std::size_t>(digits.data() - pointer.data()) - 1)));
  const std::size_t count = document.contains(list) ? document.at(list).size() : 0;
  if (static_cast<std::size_t>(number) >= count)
    place.refuse("points at {}/{}, there are {}", list.to_string(), number, count);
  return number;
}

bool is_defined(const json& document, const std::string& pointer, bool has_default) {
  const json::json_pointer property(pointer);
  return document.contains(has_default ? property.parent_pointer() : property);
}

// STAGE/NAME of a node's procedure. Parameters that are not given have defaults.
std::optional<PointerTarget> resolve_parameter(const json& document, int node, std::string_view rest,
                                               ProgramCache& programs, const Place& place) {
  const json& object = document["nodes"][static_cast<std::size_t>(node)];
  const json* procedure = find_extension(object, "TESSERA_procedure");
  if (procedure == nullptr) return std::nullopt;
  const std::size_t slash = rest.find('/');
  if (slash == std::string_view::npos) return std::nullopt;
  const std::optional<StageParameter> found =
      find_stage_parameter(document, *procedure, rest.substr(0, slash), rest.substr(slash + 1), programs, place);
  if (!found) return std::nullopt;
  return PointerTarget{found->path, node, found->part, found->components, found->values, true};
}

}  // namespace

std::optional<PointerTarget> resolve_pointer(const json& document, const std::string& pointer, ProgramCache& programs,
                                             const Place& place) {
  std::string_view digits;
  if (const auto rest = rest_behind(pointer, "/nodes/#/extensions/TESSERA_procedure/", digits)) {
    const std::optional<int> node = object_of(document, pointer, digits, place);
    return node ? resolve_parameter(document, *node, *rest, programs, place) : std::nullopt;
  }
  for (const PointedProperty& property : kProperties)
    if (rest_behind(pointer, property.pointer, digits) == "") {
      const std::optional<int> object = object_of(document, pointer, digits, place);
      if (!object) return std::nullopt;
      const int values = property.path == AnimatedPath::kWeights ? 0 : 1;
      return PointerTarget{property.path,       *object, 0,
                           property.components, values,  is_defined(document, pointer, property.has_default)};
    }
  const auto in_material = [&](AnimatedPath path, std::size_t part, int components) -> std::optional<PointerTarget> {
    const std::optional<int> object = object_of(document, pointer, digits, place);
    if (!object) return std::nullopt;
    return PointerTarget{path, *object, static_cast<int>(part), components, 1, is_defined(document, pointer, true)};
  };
  const std::optional<std::string_view> rest = rest_behind(pointer, "/materials/#", digits);
  if (!rest) return std::nullopt;
  for (std::size_t number = 0; number < material_numbers().size(); ++number)
    if (const MaterialNumber& row = material_numbers()[number]; row.animated && *rest == row.pointer)
      return in_material(AnimatedPath::kMaterialNumber, number, row.components);
  for (const MaterialTextureRow& row : material_textures())
    for (const PointedProperty& shift : kShifts)
      if (!row.replaces && *rest == row.object + "/" + row.name + std::string(shift.pointer))
        return in_material(shift.path, static_cast<std::size_t>(row.slot), shift.components);
  return std::nullopt;
}

const std::string* animation_pointer(const json& channel) {
  const json& target = channel["target"];
  return target["path"] == "pointer"
             ? &target["extensions"]["KHR_animation_pointer"]["pointer"].get_ref<const std::string&>()
             : nullptr;
}

}  // namespace tessera::scene::gltf

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>

#include "base/text.h"
#include "scene/gltf/accessor_layout.h"
#include "scene/gltf/animation_pointer.h"
#include "scene/gltf/validation.h"

namespace tessera::scene::gltf::validation {
namespace {

using nlohmann::json;

// Identity of a moved property: path, object, part of it.
using Moved = std::tuple<AnimatedPath, std::size_t, int>;

const std::map<std::string, AnimatedPath>& node_paths() {
  static const std::map<std::string, AnimatedPath> kPaths = {{"translation", AnimatedPath::kTranslation},
                                                             {"rotation", AnimatedPath::kRotation},
                                                             {"scale", AnimatedPath::kScale},
                                                             {"weights", AnimatedPath::kWeights}};
  return kPaths;
}

const json& sampler_of(const json& animation, const json& channel, const Place& place) {
  const auto index = channel["sampler"].get<std::size_t>();
  if (index >= animation["samplers"].size())
    place.at("sampler").refuse("points at sampler {}, there are {}", index, animation["samplers"].size());
  return animation["samplers"][index];
}

bool is_cubic(const json& sampler) { return sampler.value("interpolation", std::string("LINEAR")) == "CUBICSPLINE"; }

// Values of a key: the weights of the node's mesh, or one.
std::uint64_t values_of(const json& d, AnimatedPath path, std::size_t node_index, const Place& place) {
  const json& node = d["nodes"][node_index];
  if (path == AnimatedPath::kWeights) {
    if (!node.contains("mesh")) place.refuse("animates weights of a node without a mesh");
    const std::size_t targets = target_count(d["meshes"][node["mesh"].get<std::size_t>()]);
    if (targets == 0) place.refuse("animates weights of a mesh without morph targets");
    return targets;
  }
  if (path != AnimatedPath::kVisible && node.contains("matrix")) place.refuse("animates a node that has a matrix");
  return 1;
}

void check_count(const json& d, const json& sampler, std::uint64_t values_per_key, const Place& place) {
  const auto keys = d["accessors"][sampler["input"].get<std::size_t>()]["count"].get<std::uint64_t>();
  const auto values = d["accessors"][sampler["output"].get<std::size_t>()]["count"].get<std::uint64_t>();
  const std::uint64_t needed = keys * values_per_key * (is_cubic(sampler) ? 3 : 1);
  if (values != needed) place.refuse("has {} output values for {} keys, needs {}", values, keys, needed);
}

// A channel of glTF itself. Nothing where it has no node: it is to be ignored.
std::optional<Moved> check_node_channel(const json& d, const json& channel, const json& sampler, const Place& place) {
  const auto& name = channel["target"]["path"].get_ref<const std::string&>();
  const AnimatedPath path = node_paths().at(name);
  const bool integers_allowed = path == AnimatedPath::kRotation || path == AnimatedPath::kWeights;
  const std::vector<int> normalized =
      integers_allowed ? std::vector<int>{kByte, kUnsignedByte, kShort, kUnsignedShort} : std::vector<int>{};
  const int components = path == AnimatedPath::kRotation ? 4 : path == AnimatedPath::kWeights ? 1 : 3;
  check_format(d, sampler["output"].get<std::size_t>(), {{components}, {kFloat}, normalized}, place);
  const json* node = find(channel["target"], "node");
  // Without a node the number of weights cannot be known.
  if (node == nullptr && path == AnimatedPath::kWeights) return std::nullopt;
  check_count(d, sampler, node == nullptr ? 1 : values_of(d, path, node->get<std::size_t>(), place.at("target")),
              place);
  if (node == nullptr) return std::nullopt;
  return Moved{path, node->get<std::size_t>(), 0};
}

// A channel of KHR_animation_pointer. Nothing where it is skipped.
std::optional<Moved> check_pointer_channel(const json& d, const json& channel, const json& sampler, const Place& place,
                                           ProgramCache& programs, Notes& notes) {
  const json* named = find_extension(channel["target"], "KHR_animation_pointer");
  if (named == nullptr) place.at("target").refuse("has the path pointer without KHR_animation_pointer");
  if (channel["target"].contains("node"))
    notes.violation(place.at("target"), "its pointer holds", "has both a pointer and a node");
  const Place at = place.at("target").at("extensions").at("KHR_animation_pointer").at("pointer");
  const auto& pointer = (*named)["pointer"].get_ref<const std::string&>();
  const std::optional<PointerTarget> target = resolve_pointer(d, pointer, programs, at);
  if (!target) {
    notes.add(at, "channels of unread properties are skipped", "is " + escape_control(pointer, 120));
    return std::nullopt;
  }
  if (!target->defined) {
    notes.violation(at, "such channels are skipped", "is {}, which the asset does not have",
                    escape_control(pointer, 120));
    return std::nullopt;
  }
  const bool is_boolean = target->path == AnimatedPath::kVisible;
  const std::vector<int> small = {kByte, kUnsignedByte, kShort, kUnsignedShort};
  const std::vector<int> all = {kByte, kUnsignedByte, kShort, kUnsignedShort, kUnsignedInt, kFloat};
  const auto output = sampler["output"].get<std::size_t>();
  if (is_boolean)
    check_format(d, output, {{1}, {kUnsignedByte}, {}}, place);
  else
    check_format(d, output, {{target->components}, all, small}, place);
  if (is_boolean && sampler.value("interpolation", std::string("LINEAR")) != "STEP") {
    if (is_cubic(sampler)) place.refuse("interpolates true and false by a cubic spline");
    notes.violation(place, "they change in steps", "interpolates true and false");
  }
  const auto object = static_cast<std::size_t>(target->object);
  const bool of_node = target->path <= AnimatedPath::kVisible;
  check_count(d, sampler, of_node ? values_of(d, target->path, object, at) : static_cast<std::uint64_t>(target->values),
              place);
  return Moved{target->path, object, target->part};
}

}  // namespace

void check_animations(const json& d, const Place& root, Notes& notes) {
  const json& animations = list_of(d, "animations");
  ProgramCache programs;
  for (std::size_t a = 0; a < animations.size(); ++a) {
    const Place place = root.at("animations").at(a);
    std::set<Moved> moved;
    const json& channels = animations[a]["channels"];
    for (std::size_t c = 0; c < channels.size(); ++c) {
      const Place inner = place.at("channels").at(c);
      const json& sampler = sampler_of(animations[a], channels[c], inner);
      check_format(d, sampler["input"].get<std::size_t>(), {{1}, {kFloat}, {}}, inner);
      const std::optional<Moved> here = channels[c]["target"]["path"] == "pointer"
                                            ? check_pointer_channel(d, channels[c], sampler, inner, programs, notes)
                                            : check_node_channel(d, channels[c], sampler, inner);
      if (here && !moved.insert(*here).second)
        notes.violation(inner.at("target"), "the last channel counts", "is animated twice in one animation");
    }
  }
}

}  // namespace tessera::scene::gltf::validation

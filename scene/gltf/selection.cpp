#include "scene/gltf/selection.h"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <map>
#include <string>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/text.h"
#include "scene/capture.h"
#include "scene/gltf/validation.h"

namespace tessera::scene::gltf {
namespace {

using nlohmann::json;

std::string name_of(const json& object) { return object.value("name", std::string()); }

// "0 'Survey', 1 'Walk'", for people; a file may have any number.
std::string listed(const json& list) {
  constexpr std::size_t kMaxListed = 20;
  std::string text;
  for (std::size_t i = 0; i < std::min(list.size(), kMaxListed); ++i) {
    const std::string name = name_of(list[i]);
    text += fmt::format("{}{}{}", i == 0 ? "" : ", ", i,
                        name.empty() ? "" : fmt::format(" '{}'", escape_control(name, 60)));
  }
  if (list.size() > kMaxListed) text += fmt::format(" and {} more", list.size() - kMaxListed);
  return list.empty() ? "none" : text;
}

[[noreturn]] void refuse(const char* what, const std::string& wanted, const json& list, const Place& root) {
  throw UsageError(fmt::format("no {} '{}' in {}, which has {}", what, escape_control(wanted, 80),
                               escape_control(root.file()), listed(list)));
}

std::optional<std::size_t> number_in(const std::string& text, const json& list) {
  std::size_t number = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (fault != std::errc() || end != text.data() + text.size() || number >= list.size()) return std::nullopt;
  return number;
}

std::optional<std::size_t> named(const json& list, const std::string& name) {
  const auto found =
      std::find_if(list.begin(), list.end(), [&](const json& object) { return name_of(object) == name; });
  return found == list.end() ? number_in(name, list) : std::optional(static_cast<std::size_t>(found - list.begin()));
}

int find_camera(const json& document, int scene, const std::string& wanted, const Place& root) {
  const json &nodes = list_of(document, "nodes"), &cameras = list_of(document, "cameras");
  std::optional<std::size_t> camera = named(cameras, wanted);
  const std::vector<std::size_t> drawn = drawn_nodes(document, scene);
  // A camera's own name counts before a node's, a node's before a number.
  const bool by_number = camera && name_of(cameras[*camera]) != wanted;
  const auto node = std::find_if(drawn.begin(), drawn.end(), [&](std::size_t n) {
    return nodes[n].contains("camera") && name_of(nodes[n]) == wanted;
  });
  if (node != drawn.end() && (!camera || by_number)) return static_cast<int>(*node);
  if (!camera) refuse("camera", wanted, cameras, root);
  const auto holder = std::find_if(drawn.begin(), drawn.end(), [&](std::size_t n) {
    return nodes[n].contains("camera") && nodes[n]["camera"].get<std::size_t>() == *camera;
  });
  if (holder == drawn.end())
    throw UsageError(fmt::format("camera '{}' of {} is in no node of the scene that is drawn; --scene draws another",
                                 escape_control(wanted, 80), escape_control(root.file())));
  return static_cast<int>(*holder);
}

}  // namespace

std::vector<std::size_t> drawn_nodes(const json& document, int scene) {
  const json &nodes = list_of(document, "nodes"), &scenes = list_of(document, "scenes");
  std::vector<std::size_t> drawn;
  if (scenes.empty()) {
    for (std::size_t n = 0; n < nodes.size(); ++n) drawn.push_back(n);
    return drawn;
  }
  const auto number = scene == kNone ? document.value("scene", std::size_t{0}) : static_cast<std::size_t>(scene);
  const json& roots = list_of(scenes[number], "nodes");
  std::vector<std::size_t> waiting;
  for (auto root = roots.rbegin(); root != roots.rend(); ++root) waiting.push_back(root->get<std::size_t>());
  while (!waiting.empty()) {
    drawn.push_back(waiting.back());
    waiting.pop_back();
    for (const json& child : list_of(nodes[drawn.back()], "children")) waiting.push_back(child.get<std::size_t>());
  }
  std::sort(drawn.begin(), drawn.end());
  return drawn;
}

Selected select(const json& document, const Selection& selection, const Place& root) {
  Selected selected;
  if (selection.scene) {
    const json& scenes = list_of(document, "scenes");
    const std::optional<std::size_t> scene = named(scenes, *selection.scene);
    if (!scene) refuse("scene", *selection.scene, scenes, root);
    selected.scene = static_cast<int>(*scene);
  }
  if (selection.camera) selected.camera_node = find_camera(document, selected.scene, *selection.camera, root);
  if (!selection.animation) return selected;
  selected.all_animations = *selection.animation == "all";
  if (selected.all_animations) return selected;
  selected.animations.emplace();
  if (*selection.animation == "none") return selected;
  const json& animations = list_of(document, "animations");
  const std::optional<std::size_t> animation = named(animations, *selection.animation);
  if (!animation) refuse("animation", *selection.animation, animations, root);
  selected.animations->push_back(static_cast<int>(*animation));
  return selected;
}

SceneList list_scenes(const json& document) {
  SceneList list;
  for (const json& scene : list_of(document, "scenes")) list.names.push_back(name_of(scene));
  if (!list.names.empty()) list.drawn = document.value("scene", 0);
  return list;
}

namespace {

using nlohmann::json;

// A primitive's mappings, or null.
const json* mappings_of(const json& primitive) {
  const json* variants = find_extension(primitive, kVariants);
  return variants == nullptr ? nullptr : &(*variants)["mappings"];
}

void check_mappings(const json& mappings, const Place& place, Notes& notes) {
  std::map<std::size_t, std::size_t> material_of;  // by variant
  for (std::size_t m = 0; m < mappings.size(); ++m) {
    const auto material = mappings[m]["material"].get<std::size_t>();
    const json& variants = mappings[m]["variants"];
    for (std::size_t v = 0; v < variants.size(); ++v) {
      const auto [found, fresh] = material_of.try_emplace(variants[v].get<std::size_t>(), material);
      if (fresh) continue;
      const Place at = place.at(m).at("variants").at(v);
      if (found->second != material)
        at.refuse("gives variant {} material {}, a mapping before gives it material {}", found->first, material,
                  found->second);
      notes.violation(at, "they agree", "is variant {}, which has a mapping already", found->first);
    }
  }
}

// Names for people; a file may have any number.
std::string listed(const std::vector<std::string>& names) {
  constexpr std::size_t kMaxListed = 20;
  std::vector<std::string> parts;
  for (std::size_t v = 0; v < std::min(names.size(), kMaxListed); ++v)
    parts.push_back(fmt::format("'{}'", escape_control(names[v], 60)));
  const std::string rest = names.size() > kMaxListed ? fmt::format(" and {} more", names.size() - kMaxListed) : "";
  return fmt::format("{}{}", fmt::join(parts, ", "), rest);
}

}  // namespace

std::vector<std::string> variant_names(const json& document) {
  std::vector<std::string> names;
  if (const json* variants = find_extension(document, kVariants))
    for (const json& variant : (*variants)["variants"]) names.push_back(variant["name"].get<std::string>());
  return names;
}

void check_variants(const json& document, const Place& root, Notes& notes) {
  const std::vector<std::string> names = variant_names(document);
  std::map<std::string, std::size_t> first_of;
  for (std::size_t v = 0; v < names.size(); ++v) {
    const auto [found, fresh] = first_of.try_emplace(names[v], v);
    if (!fresh)
      notes.add(root.at("extensions").at(kVariants).at("variants").at(v), "the name chooses the first",
                fmt::format("is called '{}', as variant {} is", escape_control(names[v], 60), found->second));
  }
  const json& meshes = list_of(document, "meshes");
  for (std::size_t m = 0; m < meshes.size(); ++m) {
    const json& primitives = meshes[m]["primitives"];
    for (std::size_t p = 0; p < primitives.size(); ++p)
      if (const json* mappings = mappings_of(primitives[p]))
        check_mappings(*mappings,
                       root.at("meshes").at(m).at("primitives").at(p).at("extensions").at(kVariants).at("mappings"),
                       notes);
  }
}

int choose_variant(json& document, const std::optional<std::string>& name, const Place& root) {
  if (!name) return kNone;
  const std::vector<std::string> names = variant_names(document);
  const auto found = std::find(names.begin(), names.end(), *name);
  if (found == names.end())
    throw UsageError(fmt::format("no variant '{}' in {}, which has {}", escape_control(*name, 80),
                                 escape_control(root.file()), names.empty() ? "none" : listed(names)));
  const auto variant = static_cast<std::size_t>(found - names.begin());
  if (document.contains("meshes"))
    for (json& mesh : document["meshes"])
      for (json& primitive : mesh["primitives"]) {
        const json* mappings = mappings_of(primitive);
        if (mappings == nullptr) continue;
        const auto mapping = std::find_if(mappings->begin(), mappings->end(), [&](const json& m) {
          const json& of = m["variants"];
          return std::any_of(of.begin(), of.end(), [&](const json& v) { return v.get<std::size_t>() == variant; });
        });
        if (mapping != mappings->end()) primitive["material"] = json((*mapping)["material"]);
      }
  return static_cast<int>(variant);
}

}  // namespace tessera::scene::gltf

#include "scene/gltf/selection.h"

#include <algorithm>
#include <charconv>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/text.h"
#include "scene/capture.h"
#include "scene/gltf/validation_parts.h"

namespace tessera::scene::gltf {
namespace {

using nlohmann::json;
using validation::array_of;

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

// Nodes of the scene that is drawn, in the order of their numbers.
std::vector<std::size_t> drawn_nodes(const json& document, int scene) {
  const json &nodes = array_of(document, "nodes"), &scenes = array_of(document, "scenes");
  std::vector<std::size_t> drawn;
  if (scenes.empty()) {
    for (std::size_t n = 0; n < nodes.size(); ++n) drawn.push_back(n);
    return drawn;
  }
  const auto number = scene == kNone ? document.value("scene", std::size_t{0}) : static_cast<std::size_t>(scene);
  const json& roots = array_of(scenes[number], "nodes");
  std::vector<std::size_t> waiting;
  for (auto root = roots.rbegin(); root != roots.rend(); ++root) waiting.push_back(root->get<std::size_t>());
  while (!waiting.empty()) {
    drawn.push_back(waiting.back());
    waiting.pop_back();
    for (const json& child : array_of(nodes[drawn.back()], "children")) waiting.push_back(child.get<std::size_t>());
  }
  std::sort(drawn.begin(), drawn.end());
  return drawn;
}

int find_camera(const json& document, int scene, const std::string& wanted, const Place& root) {
  const json &nodes = array_of(document, "nodes"), &cameras = array_of(document, "cameras");
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

Selected select(const json& document, const Selection& selection, const Place& root) {
  Selected selected;
  if (selection.scene) {
    const json& scenes = array_of(document, "scenes");
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
  const json& animations = array_of(document, "animations");
  const std::optional<std::size_t> animation = named(animations, *selection.animation);
  if (!animation) refuse("animation", *selection.animation, animations, root);
  selected.animations->push_back(static_cast<int>(*animation));
  return selected;
}

SceneList list_scenes(const json& document) {
  SceneList list;
  for (const json& scene : array_of(document, "scenes")) list.names.push_back(name_of(scene));
  if (!list.names.empty()) list.drawn = document.value("scene", 0);
  return list;
}

}  // namespace tessera::scene::gltf

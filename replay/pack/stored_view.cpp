#include "replay/pack/stored_view.h"

#include <algorithm>
#include <cstddef>

#include <nlohmann/json.hpp>

#include "scene/view_choices.h"

namespace tessera::replay {
namespace {

using nlohmann::json;

void use_extension(json& document, const char* name) {
  json& used = document["extensionsUsed"];
  if (!used.is_array()) used = json::array();
  if (std::find(used.begin(), used.end(), json(name)) == used.end()) used.push_back(name);
}

json& settings_of(json& document) {
  use_extension(document, "TESSERA_capture");
  return document["extensions"]["TESSERA_capture"];
}

json& appended(json& document, const char* list, json object) {
  json& objects = document[list];
  if (!objects.is_array()) objects = json::array();
  objects.push_back(std::move(object));
  return objects;
}

// Adds the camera that was made to frame the scene, and its node. Returns the node's number.
std::size_t add_camera(json& document, const PackedView& packed) {
  const scene::Node& made = packed.capture.nodes.back();
  const scene::Camera& camera = packed.capture.cameras.back();
  json perspective = {{"yfov", camera.vertical_fov}, {"znear", camera.near}};
  const json& cameras = appended(
      document, "cameras", {{"name", camera.name}, {"type", "perspective"}, {"perspective", std::move(perspective)}});
  json matrix = json::array();
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 4; ++row) matrix.push_back((*made.matrix)[column][row]);
  const json& nodes =
      appended(document, "nodes", {{"name", made.name}, {"camera", cameras.size() - 1}, {"matrix", std::move(matrix)}});
  const std::size_t node = nodes.size() - 1;
  if (packed.scenes.drawn != scene::kNone)
    document["scenes"][static_cast<std::size_t>(packed.scenes.drawn)]["nodes"].push_back(node);
  return node;
}

}  // namespace

PackedView read_for_view(const std::filesystem::path& source, const json& settings, const ViewChoices& view,
                         bool strict) {
  PackedView packed;
  // Framing the scene already uses the attached settings.
  ViewChoices selected;
  selected.selection = view.of_file();
  packed.capture = read_capture(source, {.strict = strict}, selected, std::nullopt, &packed.scenes);
  packed.file_nodes = packed.capture.nodes.size();
  scene::CaptureSettings& own = packed.capture.settings;
  if (settings.is_object() && !settings.empty()) {
    if (settings.contains("resolution")) own.width = settings["resolution"][0], own.height = settings["resolution"][1];
    own.frame_rate = settings.value("frameRate", own.frame_rate);
    if (settings.contains("frames")) {
      own.declared = true;  // else the whole animation is framed
      own.first_frame = settings["frames"]["first"];
      own.frame_count = settings["frames"]["count"];
    }
  }
  scene::look_at(packed.capture, view, {own.width, own.height});
  return packed;
}

void store_view(json& document, const ViewChoices& view, const PackedView& packed) {
  if (view.selection.scene) document["scene"] = packed.scenes.drawn;
  if (view.selection.animation) settings_of(document)["animations"] = packed.capture.played_animations;
  if (!view.selection.camera && !view.framed() && !view.lens) return;
  const auto chosen = static_cast<std::size_t>(scene::camera_node(packed.capture));
  const std::size_t node = chosen < packed.file_nodes ? chosen : add_camera(document, packed);
  settings_of(document)["camera"] = node;
  if (!view.lens) return;
  const scene::Lens& lens = packed.capture.cameras[static_cast<std::size_t>(packed.capture.nodes[chosen].camera)].lens;
  json stored = {{"apertureRadius", lens.aperture_radius}};
  if (lens.focus_distance > 0) stored["focusDistance"] = lens.focus_distance;
  json& camera = document["cameras"][document["nodes"][node]["camera"].get<std::size_t>()];
  camera["extensions"]["TESSERA_lens"] = std::move(stored);
  use_extension(document, "TESSERA_lens");
}

}  // namespace tessera::replay

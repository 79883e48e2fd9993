#include "replay/pack/stored_view.h"

#include <algorithm>
#include <cstddef>

#include <nlohmann/json.hpp>

#include "scene/view.h"

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

// A node with the camera that frames the scene. Returns the camera.
json& add_camera(json& document, const scene::CameraChoice& choice, const scene::Capture& capture) {
  const scene::Camera& camera = choice.camera;
  json perspective = {{"yfov", camera.vertical_fov}, {"znear", camera.near}};
  if (camera.far > 0) perspective["zfar"] = camera.far;
  json& cameras = appended(document, "cameras",
                           {{"name", "automatic"}, {"type", "perspective"}, {"perspective", std::move(perspective)}});
  json matrix = json::array();
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 4; ++row) matrix.push_back(choice.fixed_world[column][row]);
  const json& nodes = appended(document, "nodes",
                               {{"name", "automatic"}, {"camera", cameras.size() - 1}, {"matrix", std::move(matrix)}});
  const std::size_t node = nodes.size() - 1;
  if (capture.scene != scene::kNone)
    document["scenes"][static_cast<std::size_t>(capture.scene)]["nodes"].push_back(node);
  settings_of(document)["camera"] = node;
  return cameras.back();
}

}  // namespace

scene::Capture read_for_view(const std::filesystem::path& source, const json& settings, const ViewChoices& view,
                             bool strict) {
  scene::Capture capture = read_capture(source, {.strict = strict}, view);
  if (!settings.is_object() || settings.empty()) return capture;
  scene::CaptureSettings& own = capture.settings;
  own.declared = true;
  if (settings.contains("resolution")) own.width = settings["resolution"][0], own.height = settings["resolution"][1];
  own.frame_rate = settings.value("frameRate", own.frame_rate);
  if (settings.contains("frames")) {
    own.first_frame = settings["frames"]["first"];
    own.frame_count = settings["frames"]["count"];
  }
  return capture;
}

void store_view(json& document, const ViewChoices& view, const scene::Capture& capture) {
  if (view.selection.scene) document["scene"] = capture.scene;
  if (view.selection.animation) settings_of(document)["animations"] = capture.played_animations;
  const scene::CaptureSettings& settings = capture.settings;
  if (!view.selection.camera && !view.orbit && !view.lens) return;
  const scene::CameraChoice choice = scene::choose_camera(capture, settings.width, settings.height);
  json* camera = nullptr;
  if (choice.node == scene::kNone) {
    camera = &add_camera(document, choice, capture);
  } else {
    settings_of(document)["camera"] = choice.node;
    const json& node = document["nodes"][static_cast<std::size_t>(choice.node)];
    camera = &document["cameras"][node["camera"].get<std::size_t>()];
  }
  if (!view.lens) return;
  json lens = {{"apertureRadius", choice.camera.lens.aperture_radius}};
  if (choice.camera.lens.focus_distance > 0) lens["focusDistance"] = choice.camera.lens.focus_distance;
  (*camera)["extensions"]["TESSERA_lens"] = std::move(lens);
  use_extension(document, "TESSERA_lens");
}

}  // namespace tessera::replay

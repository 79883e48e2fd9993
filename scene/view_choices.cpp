#include "scene/view_choices.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <nlohmann/json.hpp>

#include "base/error.h"
#include "scene/framing.h"
#include "scene/pose.h"

namespace tessera::scene {
namespace {

constexpr double kLargest = static_cast<double>(std::numeric_limits<float>::max());

// "A" or "A:B".
struct OneOrTwo {
  double a = 0;
  std::optional<double> b;
};
OneOrTwo parse_one_or_two(const std::string& option, const std::string& text, const char* form) {
  if (text.find(':') != std::string::npos) {
    const NumberPair pair = parse_pair(option, text, form);
    return {pair.a, pair.b};
  }
  try {
    return {parse_pair(option, text + ":0", form).a, std::nullopt};
  } catch (const UsageError&) {
    refuse_value(option, text, form);
  }
}

Orbit parse_orbit(const std::string& text) {
  constexpr const char* kForm = "DEGREES[:ELEVATION], -360 to 360 around, -89 to 89 above the horizon";
  const OneOrTwo numbers = parse_one_or_two("--orbit", text, kForm);
  if (std::abs(numbers.a) > 360 || std::abs(numbers.b.value_or(0)) > 89) refuse_value("--orbit", text, kForm);
  return {numbers.a, numbers.b};
}

Lens parse_lens(const std::string& text) {
  constexpr const char* kForm = "RADIUS[:FOCUS] in scene units, FOCUS above 0";
  const OneOrTwo numbers = parse_one_or_two("--lens", text, kForm);
  if (numbers.a < 0 || numbers.a > kLargest) refuse_value("--lens", text, kForm);
  if (numbers.b && !(static_cast<float>(*numbers.b) > 0 && *numbers.b <= kLargest)) refuse_value("--lens", text, kForm);
  return {static_cast<float>(numbers.a), static_cast<float>(numbers.b.value_or(0))};
}

// The lens for this camera. Without a focus distance it is focused on the middle of the scene at the begin of the first
// frame.
Lens focus(Lens lens, const Capture& capture, const CameraChoice& choice) {
  if (!(lens.aperture_radius > 0) || lens.focus_distance > 0) return lens;
  const double time = capture.settings.first_frame / capture.settings.frame_rate;
  const DMat4 world = choice.view(pose_at(capture, time)).camera_to_world;
  lens.focus_distance =
      static_cast<float>(std::max(middle_distance(capture, world, time), static_cast<double>(choice.camera.near)));
  return lens;
}

// The capture's own camera becomes this one.
void look_through(Capture& capture, const CameraChoice& choice) {
  if (choice.node != kNone) {
    const int camera = capture.nodes[static_cast<std::size_t>(choice.node)].camera;
    capture.cameras[static_cast<std::size_t>(camera)] = choice.camera;
    return;
  }
  Node node;
  node.name = "automatic";
  node.matrix = choice.fixed_world;
  node.camera = static_cast<int>(capture.cameras.size());
  capture.cameras.push_back(choice.camera);
  capture.cameras.back().name = node.name;
  capture.settings.camera_node = static_cast<int>(capture.nodes.size());
  capture.roots.push_back(capture.settings.camera_node);
  capture.nodes.push_back(std::move(node));
}

}  // namespace

NumberPair parse_shutter(const std::string& option, const std::string& text) {
  constexpr const char* kForm = "OPEN:CLOSE, -1 to 2, OPEN not after CLOSE";
  const NumberPair shutter = parse_pair(option, text, kForm);
  if (!(shutter.a >= -1 && shutter.a <= shutter.b && shutter.b <= 2)) refuse_value(option, text, kForm);
  return shutter;
}

nlohmann::json ViewChoices::json() const {
  nlohmann::json out = nlohmann::json::object();
  const auto add = [&](const char* name, const std::optional<std::string>& word) {
    if (word) out[name] = *word;
  };
  add("scene", selection.scene);
  add("camera", selection.camera);
  add("animation", selection.animation);
  add("orbit", orbit);
  add("lens", lens);
  add("shutter", shutter);
  return out;
}

bool ViewChoices::empty() const { return json().empty(); }

Selection ViewChoices::of_file() const {
  Selection chosen = selection;
  if (framed()) chosen.camera.reset();
  return chosen;
}

void ViewChoices::check() const {
  if (orbit) parse_orbit(*orbit);
  if (lens) parse_lens(*lens);
  if (shutter) parse_shutter("--shutter", *shutter);
  if (orbit && selection.camera && *selection.camera != "auto")
    throw UsageError(
        "--orbit turns the automatic camera; with --camera there is none: leave one of them out, or say --camera auto");
}

void set_shutter(Capture& capture, const ViewChoices& view) {
  if (!view.shutter) return;
  const NumberPair open = parse_shutter("--shutter", *view.shutter);
  capture.settings.shutter_open = open.a;
  capture.settings.shutter_close = open.b;
}

CameraChoice choose_camera(const Capture& capture, const ViewChoices& view, int width, int height) {
  CameraChoice choice = view.framed() ? frame_scene(capture, width, height,
                                                    view.orbit ? std::optional(parse_orbit(*view.orbit)) : std::nullopt)
                                      : choose_camera(capture, width, height);
  if (view.lens) choice.camera.lens = focus(parse_lens(*view.lens), capture, choice);
  return choice;
}

void look_at(Capture& capture, const ViewChoices& view, ImageSize size) {
  set_shutter(capture, view);
  if (view.framed() || view.lens) look_through(capture, choose_camera(capture, view, size.width, size.height));
}

int camera_node(const Capture& capture) {
  if (capture.settings.camera_node != kNone) return capture.settings.camera_node;
  const Pose pose = pose_at(capture, capture.settings.first_frame / capture.settings.frame_rate);
  for (std::size_t n = 0; n < capture.nodes.size(); ++n)
    if (capture.nodes[n].camera != kNone && pose.in_scene[n]) return static_cast<int>(n);
  return kNone;
}

}  // namespace tessera::scene

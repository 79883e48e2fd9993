#include "replay/view_options.h"

#include <cmath>
#include <cstdlib>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/text.h"
#include "replay/file_kind.h"
#include "scene/capture_reader.h"

namespace tessera::replay {
namespace {

constexpr double kLargest = static_cast<double>(std::numeric_limits<float>::max());

[[noreturn]] void refuse(const char* option, const std::string& text, const char* form) {
  throw UsageError(fmt::format("{} {}: expected {}", option, escape_control(text, 40), form));
}

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
    refuse(option.c_str(), text, form);
  }
}

scene::Orbit parse_orbit(const std::string& text) {
  constexpr const char* kForm = "DEGREES[:ELEVATION], -360 to 360 around, -89 to 89 above the horizon";
  const OneOrTwo numbers = parse_one_or_two("--orbit", text, kForm);
  if (std::abs(numbers.a) > 360 || std::abs(numbers.b.value_or(0)) > 89) refuse("--orbit", text, kForm);
  return {numbers.a, numbers.b};
}

scene::Lens parse_lens(const std::string& text) {
  constexpr const char* kForm = "RADIUS[:FOCUS] in scene units, FOCUS above 0";
  const OneOrTwo numbers = parse_one_or_two("--lens", text, kForm);
  if (numbers.a < 0 || numbers.a > kLargest) refuse("--lens", text, kForm);
  if (numbers.b && !(static_cast<float>(*numbers.b) > 0 && *numbers.b <= kLargest)) refuse("--lens", text, kForm);
  return {static_cast<float>(numbers.a), static_cast<float>(numbers.b.value_or(0))};
}

}  // namespace

std::string shell_quoted(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

NumberPair parse_shutter(const std::string& option, const std::string& text) {
  constexpr const char* kForm = "OPEN:CLOSE, -1 to 2, OPEN not after CLOSE";
  const NumberPair shutter = parse_pair(option, text, kForm);
  if (!(shutter.a >= -1 && shutter.a <= shutter.b && shutter.b <= 2)) refuse(option.c_str(), text, kForm);
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

std::string ViewChoices::arguments() const {
  std::string text;
  const nlohmann::json words = json();
  for (const auto& [name, word] : words.items())
    text += fmt::format(" --{} {}", name, shell_quoted(word.get<std::string>()));
  return text;
}

void ViewChoices::check() const {
  if (orbit) parse_orbit(*orbit);
  if (lens) parse_lens(*lens);
  if (shutter) parse_shutter("--shutter", *shutter);
  if (orbit && selection.camera && *selection.camera != "auto")
    throw UsageError(
        "--orbit turns the automatic camera; with --camera there is none: leave one of them out, or say --camera auto");
}

scene::Capture read_capture(const std::filesystem::path& file, const scene::CaptureLimits& limits,
                            const ViewChoices& view, std::optional<ImageSize> size, scene::SceneList* scenes) {
  view.check();
  scene::Selection selection = view.selection;
  if (selection.camera == "auto") selection.camera.reset();
  scene::Capture capture =
      read_as(FileKind::kCapture, file, [&] { return scene::read_capture(file, limits, selection, scenes); });
  look_at(capture, view, size.value_or(ImageSize{capture.settings.width, capture.settings.height}));
  return capture;
}

void look_at(scene::Capture& capture, const ViewChoices& view, ImageSize size) {
  if (view.shutter) {
    const NumberPair open = parse_shutter("--shutter", *view.shutter);
    capture.settings.shutter_open = open.a;
    capture.settings.shutter_close = open.b;
  }
  if (view.framed())
    scene::add_framing_camera(capture, size.width, size.height,
                              view.orbit ? std::optional(parse_orbit(*view.orbit)) : std::nullopt);
  if (view.lens) scene::set_lens(capture, parse_lens(*view.lens), size.width, size.height);
}

void add_view_options(CLI::App& app, ViewChoices& view, const char* group) {
  app.add_option("--camera", view.selection.camera,
                 "Look through this camera of the file, or node that has one: its name, or its number as `tessera "
                 "inspect` lists it; auto: frame the scene automatically")
      ->type_name("NAME|N|auto")
      ->group(group);
  app.add_option("--animation", view.selection.animation,
                 "Play this animation alone; all: every one that moves nothing that an earlier one moves")
      ->type_name("NAME|N|all|none")
      ->group(group);
  app.add_option("--scene", view.selection.scene, "Draw this scene of the file")->type_name("NAME|N")->group(group);
  app.add_option("--orbit", view.orbit,
                 "Frame the scene automatically from so many degrees further around, counterclockwise seen from above, "
                 "and so many above the horizon")
      ->type_name("DEG[:ELEVATION]")
      ->group(group);
  app.add_option("--lens", view.lens,
                 "A thin lens of this radius that is sharp at this distance, in scene units (default: the middle of "
                 "what is drawn); 0 is a pinhole")
      ->type_name("RADIUS[:FOCUS]")
      ->group(group);
}

void add_shutter_option(CLI::App& app, std::optional<std::string>& shutter, const char* group) {
  app.add_option("--shutter", shutter,
                 "When the shutter opens and closes, as fractions of a frame (0:0.5 is half a frame, 0:0 no motion "
                 "blur)")
      ->type_name("OPEN:CLOSE")
      ->group(group);
}

}  // namespace tessera::replay

#include "replay/view_options.h"

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "replay/file_kind.h"
#include "scene/capture_reader.h"

namespace tessera::replay {

std::string shell_quoted(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

std::string view_arguments(const ViewChoices& view) {
  std::string text;
  const nlohmann::json words = view.json();
  for (const auto& [name, word] : words.items())
    text += fmt::format(" --{} {}", name, shell_quoted(word.get<std::string>()));
  return text;
}

scene::Capture read_capture(const std::filesystem::path& file, const scene::CaptureLimits& limits,
                            const ViewChoices& view, std::optional<ImageSize> size, scene::SceneList* scenes) {
  view.check();
  scene::Capture capture =
      read_as(FileKind::kCapture, file, [&] { return scene::read_capture(file, limits, view.of_file(), scenes); });
  scene::look_at(capture, view, size.value_or(ImageSize{capture.settings.width, capture.settings.height}));
  return capture;
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
                 "A thin lens of this radius that is sharp at this distance, in scene units (default: the "
                 "middle of the drawn scene); 0 is a pinhole")
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

#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "base/option_numbers.h"
#include "scene/capture.h"
#include "scene/limits.h"
#include "scene/view_choices.h"

namespace CLI {
class App;
}

namespace tessera::replay {

using scene::ViewChoices;

// " --camera 'eye' --shutter '0:0.5'", quoted for a shell.
std::string view_arguments(const ViewChoices& view);

// Reads a capture with the choices of `view`, which replace the file's own. `size`: size of the images, for which a
// scene may have to be framed; unset: the capture's own. `scenes`, unless null, gets the scenes of the file. Throws the
// errors of scene::read_capture() and ViewChoices::check().
scene::Capture read_capture(const std::filesystem::path& file, const scene::CaptureLimits& limits,
                            const ViewChoices& view, std::optional<ImageSize> size = std::nullopt,
                            scene::SceneList* scenes = nullptr);

inline constexpr const char* kViewGroup = "View";
// Add --scene, --camera, --animation, --orbit and --lens; the second function adds --shutter. `group`: heading in the
// help.
void add_view_options(CLI::App& app, ViewChoices& view, const char* group);
void add_shutter_option(CLI::App& app, std::optional<std::string>& shutter, const char* group);

// The text quoted for a shell: 'NAME'.
std::string shell_quoted(const std::string& text);

}  // namespace tessera::replay

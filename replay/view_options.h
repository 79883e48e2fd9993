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

// " --camera 'eye' --shutter '0:0.5'", as a shell takes it.
std::string view_arguments(const ViewChoices& view);

// Reads a capture and looks at it so: what is chosen replaces what the file says. `size`: of the images, for which a
// scene may have to be framed; else the capture's own. `scenes`, if any, gets the scenes of the file. Throws what
// scene::read_capture() and ViewChoices::check() throw.
scene::Capture read_capture(const std::filesystem::path& file, const scene::CaptureLimits& limits,
                            const ViewChoices& view, std::optional<ImageSize> size = std::nullopt,
                            scene::SceneList* scenes = nullptr);

inline constexpr const char* kViewGroup = "What is looked at";
// --scene, --camera, --animation, --orbit and --lens; the second one --shutter. `group`: of the help.
void add_view_options(CLI::App& app, ViewChoices& view, const char* group);
void add_shutter_option(CLI::App& app, std::optional<std::string>& shutter, const char* group);

// A text in the quotes that a shell wants: 'NAME'.
std::string shell_quoted(const std::string& text);

}  // namespace tessera::replay

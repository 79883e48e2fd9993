#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "replay/option_numbers.h"
#include "scene/capture.h"
#include "scene/limits.h"
#include "scene/selection.h"

namespace CLI {
class App;
}

namespace tessera::replay {

// What of a capture is drawn and how it is looked at, where that is not what the file says. The words are those of the
// options --scene, --camera, --animation, --orbit, --lens and --shutter, of members of a study and of stats.json.
struct ViewChoices {
  scene::Selection selection;
  std::optional<std::string> orbit, lens, shutter;

  bool empty() const;
  // {"camera": "eye", "shutter": "0:0.5"}: those that are given.
  nlohmann::json json() const;
  // " --camera 'eye' --shutter '0:0.5'", as a shell takes it.
  std::string arguments() const;

  // The scene is framed automatically, whatever cameras there are.
  bool framed() const { return orbit.has_value() || selection.camera == "auto"; }

  // Throws UsageError for words that are no numbers, and for choices that contradict each other.
  void check() const;
};

// Reads a capture and looks at it so: what is chosen replaces what the file says. `size`: of the images, for which a
// scene may have to be framed; else the capture's own. `scenes`, if any, gets the scenes of the file. Throws what
// scene::read_capture() and check() throw.
scene::Capture read_capture(const std::filesystem::path& file, const scene::CaptureLimits& limits,
                            const ViewChoices& view, std::optional<ImageSize> size = std::nullopt,
                            scene::SceneList* scenes = nullptr);
// The last part of it, for a capture that was read with the selection of `view`.
void look_at(scene::Capture& capture, const ViewChoices& view, ImageSize size);

inline constexpr const char* kViewGroup = "What is looked at";
// --scene, --camera, --animation, --orbit and --lens; the second one --shutter. `group`: of the help.
void add_view_options(CLI::App& app, ViewChoices& view, const char* group);
void add_shutter_option(CLI::App& app, std::optional<std::string>& shutter, const char* group);

// "OPEN:CLOSE", fractions of a frame. Throws UsageError.
NumberPair parse_shutter(const std::string& option, const std::string& text);

// A text in the quotes that a shell wants: 'NAME'.
std::string shell_quoted(const std::string& text);

}  // namespace tessera::replay

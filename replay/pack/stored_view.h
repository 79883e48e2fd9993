#pragma once

#include <cstddef>
#include <filesystem>

#include <nlohmann/json_fwd.hpp>

#include "replay/view_options.h"
#include "scene/capture.h"

namespace tessera::replay {

// An asset as it is drawn once `settings`, members of TESSERA_capture, are attached and looked at as `view` says.
struct PackedView {
  scene::Capture capture;
  scene::SceneList scenes;
  std::size_t file_nodes = 0;  // nodes of the file; one that was made to frame the scene lies behind them
};
// Throws what read_capture() throws.
PackedView read_for_view(const std::filesystem::path& source, const nlohmann::json& settings, const ViewChoices& view,
                         bool strict);

// Writes into a glTF document what `view` chose of it: its scene, and in TESSERA_capture the animations that play and the
// node of the camera. Where the scene is framed, or an automatic camera gets a lens, that is a camera and a node of its
// own at the end of the document.
void store_view(nlohmann::json& document, const ViewChoices& view, const PackedView& packed);

}  // namespace tessera::replay

#pragma once

#include <cstddef>
#include <filesystem>

#include <nlohmann/json_fwd.hpp>

#include "replay/view_options.h"
#include "scene/capture.h"

namespace tessera::replay {

// An asset as drawn with `settings`, members of TESSERA_capture, and with the choices of `view`.
struct PackedView {
  scene::Capture capture;
  scene::SceneList scenes;
  std::size_t file_nodes = 0;  // nodes of the file; a node made to frame the scene follows them
};
// Throws the errors of read_capture().
PackedView read_for_view(const std::filesystem::path& source, const nlohmann::json& settings, const ViewChoices& view,
                         bool strict);

// Writes the choices of `view` into a glTF document: its scene, and in TESSERA_capture the played animations and the
// node of the camera. Where the scene is framed, or an automatic camera gets a lens, that camera and its node are added
// at the end of the document.
void store_view(nlohmann::json& document, const ViewChoices& view, const PackedView& packed);

}  // namespace tessera::replay

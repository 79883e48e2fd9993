#pragma once

#include <filesystem>

#include <nlohmann/json_fwd.hpp>

#include "replay/view_options.h"
#include "scene/capture.h"

namespace tessera::replay {

// Reads an asset as it is drawn once `settings`, members of TESSERA_capture, are attached and looked at as `view` says.
// Throws what read_capture() throws.
scene::Capture read_for_view(const std::filesystem::path& source, const nlohmann::json& settings,
                             const ViewChoices& view, bool strict);

// Writes into a glTF document what `view` chose of `capture`, which was read from it: its scene, and in TESSERA_capture
// the animations that play and the node of the camera. Where the scene is framed, or an automatic camera gets a lens,
// that is a camera and a node of its own at the end of the document.
void store_view(nlohmann::json& document, const ViewChoices& view, const scene::Capture& capture);

}  // namespace tessera::replay

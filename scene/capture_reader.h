#pragma once

#include <filesystem>

#include "scene/capture.h"
#include "scene/limits.h"
#include "scene/view_choices.h"

namespace tessera::scene {

// Reads a capture: any glTF 2.0 asset (.gltf with data URIs or files beside it, .glb) with the extensions that
// supported_extensions() lists. The file is not trusted: every index, range, count and URI is checked before it is
// used, and sizes are charged to the limits before they are allocated.
//
// Throws InputError (file, JSON pointer or byte offset, fault) for anything that glTF forbids and that could change the
// image, and LimitError when a limit would be exceeded. Harmless oddities load: weights that do not sum to 1, longer
// buffers, strided animation data, unused objects. A violation of glTF that has only one meaning loads with a line in
// Capture::notices; CaptureLimits::strict refuses it. Throws UsageError, which lists the variants, where the file lacks
// CaptureLimits::variant or something of the selection. `scenes`, unless null, gets the file's scenes.
Capture read_capture(const std::filesystem::path& file, const CaptureLimits& limits = {},
                     const Selection& selection = {}, SceneList* scenes = nullptr);

}  // namespace tessera::scene

#pragma once

#include <nlohmann/json_fwd.hpp>

#include "scene/capture.h"
#include "scene/gltf/document.h"

namespace tessera::scene::gltf {

// TESSERA_capture.environment of a checked document in its long form, an object; a number is its `intensity`, the text
// "uniform" stands for {"uniform": true}, any other for {"image": text}. Empty where there is none.
nlohmann::json environment_settings(const nlohmann::json& document);

// What lights the scene from all around: capture.settings and, of an image, capture.environment_image. The image is
// charged with what it unpacks to and what is made from it. Throws InputError for what is no such image, LimitError.
void build_environment(Document& document, Capture& capture);

}  // namespace tessera::scene::gltf

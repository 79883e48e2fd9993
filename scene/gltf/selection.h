#pragma once

#include <optional>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "scene/gltf/place.h"
#include "scene/selection.h"

namespace tessera::scene::gltf {

// What a Selection means in a document. kNone, and no list, where it says nothing.
struct Selected {
  int scene = kNone;
  int camera_node = kNone;
  // Those that play, in this order; "all" is none: scene_builder.cpp chooses.
  std::optional<std::vector<int>> animations;
  bool all_animations = false;
};

// `document` passed validate_links(). Throws UsageError, which lists what there is, for what the file does not have.
Selected select(const nlohmann::json& document, const Selection& selection, const Place& root);

// Names, and the one that is drawn.
SceneList list_scenes(const nlohmann::json& document);

}  // namespace tessera::scene::gltf

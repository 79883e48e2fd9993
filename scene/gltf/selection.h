#pragma once

#include <optional>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "scene/gltf/place.h"
#include "scene/limits.h"

namespace tessera::scene::gltf {

// What a Selection means in a document. kNone, and no list, where it says nothing.
struct Selected {
  int scene = -1;
  int camera_node = -1;
  bool framed = false;  // no camera is to be used
  // Those that play, in this order; "all" is none: scene_builder.cpp chooses.
  std::optional<std::vector<int>> animations;
  bool all_animations = false;
};

// `document` passed validate_links(). Throws UsageError, which lists what there is, for what the file does not have.
Selected select(const nlohmann::json& document, const Selection& selection, const Place& root);

}  // namespace tessera::scene::gltf

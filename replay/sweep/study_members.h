#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/key_table.h"
#include "scene/gltf/place.h"

namespace tessera::replay {

// Refuses what is no object, and members of other names, naming the nearest.
inline void check_members(const nlohmann::json& object, const scene::gltf::Place& place,
                          const std::vector<std::string>& known) {
  if (!object.is_object()) place.refuse("is not an object");
  for (const auto& [name, value] : object.items())
    if (std::find(known.begin(), known.end(), name) == known.end())
      place.at(name).refuse("{}", unknown_key_message(name, known));
}

}  // namespace tessera::replay

#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "scene/gltf/notes.h"
#include "scene/limits.h"

namespace tessera::scene::gltf {

// Names of all extensions that a document uses, by saying so or by an object of theirs, and that supported_extensions()
// does not have; sorted. What stands in extras is the application's own and does not count.
//   EC1  One note of the file names every one of them and what carries it.
std::vector<std::string> find_unread_extensions(const nlohmann::json& document, const Place& root, MemoryBudget& budget,
                                                Notes& notes);

}  // namespace tessera::scene::gltf

#pragma once

#include <cstddef>
#include <functional>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

#include "scene/gltf/place.h"

namespace tessera::scene::gltf {

enum class AccessorRole { kIndices, kVertices, kTarget, kKeyTimes, kKeyValues, kInverseBind, kInstances };

// One use of an accessor: its role and, for vertices and instances, the attribute. `path` is the property that key
// values move.
struct AccessorUsed {
  std::size_t accessor = 0;
  AccessorRole role = AccessorRole::kVertices;
  std::string_view name{}, path{};
  bool in_stream = false;    // a stream holds its values
  std::size_t vertices = 0;  // for indices: number of vertices that they may name
};

// Calls visit(use, place) for every place of a document that names an accessor, in the document's order. `document`
// passed check_schema() and validate_links().
void for_each_accessor_use(const nlohmann::json& document, const Place& root,
                           const std::function<void(const AccessorUsed&, const Place&)>& visit);

}  // namespace tessera::scene::gltf

#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/key_table.h"
#include "replay/sweep/study.h"
#include "scene/gltf/place.h"

namespace tessera::replay {

// One axis of a study file:
//   {"key": KEY, "values": [V, ...]}                        a list
//   {"key": KEY, "range": {"from": A, "to": B, "step": S}}     A, A+S, ... up to B
//   {"key": KEY, "range": {"from": A, "to": B, "factor": F}}   A, A*F, ... up to B
//   {"key": KEY, "range": {"from": A, "to": B}}                any number from A to B, with `open` alone;
//   {"key": KEY, "range": {"from": A, "to": B, "scale": "log"}}  the same, equal factors equally likely
//   {"keys": [KEY, ...], ...}    several keys set together: to the same value, or each to its own where V is a list
// Keys must be known, and no value may occur twice; the caller checks whether a value fits its key. Throws InputError,
// and LimitError before it makes a range of more than `max_steps` steps. The values of an open range are its ends, to
// be checked.
StudyAxis read_axis(const nlohmann::json& value, const scene::gltf::Place& place, std::uint64_t max_steps, bool open);

// Refuses values that are not objects, and members of other names, with the nearest known name.
inline void check_members(const nlohmann::json& object, const scene::gltf::Place& place,
                          const std::vector<std::string>& known) {
  if (!object.is_object()) place.refuse("is not an object");
  for (const auto& [name, value] : object.items())
    if (std::find(known.begin(), known.end(), name) == known.end())
      place.at(name).refuse("{}", unknown_key_message(name, known));
}

}  // namespace tessera::replay

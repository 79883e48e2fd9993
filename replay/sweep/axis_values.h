#pragma once

#include <cstdint>

#include <nlohmann/json.hpp>

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
// Keys are known ones, no value is there twice; whether a value fits its key is for the caller to check. Throws
// InputError, and LimitError before a range of more than `max_steps` steps is made. The values of an open range are its
// ends, to be checked.
StudyAxis read_axis(const nlohmann::json& value, const scene::gltf::Place& place, std::uint64_t max_steps, bool open);

}  // namespace tessera::replay

#pragma once

#include <map>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "scene/gltf/place.h"

namespace tessera::replay {

// Columns of a sweep's rows about a frame, by name:
//   UNIT.EVENT                                    a counter
//   dram.UNIT.PURPOSE.read_bytes, written_bytes   the ledger; 0 where nothing moved
//   timing.MEMBER, energy.MEMBER, area.MEMBER     as in stats.json: timing.bound_by, energy.by_unit.shader and so on;
//                                                 where the machine's model ran, timing.events with machine.timing=events
//   effects.EFFECT, effect_reasons.EFFECT, effect_places.EFFECT.MEMBER, right_eye.counters.UNIT.EVENT
//                                                 likewise
//   baseline.SCHEME.EVENT                         another scheme's counter; SCHEME as in baselines.csv
const std::vector<std::string>& known_columns();

// The column that replaces the former name `name` (or a pattern), or `name` itself: former tables call tessera
// pre-tessellation.
std::string current_column(std::string name);

bool needs_baselines(const std::string& column);

// All columns, with the baselines' only if `baselines`; of the machine's model cycles, energy and area alone.
std::vector<std::string> default_columns(bool baselines);

// Reads a list of names, in which "*" stands for any characters. Throws InputError for an unknown name (with the
// nearest known one) and for a pattern that matches nothing.
std::vector<std::string> read_columns(const nlohmann::json& value, const scene::gltf::Place& place);

// The names in such a list that are no patterns.
std::vector<std::string> written_out(const nlohmann::json& value);

// All values of a frame (frame_json()) by their names. Counters of units that did not run are missing.
std::map<std::string, nlohmann::json> frame_values(const nlohmann::json& frame);

}  // namespace tessera::replay

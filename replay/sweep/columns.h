#pragma once

#include <map>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "scene/gltf/place.h"

namespace tessera::replay {

// What a row of a sweep may show of a frame, by name:
//   UNIT.EVENT                                    a counter
//   dram.UNIT.PURPOSE.read_bytes, written_bytes   the ledger; 0 where nothing moved
//   timing.MEMBER, energy.MEMBER, area.MEMBER     as in stats.json: timing.bound_by, energy.by_unit.shader and so on;
//                                                 where the machine's model ran, timing.events with machine.timing=events
//   effects.EFFECT, effect_reasons.EFFECT, effect_places.EFFECT.MEMBER, right_eye.counters.UNIT.EVENT
//                                                 likewise
//   baseline.SCHEME.EVENT                         another scheme's counter; SCHEME as in baselines.csv
const std::vector<std::string>& known_columns();

// The column that `name`, or a pattern, is an alias of, or itself: tables call tessera what they called pre-tessellation.
std::string current_column(std::string name);

bool needs_baselines(const std::string& column);

// All columns, those of the baselines only when asked for; of the machine's model cycles, energy and area alone.
std::vector<std::string> default_columns(bool baselines);

// A list of names, in which "*" stands for any characters. Throws InputError for a name that is not known (naming the
// nearest) and for a pattern that fits none.
std::vector<std::string> read_columns(const nlohmann::json& value, const scene::gltf::Place& place);

// Of such a list, what is no pattern.
std::vector<std::string> written_out(const nlohmann::json& value);

// All values of a frame (frame_json()) by their names. What its units did not count is not there.
std::map<std::string, nlohmann::json> frame_values(const nlohmann::json& frame);

}  // namespace tessera::replay

#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace tessera::replay::schema {

// The schema that a template's {"$table": NAME} stands for:
//   counters, baselines          counts by name; by scheme and name
//   gpu, gpu_file                the whole machine, nested by the dots of the keys; the same with all left out that one likes
//   settings, functions          every key of a replay; keys of both that a record depends on
//   keys                         a text that is a key
//   timing_units, stalls, path_parts, energy_units, area_units, tile_maps
//   effect_flags, effect_reasons, effect_places
//   ledger_units, ledger_purposes    a text that is one
// Throws InputError for any other.
nlohmann::json schema_table(const std::string& name);

}  // namespace tessera::replay::schema

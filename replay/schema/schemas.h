#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

namespace tessera::replay {

// JSON schemas (draft 2020-12) of the files that the program writes and people write for it. templates/NAME.json has what
// is written by hand, templates/common.json what several need; members that tables declare (counters, keys, units,
// effects) come from these: {"$table": NAME} in a template becomes an object of them.
//
// Invariants (cited by the tests):
//   JS1  An object whose members are a closed set allows no others.
//   JS2  Each member has a description.

// stats, tiles, sweep, tradeoff, machine, study, record.
const std::vector<std::string>& schema_names();

// Throws UsageError for a name that is none, naming the nearest.
nlohmann::json schema_json(const std::string& name);

// As `tessera describe schema NAME` prints it.
std::string schema_text(const std::string& name);

// The files of templates/ by name, built into the program.
const std::map<std::string_view, std::string_view>& schema_templates();

namespace schema {

// The schema that a template's {"$table": NAME} stands for:
//   counters, baselines          counts by name; by scheme and name
//   baseline_kinds               the kind of each scheme
//   gpu, gpu_file                the whole machine, nested by the dots of the keys; the same with all left out that one likes
//   settings, functions          every key of a replay; keys of both that a record depends on
//   keys                         a text that is a key
//   timing_units, stalls, path_parts, energy_units, area_units, tile_maps
//   effect_flags, effect_reasons, effect_places
//   ledger_units, ledger_purposes    a text that is one
// Throws InputError for any other.
nlohmann::json schema_table(const std::string& name);

}  // namespace schema

}  // namespace tessera::replay

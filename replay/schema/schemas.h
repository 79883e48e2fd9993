#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

namespace tessera::replay {

// JSON schemas (draft 2020-12) of the files that the program writes and of the files that people write for it.
// templates/NAME.json has the hand-written part, templates/common.json the definitions that several schemas share.
// Members that tables declare (counters, keys, units, effects) come from these tables: {"$table": NAME} in a template
// becomes an object of them.
//
// Invariants (cited by the tests):
//   JS1  An object whose members are a closed set allows no others.
//   JS2  Each member has a description.

// The names: stats, tiles, sweep, tradeoff, machine, study, record.
const std::vector<std::string>& schema_names();

// Throws UsageError for an unknown name, with the nearest known one.
nlohmann::json schema_json(const std::string& name);

// The text that `tessera describe schema NAME` prints.
std::string schema_text(const std::string& name);

// The files of templates/ by name, built into the program.
const std::map<std::string_view, std::string_view>& schema_templates();

namespace schema {

// The schema that replaces {"$table": NAME} in a template:
//   counters, baselines          counts by name; by scheme and name
//   baseline_kinds               the kind of each scheme
//   gpu, gpu_file                the whole machine, nested by the dots of the keys; the same with every member optional
//   settings, functions          every key of a replay; keys of machine and replay on which a record depends
//   keys                         a text that is a key
//   timing_units, stalls, path_parts, energy_units, area_units, tile_maps
//   effect_flags, effect_reasons, effect_places
//   ledger_units, ledger_purposes    a text that names one
// Throws InputError for any other name.
nlohmann::json schema_table(const std::string& name);

}  // namespace schema

}  // namespace tessera::replay

#include "replay/schema/schemas.h"

#include <functional>
#include <map>

#include <fmt/format.h>

#include "base/error.h"
#include "baselines/baseline_counters.h"
#include "gpu/configuration.h"
#include "gpu/settings.h"
#include "gpu/tile_maps.h"
#include "memory/ledger.h"
#include "replay/describe.h"
#include "replay/machine_report.h"
#include "replay/statistics.h"

namespace tessera::replay::schema {
namespace {

using nlohmann::json;

// Schema of an object whose members are all optional.
json closed_object(json properties) {
  return {{"type", "object"}, {"properties", std::move(properties)}, {"additionalProperties", false}};
}

json with_all_required(json object) {
  json names = json::array();
  for (const auto& [name, schema] : object["properties"].items()) names.push_back(name);
  object["required"] = names;
  return object;
}

json count(const std::string& description) {
  return {{"type", "integer"}, {"minimum", 0}, {"description", description}};
}
json amount(const std::string& description) {
  return {{"type", "number"}, {"minimum", 0}, {"description", description}};
}

// "meaning (unit)"
std::string described(const json& row) {
  std::string text = row["meaning"];
  if (!row["unit"].get_ref<const std::string&>().empty())
    text += fmt::format(" In {}.", row["unit"].get<std::string>());
  return text;
}

json counters(bool of_baselines) {
  constexpr std::string_view kBaseline = "baseline.";
  json properties = json::object();
  for (const json& row : describe_counters())
    if (const std::string name = row["name"]; name.starts_with(kBaseline) == of_baselines)
      properties[name] = count(described(row));
  return closed_object(std::move(properties));
}

json baselines_table() {
  const json of_scheme = counters(true);
  json properties = json::object();
  for (const baselines::SchemeRow& scheme : baselines::kSchemes) {
    const std::string name(scheme.name);
    properties[name] = of_scheme;
    properties[name]["description"] = fmt::format("Counters of the scheme {}.", name);
  }
  return closed_object(std::move(properties));
}

json baseline_kinds_table() {
  json properties = json::object();
  for (const baselines::SchemeRow& scheme : baselines::kSchemes)
    properties[std::string(scheme.name)] = {{"description", fmt::format("Kind of the scheme {}.", scheme.name)},
                                            {"const", name(scheme.kind)}};
  return closed_object(std::move(properties));
}

// Schema of a key from its row of describe_json(). In files numbers may also be multiples of the base machine's.
json key_schema(const json& row, bool in_file) {
  json schema = {{"description", described(row)}};
  const std::string type = row["type"];
  if (type == "choice") {
    schema["enum"] = row["choices"];
  } else if (type == "boolean") {
    schema["type"] = "boolean";
  } else if (type == "text") {
    schema["type"] = "string";
  } else {
    json number = {{"type", type}, {"minimum", row["min"]}, {"maximum", row["max"]}};
    if (in_file)
      schema["anyOf"] = {number, {{"type", "string"}, {"pattern", "^[x*][0-9.]+([eE][-+]?[0-9]+)?$"}}};
    else
      schema.update(number);
  }
  return schema;
}

// Nested by the first dot, as gpu_json() does.
json gpu_table(bool file) {
  json sections = json::object();
  for (const json& row : describe_json("gpu")) {
    const std::string key = row["key"];
    const std::size_t dot = key.find('.');
    sections[key.substr(0, dot)][key.substr(dot + 1)] = key_schema(row, file);
  }
  if (file) {
    sections["memory"]["bytes_per_clk"] = amount("memory.gb_per_s in bytes for each clock of the GPU.");
    sections["memory"]["latency_clk"] = amount("memory.latency_ns in clocks of the GPU.");
  }
  json properties = json::object();
  for (auto& [section, keys] : sections.items()) {
    json object = closed_object(keys);
    if (!file) object = with_all_required(std::move(object));
    object["description"] = fmt::format("Keys {}.*.", section);
    properties[section] = std::move(object);
  }
  json out = closed_object(std::move(properties));
  return file ? out : with_all_required(std::move(out));
}

json settings_table() {
  json properties = json::object();
  for (const json& row : describe_json("settings")) properties[row["key"].get<std::string>()] = key_schema(row, false);
  return with_all_required(closed_object(std::move(properties)));
}

// Timing keys are there only where something else than timing reads them.
json functions_table() {
  json table = settings_table();
  for (const json& row : describe_json("gpu")) {
    const std::string key = row["key"];
    table["properties"][key] = key_schema(row, false);
    if (row["pass"] == "function") table["required"].push_back(key);
  }
  return table;
}

json keys_table() {
  json names = {"gpu", "size"};
  for (const std::string& key : gpu::known_keys()) names.push_back(key);
  return {{"enum", names}};
}

json by_name(const json& object, const std::function<json(const std::string&)>& schema) {
  json properties = json::object();
  for (const auto& [name, value] : object.items()) properties[name] = schema(name);
  return closed_object(std::move(properties));
}

json events_json() {
  timing::FrameTiming timing;
  timing.events.emplace();
  return timing_json(timing)["events"];
}

json timing_units() {
  return by_name(timing_json({})["units"], [](const std::string& unit) {
    json object = with_all_required(
        closed_object({{"busy_cycles", count("Cycles in which it works, summed over its instances.")},
                       {"utilisation", amount("Of the frame's cycles; above 1 where several instances work.")}}));
    object["description"] = fmt::format("The unit {}.", unit);
    return object;
  });
}

json tile_maps() {
  json properties = json::object();
  for (const gpu::TileMapField& field : gpu::kTileMapFields) {
    json map = with_all_required(
        closed_object({{"unit", {{"const", field.unit}, {"description", "Unit of the values."}}},
                       {"meaning", {{"const", field.meaning}, {"description", "Meaning of the values."}}},
                       {"values",
                        {{"type", "array"},
                         {"items", {{"type", "integer"}, {"minimum", 0}}},
                         {"description", "A value per tile, row by row from the top left."}}}}));
    map["description"] = field.meaning;
    properties[std::string(field.name)] = std::move(map);
  }
  return with_all_required(closed_object(std::move(properties)));
}

json effects(const std::function<json(const json&)>& schema) {
  json properties = json::object();
  for (const json& row : describe_json("effects")) properties[row["name"].get<std::string>()] = schema(row);
  return closed_object(std::move(properties));
}

template <class Enum>
json words(std::size_t count) {
  json names = json::array();
  for (std::size_t k = 0; k < count; ++k) names.push_back(name(static_cast<Enum>(k)));
  return {{"enum", names}};
}

using Table = json (*)();
const std::map<std::string, Table>& tables() {
  static const std::map<std::string, Table> kTables = {
      {"counters", [] { return counters(false); }},
      {"baselines", baselines_table},
      {"baseline_kinds", baseline_kinds_table},
      {"gpu", [] { return gpu_table(false); }},
      {"gpu_file", [] { return gpu_table(true); }},
      {"settings", settings_table},
      {"functions", functions_table},
      {"keys", keys_table},
      {"timing_units", timing_units},
      {"stalls",
       [] {
         return by_name(events_json()["shader_stalls"], [](const std::string& why) {
           return count(fmt::format("Cycles in which shader cores wait: {}.", why));
         });
       }},
      {"path_parts",
       [] {
         return by_name(events_json()["critical_path"], [](const std::string& part) {
           return count(fmt::format("Cycles of the critical path in {}.", part));
         });
       }},
      {"energy_units",
       [] {
         return by_name(energy_json(hardware::frame_energy({}, {}, 0, 0))["by_unit"],
                        [](const std::string& unit) { return amount(fmt::format("Energy of {}, nJ.", unit)); });
       }},
      {"area_units",
       [] {
         return by_name(area_json(gpu::GpuConfiguration().area())["by_unit"],
                        [](const std::string& unit) { return amount(fmt::format("Silicon of {}, mm2.", unit)); });
       }},
      {"tile_maps", tile_maps},
      {"effect_flags",
       [] {
         return effects([](const json& row) { return json{{"type", "boolean"}, {"description", row["meaning"]}}; });
       }},
      {"effect_reasons",
       [] {
         return effects([](const json& row) {
           return json{{"type", "string"},
                       {"description", fmt::format("Why {} ran, or did not.", row["name"].get<std::string>())}};
         });
       }},
      {"effect_places",
       [] {
         return effects([](const json& row) {
           json object = with_all_required(
               closed_object({{"sub_patches", count("Sub-patches that were sent to the binner with it.")},
                              {"sub_patches_elided",
                               count("Sub-patches for which the capture has the effect, but which do not need it.")},
                              {"tiles", count("Tiles in which it ran.")}}));
           object["description"] = fmt::format("Where {} ran.", row["name"].get<std::string>());
           return object;
         });
       }},
      {"events",
       [] {
         json names = json::array();
         for (const hardware::Event event : hardware::kAllEvents) names.push_back(name(event));
         return json{{"enum", names}};
       }},
      {"ledger_units", [] { return words<memory::Unit>(memory::kUnitCount); }},
      {"ledger_purposes", [] { return words<memory::Purpose>(memory::kPurposeCount); }},
  };
  return kTables;
}

}  // namespace

json schema_table(const std::string& name) {
  const auto table = tables().find(name);
  if (table == tables().end()) throw InputError("schema", "", fmt::format("there is no table '{}'", name));
  return table->second();
}

}  // namespace tessera::replay::schema

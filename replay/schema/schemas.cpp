#include "replay/schema/schemas.h"

#include <algorithm>
#include <set>

#include <fmt/format.h>

#include "base/error.h"
#include "base/json_text.h"
#include "base/key_table.h"

namespace tessera::replay {
namespace {

using nlohmann::json;

constexpr const char* kDialect = "https://json-schema.org/draft/2020-12/schema";
constexpr const char* kTable = "$table";
constexpr const char* kCommon = "#/$defs/";

// Merges the template's text with its table: "properties" add members, every other member replaces the table's.
json merged(json table, const json& written) {
  for (const auto& [name, value] : written.items()) {
    if (name == kTable) continue;
    if (name == "properties")
      table[name].update(value);
    else if (name == "required")
      for (const json& member : value) table[name].push_back(member);
    else
      table[name] = value;
  }
  return table;
}

json with_tables(const json& value) {
  if (value.is_array()) {
    json out = json::array();
    for (const json& element : value) out.push_back(with_tables(element));
    return out;
  }
  if (!value.is_object()) return value;
  json out = json::object();
  for (const auto& [name, member] : value.items()) out[name] = with_tables(member);
  return out.contains(kTable) ? merged(schema::schema_table(out[kTable]), out) : out;
}

// Collects the names of the common definitions to which a value refers.
void add_references(const json& value, std::set<std::string>& names) {
  if (value.is_object() && value.contains("$ref"))
    if (const std::string to = value["$ref"]; to.starts_with(kCommon))
      names.insert(to.substr(std::string(kCommon).size()));
  if (value.is_structured())
    for (const json& member : value) add_references(member, names);
}

json template_json(const std::string& name) {
  return parse_json(schema_templates().at(name + ".json"), name + ".json");
}

}  // namespace

const std::vector<std::string>& schema_names() {
  static const std::vector<std::string> kNames = {"stats", "tiles", "sweep", "tradeoff", "machine", "study", "record"};
  return kNames;
}

json schema_json(const std::string& name) {
  const std::vector<std::string>& known = schema_names();
  if (std::find(known.begin(), known.end(), name) == known.end())
    throw UsageError(fmt::format("describe schema: {}", unknown_key_message(name, known)));
  const json common = template_json("common");
  json schema = template_json(name);
  schema["$schema"] = kDialect;
  std::set<std::string> wanted, taken;
  add_references(schema, wanted);
  while (!wanted.empty()) {
    const std::string definition = wanted.extract(wanted.begin()).value();
    if (!taken.insert(definition).second) continue;
    schema["$defs"][definition] = common.at(definition);
    add_references(common.at(definition), wanted);
  }
  return with_tables(schema);
}

std::string schema_text(const std::string& name) { return json_text(schema_json(name), 1) + "\n"; }

}  // namespace tessera::replay

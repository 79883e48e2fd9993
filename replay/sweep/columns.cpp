#include "replay/sweep/columns.h"

#include <algorithm>

#include "base/key_table.h"
#include "baselines/baseline_counters.h"
#include "memory/ledger.h"
#include "replay/statistics.h"

namespace tessera::replay {
namespace {

using nlohmann::json;
using scene::gltf::Place;

constexpr std::string_view kBaseline = "baseline.";

std::string ledger_column(const std::string& unit, const std::string& purpose, const char* way) {
  return "dram." + unit + "." + purpose + "." + way;
}

// "*" fits any characters, none included.
bool fits(std::string_view pattern, std::string_view text) {
  const std::size_t star = pattern.find('*');
  if (star == std::string_view::npos) return pattern == text;
  if (!text.starts_with(pattern.substr(0, star))) return false;
  const std::string_view rest = pattern.substr(star + 1);
  for (std::size_t at = star; at <= text.size(); ++at)
    if (fits(rest, text.substr(at))) return true;
  return false;
}

void add_numbers(const json& value, const std::string& name, std::map<std::string, json>& into) {
  if (value.is_number()) into[name] = value;
  if (value.is_object())
    for (const auto& [member, inner] : value.items()) add_numbers(inner, name + "." + member, into);
}

}  // namespace

const std::vector<std::string>& known_columns() {
  static const std::vector<std::string> kKnown = [] {
    std::vector<std::string> names;
    for (const json& counter : describe_counters())
      if (const std::string name = counter["name"]; !name.starts_with(kBaseline)) names.push_back(name);
    for (std::size_t u = 0; u < memory::kUnitCount; ++u)
      for (std::size_t p = 0; p < memory::kPurposeCount; ++p)
        for (const char* way : {"read_bytes", "written_bytes"})
          names.push_back(ledger_column(std::string(name(static_cast<memory::Unit>(u))),
                                        std::string(name(static_cast<memory::Purpose>(p))), way));
    names.insert(names.end(), {"timing.cycles", "energy.total_nj", "area.total_mm2"});
    for (const std::string_view scheme : baselines::kSchemeNames)
      for (const auto& field : kCounterFields<baselines::BaselineCounters>)
        names.push_back(std::string(kBaseline) + std::string(scheme) + "." +
                        std::string(field.name.substr(kBaseline.size())));
    return names;
  }();
  return kKnown;
}

bool needs_baselines(const std::string& column) { return column.starts_with(kBaseline); }

std::vector<std::string> default_columns(bool baselines) {
  std::vector<std::string> names;
  for (const std::string& name : known_columns())
    if (baselines || !needs_baselines(name)) names.push_back(name);
  return names;
}

std::vector<std::string> read_columns(const json& value, const Place& place) {
  if (!value.is_array() || value.empty()) place.refuse("is not a list of column names");
  std::vector<std::string> columns;
  for (std::size_t i = 0; i < value.size(); ++i) {
    if (!value[i].is_string()) place.at(i).refuse("is not a text");
    const std::string& pattern = value[i].get_ref<const std::string&>();
    if (pattern.size() > 200) place.at(i).refuse("is longer than any column's name");
    if (std::count(pattern.begin(), pattern.end(), '*') > 4) place.at(i).refuse("has more than 4 '*'");
    bool found = false;
    for (const std::string& name : known_columns()) {
      if (!fits(pattern, name)) continue;
      found = true;
      if (std::find(columns.begin(), columns.end(), name) == columns.end()) columns.push_back(name);
    }
    if (!found) place.at(i).refuse("{}", unknown_key_message(pattern, known_columns()));
  }
  return columns;
}

std::map<std::string, json> frame_values(const json& frame) {
  std::map<std::string, json> values;
  for (const std::string& name : known_columns())
    if (name.starts_with("dram.") && std::count(name.begin(), name.end(), '.') == 3) values[name] = 0;
  for (const auto& [name, value] : frame.at("counters").items()) values[name] = value;
  for (const json& row : frame.at("dram"))
    for (const char* way : {"read_bytes", "written_bytes"})
      values[ledger_column(row.at("unit"), row.at("purpose"), way)] = row.at(way);
  if (frame.contains("baselines"))
    for (const auto& [scheme, counters] : frame["baselines"].items())
      for (const auto& [name, value] : counters.items())
        values[std::string(kBaseline) + scheme + "." + name.substr(kBaseline.size())] = value;
  for (const char* member : {"timing", "energy", "area"})
    if (frame.contains(member)) add_numbers(frame[member], member, values);
  return values;
}

}  // namespace tessera::replay

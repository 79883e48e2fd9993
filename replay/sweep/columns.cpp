#include "replay/sweep/columns.h"

#include <algorithm>
#include <array>

#include "base/key_table.h"
#include "baselines/baseline_counters.h"
#include "gpu/configuration.h"
#include "memory/ledger.h"
#include "replay/describe.h"
#include "replay/machine_report.h"
#include "replay/statistics.h"

namespace tessera::replay {
namespace {

using nlohmann::json;
using scene::gltf::Place;

constexpr std::string_view kBaseline = "baseline.";

std::string ledger_column(const std::string& unit, const std::string& purpose, const char* way) {
  return "dram." + unit + "." + purpose + "." + way;
}

// "*" matches any characters, or none.
bool fits(std::string_view pattern, std::string_view text) {
  const std::size_t star = pattern.find('*');
  if (star == std::string_view::npos) return pattern == text;
  if (!text.starts_with(pattern.substr(0, star))) return false;
  const std::string_view rest = pattern.substr(star + 1);
  for (std::size_t at = star; at <= text.size(); ++at)
    if (fits(rest, text.substr(at))) return true;
  return false;
}

constexpr std::array<const char*, 3> kModelMembers = {"timing", "energy", "area"};
constexpr std::array<std::string_view, 6> kModelTotals = {
    "timing.cycles",   "timing.time_ms", "timing.frames_per_second",
    "energy.total_nj", "energy.power_w", "area.total_mm2"};

// Numbers, flags and texts.
void add_values(const json& value, const std::string& name, std::map<std::string, json>& into) {
  if (value.is_number() || value.is_string() || value.is_boolean()) into[name] = value;
  if (value.is_object())
    for (const auto& [member, inner] : value.items()) add_values(inner, name + "." + member, into);
}

std::map<std::string, json> model_values(const json& frame) {
  std::map<std::string, json> values;
  for (const char* member : kModelMembers)
    if (frame.contains(member)) add_values(frame[member], member, values);
  return values;
}

std::vector<std::string> model_columns() {
  timing::FrameTiming timing;
  timing.events.emplace();
  std::vector<std::string> names(kModelTotals.begin(), kModelTotals.end());
  json model = {{"area", area_json(gpu::GpuConfiguration().area())}};
  put_model({}, timing, hardware::frame_energy({}, {}, 0, 0), 1, model);
  for (const auto& [name, value] : model_values(model))
    if (std::find(kModelTotals.begin(), kModelTotals.end(), name) == kModelTotals.end()) names.push_back(name);
  return names;
}

std::vector<std::string> effect_names() {
  std::vector<std::string> names;
  for (const json& effect : describe_json("effects")) names.push_back(effect["name"]);
  return names;
}

constexpr std::array<const char*, 4> kOtherMembers = {"effects", "effect_reasons", "effect_places", "right_eye"};

// Columns for members of stats.json besides counters and the model; effects are the ones that declare a name.
std::vector<std::string> other_columns() {
  std::vector<std::string> names;
  for (const std::string& effect : effect_names()) {
    names.push_back("effects." + effect);
    names.push_back("effect_reasons." + effect);
    for (const char* of : {"sub_patches", "sub_patches_elided", "tiles"})
      names.push_back("effect_places." + effect + "." + of);
  }
  for (const char* kept : {"history", "velocity"}) names.push_back(std::string("effect_reasons.") + kept);
  for (const json& counter : describe_counters())
    if (const std::string name = counter["name"]; !name.starts_with(kBaseline))
      names.push_back("right_eye.counters." + name);
  return names;
}

bool of_others(std::string_view column) {
  return std::any_of(kOtherMembers.begin(), kOtherMembers.end(), [&](std::string_view member) {
    return column.starts_with(member) && column[member.size()] == '.';
  });
}

bool of_model(std::string_view column) {
  return std::any_of(kModelMembers.begin(), kModelMembers.end(), [&](std::string_view member) {
    return column.starts_with(member) && column[member.size()] == '.';
  });
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
    const std::vector<std::string> model = model_columns();
    names.insert(names.end(), model.begin(), model.end());
    const std::vector<std::string> others = other_columns();
    names.insert(names.end(), others.begin(), others.end());
    for (const baselines::SchemeRow& scheme : baselines::kSchemes)
      for (const auto& field : kCounterFields<baselines::BaselineCounters>)
        names.push_back(std::string(kBaseline) + std::string(scheme.name) + "." +
                        std::string(field.name.substr(kBaseline.size())));
    return names;
  }();
  return kKnown;
}

std::string current_column(std::string name) {
  constexpr std::string_view kFormer = "baseline.pre-tessellation.", kNow = "baseline.tessera.";
  if (name.starts_with(kFormer)) name.replace(0, kFormer.size(), kNow);
  return name;
}

bool needs_baselines(const std::string& column) { return column.starts_with(kBaseline); }

std::vector<std::string> default_columns(bool baselines) {
  std::vector<std::string> names;
  for (const std::string& name : known_columns())
    if ((baselines || !needs_baselines(name)) && !of_others(name) &&
        (!of_model(name) || std::find(kModelTotals.begin(), kModelTotals.end(), name) != kModelTotals.end()))
      names.push_back(name);
  return names;
}

std::vector<std::string> read_columns(const json& value, const Place& place) {
  if (!value.is_array() || value.empty()) place.refuse("is not a list of column names");
  std::vector<std::string> columns;
  for (std::size_t i = 0; i < value.size(); ++i) {
    if (!value[i].is_string()) place.at(i).refuse("is not a text");
    const std::string pattern = current_column(value[i].get<std::string>());
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

std::vector<std::string> written_out(const json& value) {
  std::vector<std::string> names;
  for (const json& name : value)
    if (const std::string text = name; text.find('*') == std::string::npos) names.push_back(text);
  return names;
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
  values.merge(model_values(frame));
  for (const char* member : kOtherMembers)
    if (frame.contains(member)) add_values(frame[member], member, values);
  return values;
}

}  // namespace tessera::replay

#include "replay/sweep/axis_values.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include "base/error.h"
#include "base/former_keys.h"
#include "base/key_table.h"
#include "base/text.h"

namespace tessera::replay {
namespace {

using nlohmann::json;
using scene::gltf::Place;

// The current name of a key: `key` itself, or the name that replaces it.
std::string checked_key(const std::string& key, const Place& place) {
  static const std::vector<std::string> kKnown = [] {
    std::vector<std::string> known = gpu::known_keys();
    known.emplace_back(kGpuKey);
    known.emplace_back(kSizeKey);
    return known;
  }();
  std::string current = current_key(key);
  if (std::find(kKnown.begin(), kKnown.end(), current) == kKnown.end())
    place.refuse("{}", unknown_key_message(key, kKnown));
  return current;
}

std::vector<std::string> read_keys(const json& axis, const Place& place, std::vector<std::string>& notes) {
  if (axis.contains("key") == axis.contains("keys")) place.refuse("needs either 'key' or 'keys'");
  std::vector<std::string> keys;
  const auto take = [&](const json& key, const Place& where) {
    if (!key.is_string()) where.refuse("is not a text");
    if (const FormerKey* former = find_former_key(key.get<std::string>()); former != nullptr && !former->now.empty())
      notes.push_back(former_key_note(*former));
    keys.push_back(checked_key(key.get<std::string>(), where));
  };
  if (axis.contains("key")) {
    take(axis["key"], place.at("key"));
  } else {
    const json& list = axis["keys"];
    if (!list.is_array() || list.empty()) place.at("keys").refuse("is not a list of keys");
    for (std::size_t i = 0; i < list.size(); ++i) take(list[i], place.at("keys").at(i));
  }
  return keys;
}

double number_of(const json& range, const char* name, const Place& place) {
  if (!range.contains(name)) place.refuse("lacks '{}'", name);
  if (!range[name].is_number()) place.at(name).refuse("is not a number");
  return range[name].get<double>();
}

// Whole numbers stay whole, so that they fit whole keys.
json plain_number(double value) {
  if (value == std::floor(value) && std::abs(value) <= 9007199254740992.0) return static_cast<std::int64_t>(value);
  return value;
}

bool is_whole(const std::string& key) {
  const auto whole = [](const auto& table, const std::string& name) {
    const auto* found = table.find(name);
    return found != nullptr && std::holds_alternative<std::int64_t>(table.default_value(*found));
  };
  return whole(gpu::gpu_keys(), key) || whole(gpu::settings_keys(), key);
}

OpenRange read_open_range(const json& range, const Place& place, const std::vector<std::string>& keys) {
  OpenRange open{number_of(range, "from", place), number_of(range, "to", place), false,
                 std::any_of(keys.begin(), keys.end(), is_whole)};
  if (!(open.from < open.to)) place.refuse("ends before it begins");
  if (const auto scale = range.find("scale"); scale != range.end()) {
    if (*scale != "linear" && *scale != "log") place.at("scale").refuse("is neither linear nor log");
    open.logarithmic = *scale == "log";
    if (open.logarithmic && !(open.from > 0)) place.refuse("a logarithmic range begins above 0");
  }
  if (open.whole && (open.from != std::floor(open.from) || open.to != std::floor(open.to)))
    place.refuse("ends of a range of whole numbers are whole");
  return open;
}

std::vector<json> read_range(const json& range, const Place& place, std::uint64_t max_steps, bool open) {
  check_members(range, place, {"from", "to", "step", "factor", "scale"});
  const double from = number_of(range, "from", place), to = number_of(range, "to", place);
  if (range.contains("step") == range.contains("factor"))
    place.refuse("needs either 'step' or 'factor'{}",
                 open ? ", or neither" : "; a range of any number is for studies with a 'sample' or a 'goal'");
  if (range.contains("scale")) place.at("scale").refuse("is of ranges without 'step' and 'factor'");
  if (to < from) place.refuse("ends before it begins");
  double last = 0;  // number of the last step
  const bool linear = range.contains("step");
  const double by = number_of(range, linear ? "step" : "factor", place);
  if (linear) {
    if (!(by > 0)) place.at("step").refuse("is not greater than 0");
    last = std::floor((to - from) / by + 1e-9);
  } else {
    if (!(by > 1) || !(from > 0)) place.refuse("a range by a factor begins above 0, and the factor is greater than 1");
    last = std::floor(std::log(to / from) / std::log(by) + 1e-9);
  }
  if (!(last < static_cast<double>(max_steps)))
    throw LimitError(fmt::format("{}: {}: the range has more than {} steps (--max-points)", place.file(),
                                 place.pointer(), max_steps));
  std::vector<json> values;
  for (std::uint64_t i = 0; i <= static_cast<std::uint64_t>(last); ++i)
    values.push_back(
        plain_number(linear ? from + by * static_cast<double>(i) : from * std::pow(by, static_cast<double>(i))));
  return values;
}

bool has_open_range(const json& axis) {
  const auto range = axis.find("range");
  return range != axis.end() && range->is_object() && !range->contains("step") && !range->contains("factor");
}

std::vector<json> read_steps(const json& axis, const Place& place, std::uint64_t max_steps, bool open) {
  if (axis.contains("values") == axis.contains("range")) place.refuse("needs either 'values' or 'range'");
  if (axis.contains("range")) return read_range(axis["range"], place.at("range"), max_steps, open);
  const json& list = axis["values"];
  if (!list.is_array() || list.empty()) place.at("values").refuse("is not a list of values");
  if (list.size() > max_steps)
    throw LimitError(fmt::format("{}: {}: more than {} values (--max-points)", place.file(),
                                 place.at("values").pointer(), max_steps));
  return list.get<std::vector<json>>();
}

}  // namespace

double OpenRange::value(double at) const {
  // Half a number before the first and behind the last, so that each has its part.
  const double low = whole ? from - 0.5 : from, high = whole ? to + 0.5 : to;
  const double begin = logarithmic ? std::max(low, from / 2) : low;
  double number = logarithmic ? begin * std::pow(high / begin, at) : low + (high - low) * at;
  number = whole ? std::round(number) : std::stod(fmt::format("{:.6g}", number));
  return std::clamp(number, from, to);
}

std::uint32_t StudyAxis::step_at(double coordinate) {
  if (!range)
    return static_cast<std::uint32_t>(
        std::min(values.size() - 1, static_cast<std::size_t>(coordinate * static_cast<double>(values.size()))));
  const double number = range->value(coordinate);
  const auto [at, fresh] = taken.try_emplace(number, static_cast<std::uint32_t>(values.size()));
  if (fresh) values.emplace_back(keys.size(), plain_number(number));
  return at->second;
}

StudyAxis read_axis(const json& value, const Place& place, std::uint64_t max_steps, bool open) {
  check_members(value, place, {"key", "keys", "values", "range"});
  StudyAxis axis;
  axis.keys = read_keys(value, place, axis.key_notes);
  if (open && has_open_range(value) && !value.contains("values")) {
    const Place where = place.at("range");
    check_members(value["range"], where, {"from", "to", "step", "factor", "scale"});
    axis.range = read_open_range(value["range"], where, axis.keys);
    for (const double end : {axis.range->from, axis.range->to})
      axis.values.emplace_back(axis.keys.size(), plain_number(end));
    return axis;
  }
  std::set<std::string> seen;
  const std::vector<json> steps = read_steps(value, place, max_steps, open);
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const Place where = place.at("values").at(i);
    if (!seen.insert(steps[i].dump()).second) where.refuse("is there twice");
    if (!steps[i].is_array()) {
      axis.values.emplace_back(axis.keys.size(), steps[i]);
    } else if (steps[i].size() == axis.keys.size()) {
      axis.values.push_back(steps[i].get<std::vector<json>>());
    } else {
      where.refuse("has {} values for {} keys", steps[i].size(), axis.keys.size());
    }
  }
  return axis;
}

}  // namespace tessera::replay

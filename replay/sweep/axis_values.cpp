#include "replay/sweep/axis_values.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include "base/error.h"
#include "base/key_table.h"
#include "base/text.h"

namespace tessera::replay {
namespace {

using nlohmann::json;
using scene::gltf::Place;

void check_members(const json& object, const Place& place, const std::vector<std::string>& known) {
  if (!object.is_object()) place.refuse("is not an object");
  for (const auto& [name, value] : object.items())
    if (std::find(known.begin(), known.end(), name) == known.end())
      place.at(name).refuse("{}", unknown_key_message(name, known));
}

void check_key(const std::string& key, const Place& place) {
  static const std::vector<std::string> kKnown = [] {
    std::vector<std::string> known = gpu::known_keys();
    known.emplace_back(kGpuKey);
    known.emplace_back(kSizeKey);
    return known;
  }();
  if (std::find(kKnown.begin(), kKnown.end(), key) == kKnown.end())
    place.refuse("{}", unknown_key_message(key, kKnown));
}

std::vector<std::string> read_keys(const json& axis, const Place& place) {
  if (axis.contains("key") == axis.contains("keys")) place.refuse("needs either 'key' or 'keys'");
  std::vector<std::string> keys;
  const auto take = [&](const json& key, const Place& where) {
    if (!key.is_string()) where.refuse("is not a text");
    check_key(key.get<std::string>(), where);
    keys.push_back(key.get<std::string>());
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

std::vector<json> read_range(const json& range, const Place& place, std::uint64_t max_steps) {
  check_members(range, place, {"from", "to", "step", "factor"});
  const double from = number_of(range, "from", place), to = number_of(range, "to", place);
  if (range.contains("step") == range.contains("factor")) place.refuse("needs either 'step' or 'factor'");
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

std::vector<json> read_steps(const json& axis, const Place& place, std::uint64_t max_steps) {
  if (axis.contains("values") == axis.contains("range")) place.refuse("needs either 'values' or 'range'");
  if (axis.contains("range")) return read_range(axis["range"], place.at("range"), max_steps);
  const json& list = axis["values"];
  if (!list.is_array() || list.empty()) place.at("values").refuse("is not a list of values");
  if (list.size() > max_steps)
    throw LimitError(fmt::format("{}: {}: more than {} values (--max-points)", place.file(),
                                 place.at("values").pointer(), max_steps));
  return list.get<std::vector<json>>();
}

}  // namespace

StudyAxis read_axis(const json& value, const Place& place, std::uint64_t max_steps) {
  check_members(value, place, {"key", "keys", "values", "range"});
  StudyAxis axis;
  axis.keys = read_keys(value, place);
  std::set<std::string> seen;
  const std::vector<json> steps = read_steps(value, place, max_steps);
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

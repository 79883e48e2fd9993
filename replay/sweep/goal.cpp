#include "replay/sweep/goal.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include <fmt/format.h>

#include "base/key_table.h"
#include "replay/sweep/axis_values.h"
#include "replay/sweep/columns.h"

namespace tessera::replay {
namespace {

using nlohmann::json;
using scene::gltf::Place;

constexpr double kInfinite = std::numeric_limits<double>::infinity();

std::uint64_t whole_from(const json& object, const char* member, const Place& place, std::uint64_t least,
                         std::optional<std::uint64_t> otherwise) {
  const auto at = object.find(member);
  if (at == object.end()) {
    if (!otherwise) place.refuse("lacks '{}'", member);
    return *otherwise;
  }
  if (!at->is_number_unsigned() || at->get<std::uint64_t>() < least)
    place.at(member).refuse("is not a whole number from {} on", least);
  return at->get<std::uint64_t>();
}

void check_column(const std::string& column, const Place& place) {
  const std::vector<std::string>& known = known_columns();
  if (std::find(known.begin(), known.end(), column) == known.end())
    place.refuse("{}", unknown_key_message(column, known));
  if (column == "timing.bound_by" || column.starts_with("effect_reasons."))
    place.refuse("'{}' is a text, not a number", column);
}

Goal::Limit read_limit(const std::string& column, const json& value, const Place& place) {
  check_column(column, place);
  check_members(value, place, {"at_least", "at_most"});
  Goal::Limit limit{column, {}, {}};
  const auto take = [&](const char* member, std::optional<double>& into) {
    if (const auto at = value.find(member); at != value.end()) {
      if (!at->is_number()) place.at(member).refuse("is not a number");
      into = at->get<double>();
    }
  };
  take("at_least", limit.at_least);
  take("at_most", limit.at_most);
  if (!limit.at_least && !limit.at_most) place.refuse("needs 'at_most', 'at_least' or both");
  if (limit.at_least && limit.at_most && *limit.at_least > *limit.at_most) place.refuse("leaves nothing between");
  return limit;
}

double missed_by(const Goal::Limit& limit, double value) {
  const auto part = [](double excess, double of) { return excess <= 0 ? 0 : excess / (of == 0 ? 1 : std::abs(of)); };
  double missed = 0;
  if (limit.at_most) missed = std::max(missed, part(value - *limit.at_most, *limit.at_most));
  if (limit.at_least) missed = std::max(missed, part(*limit.at_least - value, *limit.at_least));
  return missed;
}

}  // namespace

Sample read_sample(const json& value, const Place& place) {
  check_members(value, place, {"method", "points", "seed"});
  Sample sample;
  const std::string method = value.value("method", json("latin_hypercube")).is_string()
                                 ? value.value("method", std::string("latin_hypercube"))
                                 : std::string();
  if (method == name(SampleMethod::kRandom))
    sample.method = SampleMethod::kRandom;
  else if (method != name(SampleMethod::kLatinHypercube))
    place.at("method").refuse("is neither latin_hypercube nor random");
  sample.points = whole_from(value, "points", place, 1, std::nullopt);
  sample.seed = whole_from(value, "seed", place, 0, 0);
  return sample;
}

Goal read_goal(const json& value, const Place& place) {
  check_members(value, place, {"minimise", "maximise", "subject_to", "points", "population", "seed"});
  if (value.contains("minimise") == value.contains("maximise")) place.refuse("needs either 'minimise' or 'maximise'");
  Goal goal;
  goal.maximise = value.contains("maximise");
  const char* member = goal.maximise ? "maximise" : "minimise";
  if (!value[member].is_string()) place.at(member).refuse("is not the name of a column");
  goal.column = value[member].get<std::string>();
  check_column(goal.column, place.at(member));
  if (const auto limits = value.find("subject_to"); limits != value.end()) {
    const Place where = place.at("subject_to");
    if (!limits->is_object()) where.refuse("is not an object of columns and their limits");
    for (const auto& [column, limit] : limits->items())
      goal.subject_to.push_back(read_limit(column, limit, where.at(column)));
  }
  goal.points = value.contains("points") ? whole_from(value, "points", place, 1, std::nullopt) : 0;
  for (const char* of_search : {"population", "seed"})
    if (value.contains(of_search) && goal.points == 0) place.at(of_search).refuse("is of a search, which has 'points'");
  goal.population = whole_from(value, "population", place, 4, 0);
  if (goal.population > 1000) place.at("population").refuse("is more than 1000");
  goal.seed = whole_from(value, "seed", place, 0, 0);
  return goal;
}

void check_axes_of_goal(const Place& place, Study& study) {
  if (study.axes.empty()) place.refuse("there is nothing to choose without 'axes'");
  if (study.searches() && study.goal->population == 0)
    study.goal->population = std::clamp<std::size_t>(5 * study.axes.size(), 8, 40);
}

std::vector<std::string> goal_columns(const Goal& goal) {
  std::vector<std::string> columns = {goal.column};
  for (const Goal::Limit& limit : goal.subject_to) columns.push_back(limit.column);
  return columns;
}

void add_columns_of_goal(Study& study) {
  const auto add = [](std::vector<std::string>& to, const std::string& column) {
    if (std::find(to.begin(), to.end(), column) == to.end()) to.push_back(column);
  };
  for (const std::string& column : goal_columns(*study.goal)) {
    add(study.columns, column);
    add(study.kept, column);
  }
}

Score score_of(const Goal& goal, std::span<const json> frames) {
  if (frames.empty()) return {0, kInfinite};
  Score score;
  std::vector<double> missed(goal.subject_to.size(), 0);
  for (const json& frame : frames) {
    const std::map<std::string, json> values = frame_values(frame);
    const auto number = [&](const std::string& column) {
      const auto at = values.find(column);
      if (at == values.end() || at->second.is_string()) return std::numeric_limits<double>::quiet_NaN();
      return at->second.is_boolean() ? static_cast<double>(at->second.get<bool>()) : at->second.get<double>();
    };
    const double objective = number(goal.column);
    if (std::isnan(objective)) return {0, kInfinite};
    score.objective += (goal.maximise ? -objective : objective) / static_cast<double>(frames.size());
    for (std::size_t l = 0; l < missed.size(); ++l) {
      const double value = number(goal.subject_to[l].column);
      if (std::isnan(value)) return {0, kInfinite};
      missed[l] = std::max(missed[l], missed_by(goal.subject_to[l], value));
    }
  }
  for (const double by : missed) score.violation += by;
  return score;
}

std::string objective_text(const Goal& goal, const Score& score) {
  return fmt::format("{} {:.6g}", goal.column, goal.maximise ? -score.objective : score.objective);
}

json sample_json(const Sample& sample) {
  return {{"method", name(sample.method)}, {"points", sample.points}, {"seed", sample.seed}};
}

json goal_json(const Goal& goal) {
  json limits = json::object();
  for (const Goal::Limit& limit : goal.subject_to) {
    json& row = limits[limit.column] = json::object();
    if (limit.at_least) row["at_least"] = *limit.at_least;
    if (limit.at_most) row["at_most"] = *limit.at_most;
  }
  json out = {{goal.maximise ? "maximise" : "minimise", goal.column}, {"subject_to", limits}};
  if (goal.points > 0) out.update({{"points", goal.points}, {"population", goal.population}, {"seed", goal.seed}});
  return out;
}

}  // namespace tessera::replay

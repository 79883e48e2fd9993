// A comparison for people and programs.
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/error.h"
#include "base/json_text.h"
#include "base/text.h"
#include "replay/compare/causes.h"
#include "replay/compare/comparison.h"

namespace tessera::replay {
namespace {

using nlohmann::json;

constexpr Section kSections[] = {Section::kSummary,   Section::kPath,      Section::kPasses,
                                 Section::kUnits,     Section::kPurposes,  Section::kEnergy,
                                 Section::kDrawables, Section::kMaterials, Section::kCounters};

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

std::string number_text(const std::optional<double>& value) {
  if (!value) return "-";
  if (*value == std::floor(*value) || std::abs(*value) >= 1e5) return fmt::format("{:.0f}", *value);
  return fmt::format("{:.5g}", *value);
}

json number_json(const std::optional<double>& value) {
  if (!value) return json();
  if (*value == std::floor(*value) && std::abs(*value) < 9e15) return static_cast<std::int64_t>(*value);
  return *value;
}

std::vector<std::optional<double>> values_of(const Comparison& c, Section section, const std::string& name) {
  std::vector<std::optional<double>> values;
  for (const RunFigures& figures : c.figures) values.push_back(figures.value(section, name));
  return values;
}

bool differ(const std::vector<std::optional<double>>& values) {
  return std::any_of(values.begin(), values.end(), [&](const auto& value) { return value != values[0]; });
}

constexpr std::size_t kNameWidth = 36, kValueWidth = 16, kRatioWidth = 9;

std::string cut_name(const std::string& name) { return escape_control(name, kNameWidth); }

// Names of the columns: values of all, then each against the first.
std::string head_line(const Comparison& c, const char* title) {
  std::string text = fmt::format("\n{:<{}}", title, kNameWidth);
  for (const std::string& label : c.labels) text += fmt::format(" {:>{}}", label, kValueWidth);
  for (std::size_t r = 1; r < c.labels.size(); ++r) text += fmt::format(" {:>{}}", c.labels[r] + "/A", kRatioWidth);
  return text + "\n";
}

std::string row_line(const std::string& name, const std::vector<std::optional<double>>& values) {
  std::string text = fmt::format("{:<{}}", cut_name(name), kNameWidth);
  for (const auto& value : values) text += fmt::format(" {:>{}}", number_text(value), kValueWidth);
  for (std::size_t r = 1; r < values.size(); ++r)
    text += fmt::format(" {:>{}}",
                        values[0] && values[r] && *values[0] > 0 ? fmt::format("{:.3f}", *values[r] / *values[0]) : "-",
                        kRatioWidth);
  return text + "\n";
}

std::string section_text(const Comparison& c, Section section, bool all) {
  constexpr std::size_t kShown = 20;
  std::string lines;
  std::size_t shown = 0, hidden = 0, equal = 0;
  for (const std::string& name : c.rows(section)) {
    const std::vector<std::optional<double>> values = values_of(c, section, name);
    const bool same = !differ(values) && section != Section::kSummary;
    if (!all && same) {
      ++equal;
    } else if (!all && section != Section::kCounters && shown == kShown) {
      ++hidden;
    } else {
      lines += row_line(name, values);
      ++shown;
    }
  }
  if (shown + equal + hidden == 0) return "";
  std::string text = shown > 0 ? head_line(c, info(section).title) + lines : "";
  if (section == Section::kSummary) {
    text += fmt::format("{:<{}}", "bound_by", kNameWidth);
    for (const RunFigures& figures : c.figures)
      text += fmt::format(" {:>{}}", figures.bound_by.empty() ? "-" : figures.bound_by, kValueWidth);
    text += "\n";
  }
  if (shown == 0)
    text += fmt::format("\n{}: all {} are equal\n", info(section).title, equal);
  else if (equal + hidden > 0)
    text +=
        fmt::format("... {} equal{} (--all)\n", equal, hidden > 0 ? fmt::format(", {} that differ less", hidden) : "");
  return text;
}

std::string cell(const json& value) {
  return value.is_null() ? "-" : value.is_string() ? escape_control(value.get<std::string>(), 24) : value.dump();
}

std::string keys_text(const Comparison& c) {
  const std::vector<std::string> names = c.differing_keys();
  if (names.empty()) return "";
  std::string text = fmt::format("\n{:<{}}", "keys that differ", kNameWidth);
  for (const std::string& label : c.labels) text += fmt::format(" {:>{}}", label, kValueWidth);
  text += "\n";
  for (const std::string& name : names) {
    text += fmt::format("{:<{}}", cut_name(name), kNameWidth);
    for (const RunStatistics& run : c.runs) {
      const auto keys = run.keys();
      const auto found = keys.find(name);
      text += fmt::format(" {:>{}}", found == keys.end() ? "-" : cell(found->second), kValueWidth);
    }
    text += "\n";
  }
  return text;
}

}  // namespace

json comparison_json(const Comparison& c) {
  json out = {{"runs", json::array()}, {"notes", c.notes}, {"frames_compared", c.frames}};
  for (std::size_t r = 0; r < c.runs.size(); ++r)
    out["runs"].push_back({{"label", c.labels[r]}, {"file", c.runs[r].file.string()}, {"frames", c.runs[r].frames}});
  for (const Section section : kSections) {
    json rows = json::array();
    for (const std::string& name : c.rows(section)) {
      json row = {{"name", name}};
      for (std::size_t r = 0; r < c.runs.size(); ++r)
        row[lower(c.labels[r])] = number_json(c.figures[r].value(section, name));
      rows.push_back(std::move(row));
    }
    out[info(section).name] = std::move(rows);
  }
  std::vector<std::map<std::string, json>> keys;
  for (const RunStatistics& run : c.runs) keys.push_back(run.keys());
  out["keys"] = json::array();
  for (const std::string& name : c.differing_keys()) {
    json row = {{"name", name}};
    for (std::size_t r = 0; r < c.runs.size(); ++r)
      row[lower(c.labels[r])] = keys[r].contains(name) ? keys[r].at(name) : json();
    out["keys"].push_back(std::move(row));
  }
  for (std::size_t r = 0; r < c.runs.size(); ++r) {
    out["bound_by"][lower(c.labels[r])] = c.figures[r].bound_by;
    if (r > 0) out["why"][lower(c.labels[r])] = cause_json(causes_of(c, r));
  }
  return out;
}

std::string comparison_csv(const Comparison& c) {
  std::string text = fmt::format("section,name,{}\n", fmt::join(c.labels, ","));
  for (const Section section : kSections)
    for (const std::string& name : c.rows(section)) {
      text += fmt::format("{},{}", info(section).name, csv_cell(name));
      for (const RunFigures& figures : c.figures) {
        const std::optional<double> value = figures.value(section, name);
        text += "," + (value ? fmt::format("{:.15g}", *value) : std::string());
      }
      text += "\n";
    }
  text += "summary,bound_by";
  for (const RunFigures& figures : c.figures) text += "," + csv_cell(figures.bound_by);
  text += "\n";
  std::vector<std::map<std::string, json>> keys;
  for (const RunStatistics& run : c.runs) keys.push_back(run.keys());
  for (const std::string& name : c.differing_keys()) {
    text += "keys," + csv_cell(name);
    for (const auto& of : keys) text += "," + (of.contains(name) ? csv_cell(of.at(name)) : std::string());
    text += "\n";
  }
  return text;
}

std::string comparison_text(const Comparison& c, bool all) {
  std::string text;
  for (std::size_t r = 0; r < c.runs.size(); ++r)
    text += fmt::format("{}  {}\n", c.labels[r], escape_control(c.runs[r].file.string()));
  for (const std::string& note : c.notes) text += fmt::format("note: {}\n", note);
  for (std::size_t r = 1; r < c.runs.size(); ++r) text += "\n" + cause_text(causes_of(c, r));
  for (const Section section : kSections) text += section_text(c, section, all);
  return text + keys_text(c);
}

// ---- Thresholds -------------------------------------------------------------------------------------------------

namespace {

// Metrics of runs that have names of their own, with the row of the summary.
constexpr std::pair<const char*, const char*> kRunMetrics[] = {
    {"time", kTimeRow}, {"cycles", kCyclesRow}, {"energy", kEnergyRow}, {"traffic", kTrafficRow}};
constexpr const char* kImageMetrics[] = {"flip", "max", "psnr", "ssim"};

}  // namespace

bool Threshold::of_images() const {
  return std::any_of(std::begin(kImageMetrics), std::end(kImageMetrics),
                     [&](const char* name) { return metric == name; });
}

std::vector<Threshold> parse_thresholds(const std::vector<std::string>& texts) {
  std::vector<Threshold> thresholds;
  for (const std::string& text : texts) {
    const std::size_t equals = text.find('=');
    const std::string number = equals == std::string::npos ? text : text.substr(equals + 1);
    char* end = nullptr;
    const double limit = std::strtod(number.c_str(), &end);
    if (number.empty() || *end != '\0' || !(limit >= 0) || !std::isfinite(limit) || equals == 0)
      throw UsageError(
          fmt::format("--threshold {}: expected [METRIC=]LIMIT, LIMIT a number from 0 on", escape_control(text, 40)));
    if (equals != std::string::npos)
      thresholds.push_back({text.substr(0, equals), limit});
    else
      for (const char* metric : {"time", "energy", "traffic"}) thresholds.push_back({metric, limit});
  }
  return thresholds;
}

std::vector<std::string> broken_thresholds(const Comparison& c, const std::vector<Threshold>& thresholds) {
  std::vector<std::string> broken;
  for (const Threshold& threshold : thresholds) {
    Section section = Section::kCounters;
    std::string row = threshold.metric;
    for (const auto& [metric, name] : kRunMetrics)
      if (threshold.metric == metric) section = Section::kSummary, row = name;
    const std::vector<std::string> known = c.rows(section);
    if (std::find(known.begin(), known.end(), row) == known.end()) {
      std::vector<std::string> names = c.rows(Section::kCounters);
      for (const auto& [metric, name] : kRunMetrics) names.emplace_back(metric);
      const std::string nearest = nearest_name(threshold.metric, names);
      throw UsageError(fmt::format(
          "--threshold {}: no run has it{}", escape_control(threshold.metric, 60),
          nearest.empty() || nearest == threshold.metric ? "" : fmt::format("; did you mean '{}'?", nearest)));
    }
    const double before = c.figures[0].value(section, row).value_or(0);
    for (std::size_t r = 1; r < c.runs.size(); ++r) {
      const double after = c.figures[r].value(section, row).value_or(0);
      if (after > before * (1 + threshold.limit / 100))
        broken.push_back(fmt::format("{}: {} {}, at most {:g} % more are allowed", c.labels[r], threshold.metric,
                                     change_text(before, after), threshold.limit));
    }
  }
  return broken;
}

}  // namespace tessera::replay

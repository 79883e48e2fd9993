#include "replay/compare/comparison.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/text.h"
#include "replay/machine_report.h"

namespace tessera::replay {
namespace {

using nlohmann::json;

double value_or_0(const RunFigures& figures, Section section, const std::string& name) {
  return figures.value(section, name).value_or(0);
}

// What changes most from the first run, in any of the others.
double largest_change(const Comparison& c, Section section, const std::string& name) {
  double most = 0;
  for (const RunFigures& figures : c.figures)
    most = std::max(most, std::abs(value_or_0(figures, section, name) - value_or_0(c.figures[0], section, name)));
  return most;
}

std::string signed_count(double value) {
  const double size = std::abs(value);
  const char* sign = value < 0 ? "-" : "+";
  if (size >= 1e6) return fmt::format("{}{:.2f} M", sign, size * 1e-6);
  if (size >= 1e4) return fmt::format("{}{:.1f} k", sign, size * 1e-3);
  return fmt::format("{}{:.0f}", sign, size);
}

std::string signed_bytes(double value) {
  return fmt::format("{}{}", value < 0 ? "-" : "+", human_bytes(static_cast<std::uint64_t>(std::abs(value))));
}

// The rows of a section that changed most: "texture +1.20 M, dram +300.0 k".
template <class Text>
std::string largest_changes(const Comparison& c, std::size_t run, Section section, double least, const Text& text) {
  constexpr std::size_t kShown = 3;
  std::vector<std::pair<std::string, double>> changes;
  for (const std::string& name : c.rows(section)) {
    if (section == Section::kUnits && name == "tilecores") continue;  // all of them together
    const double change = value_or_0(c.figures[run], section, name) - value_or_0(c.figures[0], section, name);
    if (std::abs(change) >= std::max(least, 1e-12)) changes.emplace_back(name, change);
  }
  std::stable_sort(changes.begin(), changes.end(),
                   [](const auto& a, const auto& b) { return std::abs(a.second) > std::abs(b.second); });
  if (changes.size() > kShown) changes.resize(kShown);
  std::string out;
  for (const auto& [name, change] : changes)
    out += fmt::format("{}{} {}", out.empty() ? "" : ", ", escape_control(name, 60), text(change));
  return out;
}

std::string key_value(const json& value) {
  return value.is_null() ? "-" : value.is_string() ? escape_control(value.get<std::string>(), 40) : value.dump();
}

json key_of(const std::map<std::string, json>& keys, const std::string& name) {
  const auto found = keys.find(name);
  return found == keys.end() ? json() : found->second;
}

std::string time_fact(const Comparison& c, std::size_t run) {
  const RunFigures &a = c.figures[0], &b = c.figures[run];
  const auto figure = [](const RunFigures& f, const char* name) { return f.value(Section::kSummary, name); };
  const auto time_a = figure(a, kTimeRow), time_b = figure(b, kTimeRow);
  const auto cycles_a = figure(a, kCyclesRow), cycles_b = figure(b, kCyclesRow);
  if (!cycles_a || !cycles_b) return "";
  const double before = time_a && time_b ? *time_a : *cycles_a, after = time_a && time_b ? *time_b : *cycles_b;
  std::string text = before == after
                         ? fmt::format("{} takes as long as A", c.labels[run])
                         : fmt::format("{} is {} than A", c.labels[run], after > before ? "slower" : "faster");
  if (time_a && time_b)
    text += fmt::format(": {:.4g} ms a frame against {:.4g} ({})", after, before, change_text(before, after));
  return text + fmt::format(", {:.0f} cycles against {:.0f}", *cycles_b, *cycles_a);
}

std::string bound_fact(const Comparison& c, std::size_t run) {
  const std::string &a = c.figures[0].bound_by, &b = c.figures[run].bound_by;
  if (a.empty() || b.empty()) return "";
  return a == b ? fmt::format("both are bound by {}", a)
                : fmt::format("{} is bound by {}, A by {}", c.labels[run], b, a);
}

std::string keys_fact(const Comparison& c, std::size_t run) {
  constexpr std::size_t kShown = 6;
  const std::map<std::string, json> a = c.runs[0].keys(), b = c.runs[run].keys();
  std::vector<std::string> names, texts;
  for (const std::string& name : c.differing_keys())
    if (key_of(a, name) != key_of(b, name) && !name.starts_with("effect.") && name != "capture.bytes")
      names.push_back(name);
  for (std::size_t k = 0; k < std::min(kShown, names.size()); ++k)
    texts.push_back(fmt::format("{} {} -> {}", escape_control(names[k], 60), key_value(key_of(a, names[k])),
                                key_value(key_of(b, names[k]))));
  if (names.empty()) return "no key differs: same capture, machine and settings";
  return fmt::format("keys that differ: {}{}", fmt::join(texts, ", "),
                     names.size() > kShown ? fmt::format(" and {} more", names.size() - kShown) : "");
}

}  // namespace

std::string run_label(std::size_t run) {
  return run < 26 ? std::string(1, static_cast<char>('A' + run)) : fmt::format("R{}", run + 1);
}

std::string change_text(double before, double after) {
  if (before == after) return "the same";
  if (before == 0) return "new";
  const double percent = 100 * (after / before - 1);
  return std::abs(percent) >= 0.05 ? fmt::format("{:+.1f} %", percent) : fmt::format("{:+.2g} %", percent);
}

Comparison compare_runs(const std::vector<std::filesystem::path>& files) {
  Comparison c;
  for (const std::filesystem::path& file : files) {
    c.labels.push_back(run_label(c.runs.size()));
    c.runs.push_back(read_run(file));
  }
  c.frames = common_frames(c.runs);
  if (c.frames.empty()) c.notes.emplace_back("no frame is in all of them: figures are those of all frames of each");
  for (std::size_t r = 0; r < c.runs.size(); ++r) {
    const RunStatistics& run = c.runs[r];
    if (!c.frames.empty() && run.frames.size() > c.frames.size())
      c.notes.push_back(
          fmt::format("{} has {} frames, {} of them are compared", c.labels[r], run.frames.size(), c.frames.size()));
    if (run.root.contains("stopped"))
      c.notes.push_back(fmt::format("{} was stopped before its last frame", c.labels[r]));
    c.figures.push_back(figures_of(run, c.frames.empty() ? run.frames : c.frames));
    if (const std::string note =
            coarser_models_note(run.root.value(json::json_pointer("/total/timing"), json::object()));
        !note.empty())
      c.notes.push_back(fmt::format("{} is {}", c.labels[r], note));
  }
  return c;
}

std::vector<std::string> Comparison::rows(Section section) const {
  std::set<std::string> names;
  for (const RunFigures& run : figures)
    for (const auto& [name, value] : run.of(section)) names.insert(name);
  if (section == Section::kSummary) {
    std::vector<std::string> order;
    for (const char* name : {kTimeRow, kCyclesRow, kEnergyRow, kTrafficRow, "dram_read_bytes", "dram_written_bytes"})
      if (names.contains(name)) order.emplace_back(name);
    return order;
  }
  std::vector<std::string> order(names.begin(), names.end());
  if (section != Section::kCounters)
    std::stable_sort(order.begin(), order.end(), [&](const std::string& a, const std::string& b) {
      return largest_change(*this, section, a) > largest_change(*this, section, b);
    });
  return order;
}

std::vector<std::string> Comparison::differing_keys() const {
  std::vector<std::map<std::string, json>> keys;
  std::set<std::string> names;
  for (const RunStatistics& run : runs) {
    keys.push_back(run.keys());
    for (const auto& [name, value] : keys.back()) names.insert(name);
  }
  std::vector<std::string> differ;
  for (const std::string& name : names)
    if (std::any_of(keys.begin(), keys.end(), [&](const auto& k) { return key_of(k, name) != key_of(keys[0], name); }))
      differ.push_back(name);
  return differ;
}

std::vector<std::string> Comparison::why(std::size_t run) const {
  std::vector<std::string> facts;
  const auto add = [&](const char* what, const std::string& text) {
    if (!text.empty()) facts.push_back(what + text);
  };
  const double cycles = value_or_0(figures[0], Section::kSummary, kCyclesRow), least = 0.001 * cycles;
  add("", time_fact(*this, run));
  add("", bound_fact(*this, run));
  const bool path = !figures[0].of(Section::kPath).empty() && !figures[run].of(Section::kPath).empty();
  if (path) add("on the critical path, cycles: ", largest_changes(*this, run, Section::kPath, least, signed_count));
  if (!path) add("busy cycles of units: ", largest_changes(*this, run, Section::kUnits, least, signed_count));
  add("cycles by pass: ", largest_changes(*this, run, Section::kPasses, least, signed_count));
  add("bytes: ", largest_changes(*this, run, Section::kPurposes,
                                 0.001 * value_or_0(figures[0], Section::kSummary, kTrafficRow), signed_bytes));
  add("cycles by drawable: ", largest_changes(*this, run, Section::kDrawables, least, signed_count));
  add("", keys_fact(*this, run));
  return facts;
}

}  // namespace tessera::replay

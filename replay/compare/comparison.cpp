#include "replay/compare/comparison.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/error.h"
#include "base/text.h"
#include "replay/machine_report.h"

namespace tessera::replay {
namespace {

using nlohmann::json;

// The largest change of a row from the first run, among the other runs.
double largest_change(const Comparison& c, Section section, const std::string& name) {
  double most = 0;
  for (const RunFigures& figures : c.figures)
    most = std::max(most, std::abs(figures.value_or_0(section, name) - c.figures[0].value_or_0(section, name)));
  return most;
}

json key_of(const std::map<std::string, json>& keys, const std::string& name) {
  const auto found = keys.find(name);
  return found == keys.end() ? json() : found->second;
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

Comparison compare_runs(const std::vector<std::filesystem::path>& files, const std::vector<int>& frames) {
  std::vector<RunStatistics> runs;
  runs.reserve(files.size());
  for (const std::filesystem::path& file : files) runs.push_back(read_run(file));
  return compare_statistics(std::move(runs), frames);
}

Comparison compare_statistics(std::vector<RunStatistics> runs, const std::vector<int>& frames) {
  Comparison c;
  c.runs = std::move(runs);
  for (std::size_t r = 0; r < c.runs.size(); ++r) c.labels.push_back(run_label(r));
  for (std::size_t r = 0; r < frames.size(); ++r) {
    const std::vector<int>& there = c.runs[r].frames;
    if (std::count(there.begin(), there.end(), frames[r]) == 0)
      throw InputError(c.runs[r].file.string(), "/frames", fmt::format("has no frame {}", frames[r]));
    c.notes.push_back(fmt::format("{} is frame {}", c.labels[r], frames[r]));
    c.frames_of.push_back({frames[r]});
  }
  const bool same = std::all_of(frames.begin(), frames.end(), [&](int frame) { return frame == frames[0]; });
  if (frames.empty())
    c.frames = common_frames(c.runs);
  else if (same)
    c.frames = {frames[0]};
  if (frames.empty() && c.frames.empty())
    c.notes.emplace_back("the runs have no frame in common: each run's figures cover all its frames");
  for (std::size_t r = 0; r < c.runs.size(); ++r) {
    const RunStatistics& run = c.runs[r];
    if (frames.empty()) c.frames_of.push_back(c.frames.empty() ? run.frames : c.frames);
    if (frames.empty() && !c.frames.empty() && run.frames.size() > c.frames.size())
      c.notes.push_back(
          fmt::format("{} has {} frames, {} of them are compared", c.labels[r], run.frames.size(), c.frames.size()));
    if (run.root.contains("stopped"))
      c.notes.push_back(fmt::format("{} was stopped before its last frame", c.labels[r]));
    c.figures.push_back(figures_of(run, c.frames_of[r]));
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

}  // namespace tessera::replay

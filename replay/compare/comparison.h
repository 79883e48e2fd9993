#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "replay/compare/run_figures.h"

namespace tessera::replay {

// Replays side by side; the first is what the others are compared with.
struct Comparison {
  std::vector<std::string> labels;  // "A", "B", ...
  std::vector<RunStatistics> runs;
  std::vector<int> frames;                  // those compared: what all have in common; empty: all of each
  std::vector<std::vector<int>> frames_of;  // those of each run
  std::vector<RunFigures> figures;
  std::vector<std::string> notes;  // what limits the comparison, for people

  // Names of a section's rows that any run has: those that differ most first, or, of counters, by name.
  std::vector<std::string> rows(Section section) const;
  // Keys that are not the same in all.
  std::vector<std::string> differing_keys() const;
};

// `frames`: the frame of each run that is compared, or none: those that all have in common. Throws InputError, also where a run
// does not have its frame.
Comparison compare_runs(const std::vector<std::filesystem::path>& files, const std::vector<int>& frames = {});
// The same of statistics that have been read.
Comparison compare_statistics(std::vector<RunStatistics> runs, const std::vector<int>& frames = {});

// A, B, ... Z, then R27, R28, ...
std::string run_label(std::size_t run);

// "+12.3 %", "-4 %", "the same", "new" where there was nothing before.
std::string change_text(double before, double after);

// As JSON, as a CSV table and as text; `all`: rows that are equal, too.
nlohmann::json comparison_json(const Comparison& comparison);
std::string comparison_csv(const Comparison& comparison);
std::string comparison_text(const Comparison& comparison, bool all);

// ---- Thresholds -------------------------------------------------------------------------------------------------

// "METRIC=LIMIT", or "LIMIT" alone for time, energy and traffic. METRIC is time, cycles, energy, traffic, the name of a
// counter (percent that it may grow); of images flip, max (at most so much), psnr, ssim (at least so much).
struct Threshold {
  std::string metric;
  double limit = 0;

  bool of_images() const;
};
// Throws UsageError.
std::vector<Threshold> parse_thresholds(const std::vector<std::string>& texts);

// What breaks the thresholds of runs, one text for each: "B: cycles +12.3 %, at most 2 % are allowed". Throws UsageError for
// a counter that no run has.
std::vector<std::string> broken_thresholds(const Comparison& comparison, const std::vector<Threshold>& thresholds);

}  // namespace tessera::replay

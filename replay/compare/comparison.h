#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "replay/compare/run_figures.h"

namespace tessera::replay {

// Several replays in comparison; the others are compared with the first.
struct Comparison {
  std::vector<std::string> labels;  // "A", "B", ...
  std::vector<RunStatistics> runs;
  std::vector<int> frames;                  // the compared frames, which all runs have; empty: all frames of each run
  std::vector<std::vector<int>> frames_of;  // the frames of each run
  std::vector<RunFigures> figures;
  std::vector<std::string> notes;  // limits of the comparison, as texts for people

  // Names of a section's rows that any run has, the ones that differ most first; counters by name.
  std::vector<std::string> rows(Section section) const;
  // Keys whose values differ between runs.
  std::vector<std::string> differing_keys() const;
};

// Compares replays. `frames` has the compared frame of each run; empty: all frames that the runs have in common. Throws
// InputError, also where a run lacks its frame.
Comparison compare_runs(const std::vector<std::filesystem::path>& files, const std::vector<int>& frames = {});
// The same for statistics that have been read.
Comparison compare_statistics(std::vector<RunStatistics> runs, const std::vector<int>& frames = {});

// A, B, ... Z, then R27, R28, ...
std::string run_label(std::size_t run);

// "+12.3 %", "-4 %", "the same", "new" where the old value is 0.
std::string change_text(double before, double after);

// The comparison as JSON, as a CSV table and as text; `all` includes equal rows.
nlohmann::json comparison_json(const Comparison& comparison);
std::string comparison_csv(const Comparison& comparison);
std::string comparison_text(const Comparison& comparison, bool all);

// ---- Thresholds -------------------------------------------------------------------------------------------------

// "METRIC=LIMIT", or "LIMIT" alone for time, energy and traffic. METRIC is time, cycles, energy, traffic or the name of
// a counter (LIMIT: percent by which it may grow), or for images flip or max (an upper limit), psnr or ssim (a lower
// limit).
struct Threshold {
  std::string metric;
  double limit = 0;

  bool of_images() const;
};
// Throws UsageError.
std::vector<Threshold> parse_thresholds(const std::vector<std::string>& texts);

// The thresholds that runs break, one text for each: "B: cycles +12.3 %, at most 2 % are allowed". Throws UsageError
// for a counter that no run has.
std::vector<std::string> broken_thresholds(const Comparison& comparison, const std::vector<Threshold>& thresholds);

}  // namespace tessera::replay

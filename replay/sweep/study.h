#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/option_numbers.h"
#include "gpu/configuration.h"
#include "gpu/settings.h"
#include "replay/sweep/unit_samples.h"
#include "replay/time_split.h"
#include "replay/view_options.h"

namespace tessera::replay {

// A range in which samples and searches take any number, not steps.
struct OpenRange {
  double from = 0, to = 0;
  bool logarithmic = false;  // equal factors are equally likely, not equal differences
  bool whole = false;        // whole numbers alone; the ends are as likely as other numbers

  // `at` lies in [0, 1). The value has at most six digits, so that people can read it.
  double value(double at) const;
};

// One dimension of a design space: keys that are set together, and their values.
struct StudyAxis {
  std::vector<std::string> keys;
  std::vector<std::vector<nlohmann::json>> values;  // of each step along the axis: one value per key
  std::optional<OpenRange> range;         // set for a range: `values` are its ends, then the values taken so far
  std::map<double, std::uint32_t> taken;  // for a range: number -> step
  std::vector<std::string> key_notes;     // notes about keys with a former name

  // The step of a coordinate in [0, 1). The values of a list have equal shares; for a range, the number becomes a step.
  std::uint32_t step_at(double coordinate);
};

// "sample": `points` points spread over the axes.
struct Sample {
  SampleMethod method = SampleMethod::kLatinHypercube;
  std::size_t points = 0;
  std::uint64_t seed = 0;
};

// "goal": the best point by a column (goal.h), among all combinations, or in a search if "points" is set.
struct Goal {
  struct Limit {
    std::string column;
    std::optional<double> at_least, at_most;
  };
  std::string column;
  bool maximise = false;
  std::vector<Limit> subject_to;
  std::size_t points = 0, population = 0;  // points 0: no search
  std::uint64_t seed = 0;
};

// A design space, as a study file (JSON; docs/studies.md) describes it. Names are checked, values fit their keys.
struct Study {
  std::filesystem::path file;
  std::string title;
  std::vector<std::string> capture_names;       // as in the file
  std::vector<std::filesystem::path> captures;  // the same, resolved from the folder of the file
  std::optional<std::string> variant;           // of all captures: scene::CaptureLimits::variant
  ViewChoices view;                             // of all captures
  std::optional<FrameRange> frames;             // unset: each capture's own
  std::optional<ImageSize> size;                // unset: each capture's own
  std::string gpu = "mid-mobile";               // preset, or a file found from the folder of the study
  std::vector<std::pair<std::string, nlohmann::json>> settings;
  std::vector<StudyAxis> axes;
  std::vector<std::string> key_notes;  // on keys of settings and axes that go by a former name
  std::optional<Sample> sample;
  std::optional<Goal> goal;
  // With a sample or a goal: the steps of each point along the axes, for each capture; a search adds to them. Otherwise
  // all combinations.
  std::vector<std::vector<std::uint32_t>> chosen;
  std::vector<std::string> columns;  // in the order wanted, patterns resolved
  std::vector<std::string> kept;     // columns that tables keep even where they are 0 in all rows
  bool baselines = false;            // whether a column or the file asks for them
  bool images = false;               // keep the image and the tile maps of every frame
  bool records = false;              // keep the record of every render, for later timings
  std::vector<Split> splits;         // of every frame, in split.csv
  std::uint64_t point_count =
      0;  // captures times steps of all axes, or times the wanted points; for a goal an upper limit

  bool searches() const { return goal && goal->points > 0; }
  bool is_grid() const { return !sample && !searches(); }
  // Keys of all axes, in order.
  std::vector<std::string> axis_keys() const;
  std::vector<std::string> split_names() const;
};

// Keys of an axis besides the keys of set_key(): the preset or file of the machine, and the image's size.
inline constexpr const char* kGpuKey = "gpu";
inline constexpr const char* kSizeKey = "size";

// Throws InputError (file, JSON pointer, fault; unknown names with the nearest known one), and LimitError before it
// makes a study, or a range in it, with more than `max_points` points.
Study read_study(const std::filesystem::path& file, std::uint64_t max_points);
// The same for a document in memory; names are resolved from the folder of `file`.
Study parse_study(const nlohmann::json& root, const std::filesystem::path& file, std::uint64_t max_points);

// The machine for a value of kGpuKey.
gpu::GpuConfiguration load_axis_gpu(const Study& study, const nlohmann::json& value);

// The files that describe machines of a study.
std::vector<std::filesystem::path> machine_files(const Study& study);

// Configuration of one point: the machine, then the fixed settings, then the steps of the axes in their order.
struct PointConfiguration {
  gpu::GpuConfiguration gpu;
  gpu::RunSettings settings;
  std::optional<ImageSize> size;
  bool chosen_tile_memory = false;  // the study sets tilecore.memory_bytes
};
// `steps`: one per axis. Throws UsageError where the values do not fit each other.
PointConfiguration configure_point(const Study& study, const std::vector<std::uint32_t>& steps);

}  // namespace tessera::replay

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

// A range of which samples and searches take any number, not steps.
struct OpenRange {
  double from = 0, to = 0;
  bool logarithmic = false;  // equal factors are equally likely, not equal differences
  bool whole = false;        // whole numbers alone; the ends are as likely as any other

  // `at`: in [0, 1). Six digits at most, so that people can read them.
  double value(double at) const;
};

// One dimension of a design space: keys that are set together, and the values that they take.
struct StudyAxis {
  std::vector<std::string> keys;
  std::vector<std::vector<nlohmann::json>> values;  // of each step along the axis: one value per key
  std::optional<OpenRange> range;                   // values are its ends, then those taken so far
  std::map<double, std::uint32_t> taken;            // of a range: steps by their numbers
  std::vector<std::string> key_notes;               // on keys that go by a former name

  // The step of a coordinate in [0, 1): of a list, all values have equal parts; of a range, the value becomes a step.
  std::uint32_t step_at(double coordinate);
};

// "sample": so many points all over the axes.
struct Sample {
  SampleMethod method = SampleMethod::kLatinHypercube;
  std::size_t points = 0;
  std::uint64_t seed = 0;
};

// "goal": which point is best by a column (goal.h): of all combinations, or with "points" of a search.
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
  std::vector<std::string> capture_names;       // as written in the file
  std::vector<std::filesystem::path> captures;  // the same, found from the folder of the file
  std::optional<std::string> variant;           // of all captures: scene::CaptureLimits::variant
  ViewChoices view;                             // of all captures
  std::optional<FrameRange> frames;             // else those of each capture
  std::optional<ImageSize> size;                // else that of each capture
  std::string gpu = "mid-mobile";               // preset, or a file found from the folder of the study
  std::vector<std::pair<std::string, nlohmann::json>> settings;
  std::vector<StudyAxis> axes;
  std::vector<std::string> key_notes;  // on keys of settings and axes that go by a former name
  std::optional<Sample> sample;
  std::optional<Goal> goal;
  // With either: the steps of each point along the axes, for each capture; a search adds to them. Else all combinations.
  std::vector<std::vector<std::uint32_t>> chosen;
  std::vector<std::string> columns;  // in the order wanted, patterns resolved
  std::vector<std::string> kept;     // those of them that tables have also where they are 0 all over
  bool baselines = false;            // whether a column or the file asks for them
  bool images = false;               // keep the image and the tile maps of every frame
  bool records = false;              // keep what frames of any timing are timed from
  std::vector<Split> splits;         // of every frame, in split.csv
  std::uint64_t point_count = 0;     // captures times steps of all axes, or times the points wanted: of a goal, at most

  bool searches() const { return goal && goal->points > 0; }
  bool is_grid() const { return !sample && !searches(); }
  // Keys of all axes, in order.
  std::vector<std::string> axis_keys() const;
  std::vector<std::string> split_names() const;
};

// Keys of an axis besides those of set_key(): the preset or file of the machine, and the image's size.
inline constexpr const char* kGpuKey = "gpu";
inline constexpr const char* kSizeKey = "size";

// Throws InputError (file, JSON pointer, what is wrong; unknown names with the nearest known one), and LimitError
// before anything is made of a study, or of a range in it, with more than `max_points` points.
Study read_study(const std::filesystem::path& file, std::uint64_t max_points);
// The same of a document that is in no file; names are found from the folder of `file`.
Study parse_study(const nlohmann::json& root, const std::filesystem::path& file, std::uint64_t max_points);

// The machine of a value of kGpuKey.
gpu::GpuConfiguration load_axis_gpu(const Study& study, const nlohmann::json& value);

// The files that describe machines of a study.
std::vector<std::filesystem::path> machine_files(const Study& study);

// What one point runs with: the machine, then the fixed settings, then the steps of the axes in their order.
struct PointConfiguration {
  gpu::GpuConfiguration gpu;
  gpu::RunSettings settings;
  std::optional<ImageSize> size;
  bool chosen_tile_memory = false;  // the study sets tilecore.memory_bytes
};
// `steps`: one per axis. Throws UsageError where the values do not fit each other.
PointConfiguration configure_point(const Study& study, const std::vector<std::uint32_t>& steps);

}  // namespace tessera::replay

#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "gpu/configuration.h"
#include "gpu/settings.h"
#include "replay/option_numbers.h"
#include "replay/time_split.h"
#include "replay/view_options.h"

namespace tessera::replay {

// One dimension of a design space: keys that are set together, and the values that they take.
struct StudyAxis {
  std::vector<std::string> keys;
  std::vector<std::vector<nlohmann::json>> values;  // of each step along the axis: one value per key
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
  std::vector<std::string> columns;  // in the order wanted, patterns resolved
  bool baselines = false;            // whether a column or the file asks for them
  bool images = false;               // keep the image and the tile maps of every frame
  std::vector<Split> splits;         // of every frame, in split.csv
  std::uint64_t point_count = 0;     // captures times steps of all axes

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

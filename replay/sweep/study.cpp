#include "replay/sweep/study.h"

#include <algorithm>
#include <iterator>
#include <set>

#include <fmt/format.h>

#include "base/error.h"
#include "base/former_keys.h"
#include "base/text.h"
#include "base/whole_file.h"
#include "gpu/presets.h"
#include "gpu/relative_value.h"
#include "gpu/tile_memory.h"
#include "replay/sweep/axis_values.h"
#include "replay/sweep/columns.h"
#include "replay/sweep/goal.h"
#include "scene/gltf/json_reader.h"
#include "scene/gltf/place.h"

namespace tessera::replay {
namespace {

using nlohmann::json;
using scene::gltf::Place;
namespace fs = std::filesystem;

const std::vector<std::string> kMembers = {"$schema",   "title",     "captures", "frames",  "size",    "gpu",
                                           "settings",  "axes",      "sample",   "goal",    "columns", "zero_columns",
                                           "baselines", "pictures",  "split",    "variant", "records", "scene",
                                           "camera",    "animation", "orbit",    "lens",    "shutter"};

const std::string& text_of(const json& value, const Place& place) {
  if (!value.is_string()) place.refuse("is not a text");
  return value.get_ref<const std::string&>();
}

bool flag_of(const json& value, const Place& place) {
  if (!value.is_boolean()) place.refuse("is neither true nor false");
  return value.get<bool>();
}

// Runs `parse` and turns its error into an error at the place.
template <class Parse>
auto at_place(const Place& place, const Parse& parse) {
  try {
    return parse();
  } catch (const UsageError& error) {
    place.refuse("{}", error.what());
  }
}

fs::path beside(const fs::path& study, const std::string& name) {
  const fs::path path(name);
  return path.is_absolute() ? path : study.parent_path() / path;
}

// A preset's name stays; anything else is a file, found from the folder of the study.
std::string find_gpu(const fs::path& study, const std::string& name) {
  return gpu::find_preset(name) != nullptr ? name : beside(study, name).string();
}

// Checks one value by setting it on a machine of its own.
void check_value(const Study& study, const std::string& key, const json& value, const Place& place) {
  at_place(place, [&] {
    if (key == kSizeKey) {
      parse_size("size", text_of(value, place));
    } else if (key == kGpuKey) {
      gpu::load_gpu(find_gpu(study.file, text_of(value, place)));
    } else {
      gpu::RunSettings settings;
      // A relative value refers to the machine of the study; the points check it for the machines of an axis.
      gpu::GpuConfiguration gpu = gpu::is_relative(value) ? gpu::load_gpu(study.gpu) : gpu::GpuConfiguration();
      gpu::set_key(key, value, settings, gpu);
    }
    return 0;
  });
}

void read_captures(const json& value, const Place& place, Study& study) {
  if (!value.is_array() || value.empty()) place.refuse("is not a list of captures");
  std::set<std::string> seen;
  for (std::size_t i = 0; i < value.size(); ++i) {
    const std::string& name = text_of(value[i], place.at(i));
    if (!seen.insert(name).second) place.at(i).refuse("is there twice");
    study.capture_names.push_back(name);
    study.captures.push_back(beside(study.file, name));
    std::error_code ignored;
    if (!fs::is_regular_file(study.captures.back(), ignored))
      place.at(i).refuse("no such file: {}", escape_control(study.captures.back().string()));
  }
}

void read_settings(const json& value, const Place& place, Study& study) {
  if (!value.is_object()) place.refuse("is not an object of keys and values");
  for (const auto& [key, setting] : value.items()) {
    if (key == kSizeKey || key == kGpuKey) place.at(key).refuse("is a member of the study itself, not a setting");
    check_value(study, key, setting, place.at(key));
    if (const FormerKey* former = find_former_key(key)) study.key_notes.push_back(former_key_note(*former));
    study.settings.emplace_back(current_key(key), setting);
  }
}

void read_axes(const json& value, const Place& place, std::uint64_t max_points, Study& study) {
  if (!value.is_array()) place.refuse("is not a list of axes");
  std::set<std::string> taken;
  for (const auto& [key, setting] : study.settings) taken.insert(key);
  for (std::size_t i = 0; i < value.size(); ++i) {
    const Place axis_place = place.at(i);
    StudyAxis axis = read_axis(value[i], axis_place, max_points, !study.is_grid());
    std::ranges::copy(axis.key_notes, std::back_inserter(study.key_notes));
    for (const std::string& key : axis.keys)
      if (!taken.insert(key).second)
        axis_place.refuse("'{}' is set by the study or by another axis already", escape_control(key, 80));
    for (std::size_t v = 0; v < axis.values.size(); ++v)
      for (std::size_t k = 0; k < axis.keys.size(); ++k)
        check_value(study, axis.keys[k], axis.values[v][k],
                    axis.range ? axis_place.at("range").at(v == 0 ? "from" : "to") : axis_place.at("values").at(v));
    if (!study.is_grid()) {
      study.axes.push_back(std::move(axis));
      continue;
    }
    // The whole product is known before any of it is made.
    if (axis.values.size() > max_points / study.point_count)
      throw LimitError(
          fmt::format("{}: the study has more than {} points (--max-points)", study.file.string(), max_points));
    study.point_count *= axis.values.size();
    study.axes.push_back(std::move(axis));
  }
}

void read_splits(const json& value, const Place& place, Study& study) {
  if (!value.is_array() || value.empty()) place.refuse("is not a list of drawables, materials, tiles");
  for (std::size_t i = 0; i < value.size(); ++i) {
    const Split split = at_place(place.at(i), [&] { return parse_split("split", text_of(value[i], place.at(i))); });
    if (std::find(study.splits.begin(), study.splits.end(), split) != study.splits.end())
      place.at(i).refuse("is there twice");
    study.splits.push_back(split);
  }
}

// Chooses the points; the axes are there.
void take_samples(const Place& place, Study& study) {
  if (study.axes.empty()) place.refuse("a study without axes has one point for each capture");
  for (const std::vector<double>& at :
       unit_samples(study.sample->method, study.sample->points, study.axes.size(), study.sample->seed)) {
    std::vector<std::uint32_t>& steps = study.chosen.emplace_back();
    for (std::size_t a = 0; a < study.axes.size(); ++a) steps.push_back(study.axes[a].step_at(at[a]));
  }
}

// A study whose points are chosen has so many of them for each capture.
void count_chosen(std::size_t points, std::uint64_t max_points, Study& study) {
  if (points > max_points / study.captures.size())
    throw LimitError(
        fmt::format("{}: the study has more than {} points (--max-points)", study.file.string(), max_points));
  study.point_count = points * study.captures.size();
}

json read_document(const fs::path& file) {
  constexpr std::uint64_t kMaxBytes = 64u << 20;
  const std::vector<std::uint8_t> bytes = read_whole_file(file, kMaxBytes, file.string());
  scene::MemoryBudget budget(1u << 30, file.string());
  return scene::gltf::read_json(std::string(bytes.begin(), bytes.end()), 0, file.string(), budget);
}

}  // namespace

std::vector<std::string> Study::axis_keys() const {
  std::vector<std::string> keys;
  for (const StudyAxis& axis : axes) keys.insert(keys.end(), axis.keys.begin(), axis.keys.end());
  return keys;
}

std::vector<std::string> Study::split_names() const {
  std::vector<std::string> names;
  for (const Split split : splits) names.emplace_back(name(split));
  return names;
}

Study read_study(const fs::path& file, std::uint64_t max_points) {
  return parse_study(read_document(file), file, max_points);
}

Study parse_study(const json& root, const fs::path& file, std::uint64_t max_points) {
  const Place place(file.string());
  if (!root.is_object()) place.refuse("a study is a JSON object");
  for (const auto& [name, value] : root.items())
    if (std::find(kMembers.begin(), kMembers.end(), name) == kMembers.end())
      place.at(name).refuse("{}", unknown_key_message(name, kMembers));
  if (!root.contains("captures")) place.refuse("lacks 'captures'");

  Study study;
  study.file = file;
  const auto with = [&](const char* name, const auto& read) {
    if (const auto at = root.find(name); at != root.end()) read(*at, place.at(name));
  };
  with("title", [&](const json& value, const Place& where) { study.title = text_of(value, where); });
  with("captures", [&](const json& value, const Place& where) { read_captures(value, where, study); });
  with("variant", [&](const json& value, const Place& where) { study.variant = text_of(value, where); });
  for (const auto& [name, word] : {std::pair{"scene", &study.view.selection.scene},
                                   {"camera", &study.view.selection.camera},
                                   {"animation", &study.view.selection.animation},
                                   {"orbit", &study.view.orbit},
                                   {"lens", &study.view.lens},
                                   {"shutter", &study.view.shutter}})
    with(name, [&, word = word](const json& value, const Place& where) {
      *word = text_of(value, where);
      at_place(where, [&] { return study.view.check(), 0; });
    });
  with("frames", [&](const json& value, const Place& where) {
    study.frames = at_place(where, [&] { return parse_frames("frames", text_of(value, where)); });
  });
  with("size", [&](const json& value, const Place& where) {
    study.size = at_place(where, [&] { return parse_size("size", text_of(value, where)); });
  });
  with("gpu", [&](const json& value, const Place& where) {
    check_value(study, kGpuKey, value, where);
    study.gpu = find_gpu(file, value.get<std::string>());
  });
  with("settings", [&](const json& value, const Place& where) { read_settings(value, where, study); });
  study.point_count = study.captures.size();
  if (study.point_count > max_points)
    throw LimitError(fmt::format("{}: the study has more than {} points (--max-points)", file.string(), max_points));
  with("sample", [&](const json& value, const Place& where) { study.sample = read_sample(value, where); });
  with("goal", [&](const json& value, const Place& where) { study.goal = read_goal(value, where); });
  if (study.sample && study.goal) place.refuse("has either a 'sample' or a 'goal'");
  if (study.sample) count_chosen(study.sample->points, max_points, study);
  if (study.searches()) count_chosen(study.goal->points, max_points, study);
  with("axes", [&](const json& value, const Place& where) { read_axes(value, where, max_points, study); });
  if (study.sample) take_samples(place.at("sample"), study);
  if (study.goal) check_axes_of_goal(place.at("goal"), study);
  with("records", [&](const json& value, const Place& where) { study.records = flag_of(value, where); });
  with("pictures", [&](const json& value, const Place& where) { study.images = flag_of(value, where); });
  with("baselines", [&](const json& value, const Place& where) { study.baselines = flag_of(value, where); });
  with("split", [&](const json& value, const Place& where) { read_splits(value, where, study); });
  study.columns = default_columns(study.baselines);
  with("columns", [&](const json& value, const Place& where) {
    study.columns = read_columns(value, where);
    study.kept = written_out(value);
  });
  if (study.goal) add_columns_of_goal(study);
  with("zero_columns", [&](const json& value, const Place& where) {
    if (flag_of(value, where)) study.kept = study.columns;
  });
  with("$schema", [&](const json& value, const Place& where) { text_of(value, where); });
  study.baselines = study.baselines || std::any_of(study.columns.begin(), study.columns.end(), needs_baselines);
  return study;
}

gpu::GpuConfiguration load_axis_gpu(const Study& study, const json& value) {
  return gpu::load_gpu(find_gpu(study.file, value.get<std::string>()));
}

std::vector<std::filesystem::path> machine_files(const Study& study) {
  std::vector<std::filesystem::path> files = {study.gpu};
  for (const StudyAxis& axis : study.axes)
    for (std::size_t k = 0; k < axis.keys.size(); ++k)
      if (axis.keys[k] == kGpuKey)
        for (const std::vector<json>& step : axis.values)
          files.emplace_back(find_gpu(study.file, step[k].get<std::string>()));
  return files;
}

PointConfiguration configure_point(const Study& study, const std::vector<std::uint32_t>& steps) {
  PointConfiguration point;
  point.size = study.size;
  std::string gpu = study.gpu;
  std::vector<std::pair<const std::string*, const json*>> values;
  for (const auto& [key, value] : study.settings) values.emplace_back(&key, &value);
  for (std::size_t a = 0; a < study.axes.size(); ++a)
    for (std::size_t k = 0; k < study.axes[a].keys.size(); ++k) {
      const std::string& key = study.axes[a].keys[k];
      const json& value = study.axes[a].values[steps[a]][k];
      if (key == kGpuKey)
        gpu = find_gpu(study.file, value.get<std::string>());
      else if (key == kSizeKey)
        point.size = parse_size("size", value.get<std::string>());
      else
        values.emplace_back(&key, &value);
    }
  point.gpu = gpu::load_gpu(gpu);
  for (const auto& [key, value] : values) {
    gpu::set_key(*key, *value, point.settings, point.gpu);
    if (*key == "tilecore.memory_bytes") point.chosen_tile_memory = true;
  }
  // A point that has chosen too little is not measured (expand_points).
  if (!point.chosen_tile_memory) gpu::grow_tile_memory(point.gpu, point.settings);
  return point;
}

}  // namespace tessera::replay

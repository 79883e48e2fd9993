#include "replay/sweep/points.h"

#include <algorithm>
#include <map>
#include <optional>

#include <fmt/format.h>

#include "base/error.h"
#include "base/json_text.h"
#include "base/sha256.h"
#include "base/whole_file.h"
#include "gpu/record_file.h"
#include "gpu/tile_memory.h"
#include "replay/sweep/capture_library.h"

namespace tessera::replay {
namespace {

using nlohmann::json;

// Inputs of a render, besides the machine and the settings. nlohmann sorts the keys, so the text is canonical.
json common_inputs(const Study& study, const PointConfiguration& configuration, const std::string& capture_hash,
                   const std::string& program) {
  json inputs = {{"schema", kPointSchema},      {"program", program}, {"capture", capture_hash},
                 {"frames", nullptr},           {"size", nullptr},    {"baselines", study.baselines},
                 {"split", study.split_names()}};
  if (study.variant) inputs["variant"] = *study.variant;
  if (!study.view.empty()) inputs["view"] = study.view.json();
  if (study.frames) inputs["frames"] = {study.frames->first, study.frames->last};
  if (configuration.size) inputs["size"] = {configuration.size->width, configuration.size->height};
  return inputs;
}

constexpr const char* kTimingKey = "machine.timing";

bool times_events(const gpu::GpuConfiguration& gpu) { return gpu.queues.model == hardware::TimingModel::kEvents; }

bool next_steps(const Study& study, std::vector<std::uint32_t>& steps) {
  for (std::size_t a = steps.size(); a-- > 0;) {
    if (++steps[a] < study.axes[a].values.size()) return true;
    steps[a] = 0;
  }
  return false;
}

}  // namespace

PointMaker::PointMaker(const Study& study, std::string program) : study_(study), program_(std::move(program)) {
  for (const std::filesystem::path& file : study.captures) captures_.push_back(capture_fingerprint(file));
  items_ = needs_items(study);
}

SweepPoint PointMaker::make(std::size_t capture, const std::vector<std::uint32_t>& steps) const {
  SweepPoint point{capture, steps, "", "", ""};
  std::optional<PointConfiguration> configuration;
  try {
    configuration = configure_point(study_, steps);
    gpu::check_gpu(configuration->gpu);
    if (configuration->chosen_tile_memory) gpu::check_tile_memory(configuration->gpu, configuration->settings);
  } catch (const Error& error) {
    point.fault = error.what();
  }
  const PointConfiguration none;
  const PointConfiguration& made = configuration ? *configuration : none;
  json inputs = common_inputs(study_, made, captures_[capture], program_);
  json function = inputs;
  inputs["pictures"] = study_.images;
  inputs["gpu"] = gpu::gpu_json(made.gpu);
  inputs["settings"] = gpu::settings_json(made.settings);
  // A point without a valid machine is identified by its requested values.
  if (!configuration) inputs["values"] = point_values(study_, point);
  point.hash = sha256_name(json_text(inputs));
  function["function"] = gpu::functional_json(made.gpu, made.settings);
  function["items"] = items_;
  const bool alone = study_.baselines || !point.fault.empty();
  point.function = alone ? point.hash : sha256_name(json_text(function));
  return point;
}

std::vector<SweepPoint> expand_points(const Study& study, const std::string& program) {
  std::vector<SweepPoint> points;
  const PointMaker maker(study, program);
  for (std::size_t c = 0; c < study.captures.size(); ++c) {
    if (!study.is_grid()) {
      for (const std::vector<std::uint32_t>& steps : study.chosen) points.push_back(maker.make(c, steps));
      continue;
    }
    std::vector<std::uint32_t> steps(study.axes.size(), 0);
    do points.push_back(maker.make(c, steps));
    while (next_steps(study, steps));
  }
  return points;
}

std::vector<std::vector<std::size_t>> render_groups(const std::vector<SweepPoint>& points) {
  std::map<std::string, std::size_t> group_of;
  std::vector<std::vector<std::size_t>> groups;
  for (std::size_t p = 0; p < points.size(); ++p) {
    const auto [at, fresh] = group_of.try_emplace(points[p].function, groups.size());
    if (fresh) groups.emplace_back();
    groups[at->second].push_back(p);
  }
  return groups;
}

std::vector<std::size_t> points_of_shard(const std::vector<SweepPoint>& points, std::size_t shard, std::size_t shards) {
  const std::vector<std::vector<std::size_t>> groups = render_groups(points);
  const std::size_t parts = std::max<std::size_t>(1, shards / std::max<std::size_t>(1, groups.size()));
  std::vector<std::size_t> mine;
  for (std::size_t g = 0; g < groups.size(); ++g)
    for (std::size_t part = 0; part < parts; ++part) {
      if ((g * parts + part) % shards != shard) continue;
      const std::size_t first = groups[g].size() * part / parts, last = groups[g].size() * (part + 1) / parts;
      mine.insert(mine.end(), groups[g].begin() + static_cast<std::ptrdiff_t>(first),
                  groups[g].begin() + static_cast<std::ptrdiff_t>(last));
    }
  std::sort(mine.begin(), mine.end());
  return mine;
}

bool needs_items(const Study& study) {
  if (!study.splits.empty()) return true;
  const auto says_events = [](const json& value) {
    gpu::GpuConfiguration gpu;
    gpu::set_gpu_key(std::string(kTimingKey), value, gpu);
    return times_events(gpu);
  };
  for (const StudyAxis& axis : study.axes)
    for (std::size_t k = 0; k < axis.keys.size(); ++k)
      for (const std::vector<json>& values : axis.values)
        if ((axis.keys[k] == kTimingKey && says_events(values[k])) ||
            (axis.keys[k] == kGpuKey && times_events(load_axis_gpu(study, values[k]))))
          return true;
  for (const auto& [key, value] : study.settings)
    if (key == kTimingKey) return says_events(value);
  return times_events(gpu::load_gpu(study.gpu));
}

bool varies_in_timing(const Study& study) {
  const std::vector<std::string> keys = study.axis_keys();
  return std::any_of(keys.begin(), keys.end(), [](const std::string& name) {
    const auto* key = gpu::gpu_keys().find(name);
    // Other units of a key of the memory (gpu::set_gpu_key()) are no rows of the table.
    return key != nullptr ? key->timing : name == kGpuKey || name.starts_with("memory.");
  });
}

std::vector<json> point_values(const Study& study, const SweepPoint& point) {
  std::vector<json> values;
  for (std::size_t a = 0; a < study.axes.size(); ++a)
    for (const json& value : study.axes[a].values[point.steps[a]]) values.push_back(value);
  return values;
}

std::string point_label(const Study& study, const SweepPoint& point) {
  std::string label = study.captures.size() > 1 ? study.capture_names[point.capture] : "";
  const std::vector<std::string> keys = study.axis_keys();
  const std::vector<json> values = point_values(study, point);
  for (std::size_t k = 0; k < keys.size(); ++k)
    label += fmt::format("{}{}={}", label.empty() ? "" : " ", keys[k],
                         values[k].is_string() ? values[k].get<std::string>() : values[k].dump());
  return label.empty() ? study.capture_names[point.capture] : label;
}

std::string program_fingerprint() {
  constexpr std::uint64_t kMaxBytes = 4ull << 30;
  Sha256 hash;
  hash.add(read_whole_file("/proc/self/exe", kMaxBytes, "the program"));
  return hash.finish();
}

}  // namespace tessera::replay

#include "replay/sweep/points.h"

#include <map>

#include <fmt/format.h>

#include "base/error.h"
#include "base/json_text.h"
#include "base/sha256.h"
#include "base/whole_file.h"
#include "gpu/focus_track.h"
#include "gpu/tile_memory.h"
#include "replay/sweep/capture_library.h"

namespace tessera::replay {
namespace {

using nlohmann::json;

// The bytes of a file that settings name, once for all points.
class FileHashes {
 public:
  const std::string& of(const std::string& file) {
    const auto [at, is_new] = known_.try_emplace(file);
    if (is_new) {
      Sha256 hash;
      hash.add(read_whole_file(file, gpu::FocusTrack::kMaxBytes, file));
      at->second = hash.finish();
    }
    return at->second;
  }

 private:
  std::map<std::string, std::string> known_;
};

// Everything that a point's result follows from. nlohmann sorts the keys, so the text is canonical.
json point_inputs(const Study& study, const PointConfiguration& configuration, const std::string& capture_hash,
                  const std::string& program, const std::string& track_hash) {
  json inputs = {{"schema", kPointSchema},   {"program", program},
                 {"capture", capture_hash},  {"frames", nullptr},
                 {"size", nullptr},          {"baselines", study.baselines},
                 {"pictures", study.images}, {"split", study.split_names()}};
  if (study.variant) inputs["variant"] = *study.variant;
  if (!study.view.empty()) inputs["view"] = study.view.json();
  if (study.frames) inputs["frames"] = {study.frames->first, study.frames->last};
  if (configuration.size) inputs["size"] = {configuration.size->width, configuration.size->height};
  inputs["gpu"] = gpu::gpu_json(configuration.gpu);
  inputs["settings"] = gpu::settings_json(configuration.settings);
  // What a file holds, not where it is.
  if (!track_hash.empty()) inputs["settings"]["resolve.focus_track"] = track_hash;
  return inputs;
}

bool next_steps(const Study& study, std::vector<std::uint32_t>& steps) {
  for (std::size_t a = steps.size(); a-- > 0;) {
    if (++steps[a] < study.axes[a].values.size()) return true;
    steps[a] = 0;
  }
  return false;
}

}  // namespace

std::vector<SweepPoint> expand_points(const Study& study, const std::string& program) {
  std::vector<SweepPoint> points;
  points.reserve(study.point_count);
  FileHashes files;
  for (std::size_t c = 0; c < study.captures.size(); ++c) {
    const std::string capture_hash = capture_fingerprint(study.captures[c]);
    std::vector<std::uint32_t> steps(study.axes.size(), 0);
    do {
      SweepPoint point{c, steps, "", ""};
      const PointConfiguration configuration = configure_point(study, steps);
      std::string track_hash;
      try {
        const std::string& track = configuration.settings.resolve.foveation.focus_track;
        if (!track.empty()) track_hash = files.of(track);
        gpu::check_gpu(configuration.gpu);
        if (configuration.chosen_tile_memory) gpu::check_tile_memory(configuration.gpu, configuration.settings);
      } catch (const Error& error) {
        point.fault = error.what();
      }
      point.hash = sha256_name(json_text(point_inputs(study, configuration, capture_hash, program, track_hash)));
      points.push_back(std::move(point));
    } while (next_steps(study, steps));
  }
  return points;
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

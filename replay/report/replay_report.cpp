#include <algorithm>
#include <fstream>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/error.h"
#include "base/json_text.h"
#include "replay/compare/causes.h"
#include "replay/frame_files.h"
#include "replay/report/report.h"

namespace tessera::replay {

using nlohmann::json;
namespace fs = std::filesystem;

namespace {

// The statistics of a replay, with no more than kMaxFrames of its frames: memory does not grow with them.
struct ReplayStatistics {
  json stats;
  std::vector<int> numbers;  // of all frames
  std::size_t stride = 1;    // frames 0, stride, 2 stride, ... are in `stats`
};

// The stride is a power of two that is known only at the end: frames kept before it grew are thinned out then.
ReplayStatistics read_statistics(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw InputError(file.string(), "", "cannot be opened");
  ReplayStatistics out;
  std::vector<std::size_t> kept;
  bool sound = true;
  out.stats = parse_json_array(stream, file.string(), "frames", [&](const json& frame) {
    const std::size_t index = out.numbers.size();
    const auto number = frame.find("frame");
    sound = sound && number != frame.end() && number->is_number_integer();
    out.numbers.push_back(sound ? whole_number(*number) : 0);
    while (index >= kMaxFrames * out.stride) out.stride *= 2;
    if (index % out.stride != 0) return false;
    kept.push_back(index);
    return true;
  });
  if (out.stats.value("schema", "") != "tessera.stats/1")
    throw InputError(file.string(), "/schema", "is not tessera.stats/1");
  json& frames = out.stats.at("frames");
  if (!frames.is_array() || frames.empty()) throw InputError(file.string(), "/frames", "holds no frame");
  if (!sound || frames.size() != kept.size())
    throw InputError(file.string(), "/frames", "holds an element that is no frame");
  json thinned = json::array();
  for (std::size_t k = 0; k < kept.size(); ++k)
    if (kept[k] % out.stride == 0) thinned.push_back(std::move(frames.at(k)));
  frames = std::move(thinned);
  return out;
}

// A replay of the page: {"label", "stats", "views": by frame}.
json run_of(const fs::path& folder, PageViews& views, std::string& subtitle) {
  ReplayStatistics statistics = read_statistics(folder / "stats.json");
  json& stats = statistics.stats;
  const std::vector<int>& numbers = statistics.numbers;
  const json& region = stats.at("settings").at("region");
  json shown = json::array();
  for (std::size_t f = 0; f < numbers.size(); f += statistics.stride)
    shown.push_back(views.add(folder / (frame_name(numbers[f]) + ".png"), folder / tile_maps_name(numbers[f]),
                              whole_number(region.at(0)), whole_number(region.at(1))));
  subtitle =
      fmt::format("{}x{}, {} frame{}{}, machine '{}'", whole_number(stats.at("settings").at("width")),
                  whole_number(stats.at("settings").at("height")), numbers.size(), numbers.size() == 1 ? "" : "s",
                  statistics.stride == 1 ? "" : fmt::format(" (every {}th shown)", statistics.stride),
                  stats.at("gpu").at("preset").get<std::string>());
  return {{"label", fs::absolute(folder).lexically_normal().filename().string()},
          {"stats", std::move(stats)},
          {"views", std::move(shown)}};
}

// Statistics of the frames that the page has.
RunStatistics statistics_of(const fs::path& folder, const json& stats) {
  RunStatistics run{folder / "stats.json", stats, {}};
  for (const json& frame : stats.at("frames")) run.frames.push_back(whole_number(frame.at("frame")));
  return run;
}

// By run: the explanation of its difference from the first run, for a page of several runs.
json why_runs(const std::vector<RunStatistics>& runs) {
  json out = json::array({nullptr});
  const Comparison comparison = compare_statistics(runs);
  for (std::size_t r = 1; r < runs.size(); ++r) out.push_back(cause_json(causes_of(comparison, r)));
  return out;
}

// Why the slowest frame of a run takes longer than the one of median time: {"frame", "median", "why"}; null where no frame
// takes longer than another.
json why_slowest(const RunStatistics& run) {
  std::vector<std::pair<double, int>> times;
  for (const json& frame : run.root.at("frames"))
    if (const json::json_pointer cycles("/timing/cycles"); frame.contains(cycles))
      times.emplace_back(frame.at(cycles).get<double>(), whole_number(frame.at("frame")));
  if (times.size() < 2) return nullptr;
  const int slowest = std::max_element(times.begin(), times.end(), [](const auto& a, const auto& b) {
                        return a.first < b.first;
                      })->second;
  const auto median = times.begin() + static_cast<std::ptrdiff_t>((times.size() - 1) / 2);
  std::nth_element(times.begin(), median, times.end());
  if (median->second == slowest) return nullptr;
  const Comparison comparison = compare_statistics({run, run}, {median->second, slowest});
  return {{"frame", slowest}, {"median", median->second}, {"why", cause_json(causes_of(comparison, 1))}};
}

}  // namespace

json replay_report(const std::vector<fs::path>& folders, PageViews& views, std::string&) {
  json runs = json::array();
  std::vector<RunStatistics> compared;
  std::string title, subtitle;
  for (const fs::path& folder : folders) {
    std::string of_run;
    try {
      runs.push_back(run_of(folder, views, of_run));
      compared.push_back(statistics_of(folder, runs.back().at("stats")));
      const std::string capture = runs.back().at("stats").at("capture").at("file");
      if (title.find(capture) == std::string::npos) title += (title.empty() ? "" : ", ") + capture;
    } catch (const json::exception& error) {
      throw InputError((folder / "stats.json").string(), "",
                       fmt::format("does not match the output of a replay: {}", error.what()));
    }
    json& label = runs.back()["label"];
    if (label.is_string() && label.get_ref<const std::string&>().empty()) label = folder.string();
    subtitle += subtitle.empty() ? of_run : "; " + of_run;
  }
  json slowest = json::array();
  for (const RunStatistics& run : compared) slowest.push_back(why_slowest(run));
  return {{"why_runs", why_runs(compared)},
          {"why_slowest", std::move(slowest)},
          {"title", title + (folders.size() > 1 ? ": replays side by side" : ": replay")},
          {"subtitle", subtitle},
          {"runs", std::move(runs)}};
}

}  // namespace tessera::replay

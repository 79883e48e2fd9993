#include "replay/sweep/sweep_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <map>
#include <set>

#include <fmt/format.h>

#include "base/atomic_file.h"
#include "base/error.h"
#include "base/json_text.h"
#include "base/whole_file.h"
#include "replay/sweep/columns.h"
#include "replay/sweep/goal.h"
#include "replay/time_split.h"

namespace tessera::replay {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// Configuration of the first point that a machine can have.
PointConfiguration first_configuration(const Study& study, const std::vector<SweepPoint>& points) {
  for (const SweepPoint& point : points)
    if (point.fault.empty()) return configure_point(study, point.steps);
  return {};
}

json manifest_json(const Study& study, const std::vector<SweepPoint>& points) {
  json list = json::array();
  for (const SweepPoint& point : points)
    list.push_back({{"hash", point.hash}, {"capture", point.capture}, {"values", point_values(study, point)}});
  json settings = json::object();
  for (const auto& [key, value] : study.settings) settings[key] = value;
  json out = {{"schema", "tessera.sweep/1"}, {"title", study.title},         {"captures", study.capture_names},
              {"axes", study.axis_keys()},   {"columns", study.columns},     {"kept", study.kept},
              {"settings", settings},        {"records", study.records},     {"baselines", study.baselines},
              {"pictures", study.images},    {"split", study.split_names()}, {"points", list}};
  // Configuration that all points share, except for the axes: the first point's.
  const PointConfiguration first = first_configuration(study, points);
  out["first_point"] = {{"gpu", gpu::gpu_json(first.gpu)}, {"settings", gpu::settings_json(first.settings)}};
  if (study.sample) out["sample"] = sample_json(*study.sample);
  if (study.goal) out["goal"] = goal_json(*study.goal);
  if (study.variant) out["variant"] = *study.variant;
  if (!study.view.empty()) out["view"] = study.view.json();
  if (study.frames) out["frames"] = {study.frames->first, study.frames->last};
  if (first.size) out["first_point"]["size"] = {first.size->width, first.size->height};
  return out;
}

// "point,hash,capture,AXES...", of the head and of a row.
std::string point_cells(const json& manifest) {
  std::string text = "point,hash,capture";
  for (const json& key : manifest.at("axes")) text += "," + key.get<std::string>();
  return text;
}
std::string point_cells(const json& manifest, std::size_t number) {
  const json& point = manifest.at("points").at(number);
  std::string text =
      fmt::format("{},{},{}", number, point.at("hash").get<std::string>(),
                  csv_cell(manifest.at("captures").at(static_cast<std::size_t>(whole_number(point.at("capture"))))));
  for (const json& value : point.at("values")) text += "," + csv_cell(value);
  return text;
}

// The rows of a frame's splits, each with `begin` in front.
std::string split_rows_csv(const json& frame, const std::string& begin) {
  std::string text;
  for (const auto& [split, views] : frame.at("split").items())
    for (std::size_t view = 0; view < views.size(); ++view)
      for (const json& row : views.at(view)) {
        text += fmt::format("{},{},{},{}", begin, frame.at("frame").dump(), view, split);
        for (const std::string_view column : split_columns()) text += "," + csv_cell(row.value(column, json()));
        text += "\n";
      }
  return text;
}

void remove_unfinished(const fs::path& folder) {
  std::error_code error;
  for (const fs::path& place : {folder, folder / "points"})
    for (fs::directory_iterator at(place, error), end; !error && at != end; at.increment(error)) {
      std::error_code ignored;
      if (at->path().extension() == ".part") fs::remove(at->path(), ignored);
    }
}

}  // namespace

fs::path SweepFolder::image_file(const std::string& hash, int frame) const {
  return points_.folder() / fmt::format("{}_{:04d}.png", hash, frame);
}
fs::path SweepFolder::tiles_file(const std::string& hash, int frame) const {
  return points_.folder() / fmt::format("{}_tiles_{:04d}.json", hash, frame);
}

fs::path SweepFolder::record_file(const std::string& function) const {
  return folder_ / "records" / (function + ".record");
}

bool SweepFolder::write_manifest(const Study& study, const std::vector<SweepPoint>& points) const {
  const std::string text = json_text(manifest_json(study, points), 1) + "\n";
  const fs::path file = folder_ / "sweep.json";
  std::error_code ignored;
  if (fs::exists(file, ignored) && read_whole_text(file) == text) return false;
  write_file_atomically(file, text);
  return true;
}

SweepLock::SweepLock(const SweepFolder& folder, bool shared) {
  make_folder(folder.path() / "points");
  descriptor_ = ::open((folder.path() / "points" / ".lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (descriptor_ < 0)
    throw WriteError(fmt::format("cannot write to {}: {}", folder.path().string(), std::strerror(errno)));
  if (::flock(descriptor_, LOCK_EX | LOCK_NB) == 0) {
    remove_unfinished(folder.path());
    if (shared) ::flock(descriptor_, LOCK_SH);
  } else if (errno == EWOULDBLOCK) {
    // Others are at work. Another shard may still be cleaning up, alone: wait for that.
    if (!shared || ::flock(descriptor_, LOCK_SH) != 0) {
      ::close(descriptor_);
      throw WriteError(
          fmt::format("another sweep is at work in {}: wait for it, or choose another --out", folder.path().string()));
    }
  }
}

SweepLock::~SweepLock() { ::close(descriptor_); }

std::optional<json> SweepFolder::read_point(const std::string& hash) const {
  if (!has_point(hash)) return std::nullopt;
  const std::string file = point_file(hash).string();
  try {
    json result = parse_json(read_whole_text(file), file);
    if (result.at("schema") != kPointSchema) return std::nullopt;
    if (result.contains("fault")) {
      if (!result["fault"].is_string()) return std::nullopt;
    } else {
      for (const json& frame : result.at("frames")) {
        whole_number(frame.at("frame"));
        if (!frame.at("counters").is_object() || !frame.at("dram").is_array()) return std::nullopt;
        frame_values(frame);
        if (frame.contains("split")) split_rows_csv(frame, "");
      }
    }
    return result;
  } catch (const InputError&) {
    return std::nullopt;
  } catch (const json::exception&) {
    return std::nullopt;
  }
}

namespace {

bool says_nothing(const json& value) {
  return value == 0 || value == false || (value.is_string() && value.get_ref<const std::string&>().empty());
}

// Leaves out columns that are empty in every row, except for the ones of "kept" (older manifests keep all).
void drop_empty_columns(JoinedSweep& sweep) {
  if (!sweep.manifest.contains("kept")) return;
  std::set<std::string> kept;
  for (const json& name : sweep.manifest["kept"]) kept.insert(name.get<std::string>());
  for (const SweepRow& row : sweep.rows)
    if (row.frame.is_object())
      for (const auto& [name, value] : frame_values(row.frame))
        if (!says_nothing(value)) kept.insert(name);
  json columns = json::array();
  for (const json& name : sweep.manifest.at("columns"))
    if (kept.contains(name.get<std::string>())) columns.push_back(name);
  sweep.manifest["columns"] = columns;
}

}  // namespace

JoinedSweep join_sweep(const SweepFolder& folder) {
  JoinedSweep sweep;
  const std::string manifest = (folder.path() / "sweep.json").string();
  sweep.manifest = parse_json(read_whole_text(manifest), manifest);
  try {
    const json& points = sweep.manifest.at("points");
    for (std::size_t p = 0; p < points.size(); ++p) {
      const std::string hash = points[p].at("hash");
      const std::optional<json> result = folder.read_point(hash);
      if (!result)
        sweep.missing.push_back(p);
      else if (result->contains("fault"))
        sweep.rows.push_back({p, nullptr, (*result)["fault"].get<std::string>()});
      else
        for (const json& frame : (*result)["frames"]) sweep.rows.push_back({p, frame, "ok"});
    }
    drop_empty_columns(sweep);
  } catch (const json::exception& error) {
    throw InputError(manifest, "", fmt::format("is not the manifest of a sweep: {}", error.what()));
  }
  return sweep;
}

std::string sweep_csv(const JoinedSweep& sweep) {
  const json& manifest = sweep.manifest;
  std::string text = point_cells(manifest) + ",frame,status";
  for (const json& column : manifest.at("columns")) text += "," + column.get<std::string>();
  text += "\n";
  for (const SweepRow& row : sweep.rows) {
    text += point_cells(manifest, row.point);
    text += fmt::format(",{},{}", row.frame.is_null() ? "" : row.frame.at("frame").dump(), csv_cell(row.status));
    const std::map<std::string, json> values =
        row.frame.is_null() ? std::map<std::string, json>{} : frame_values(row.frame);
    for (const json& column : manifest.at("columns")) {
      const auto at = values.find(column.get<std::string>());
      text += "," + (at == values.end() ? "" : csv_cell(at->second));
    }
    text += "\n";
  }
  return text;
}

std::string split_csv(const JoinedSweep& sweep) {
  if (sweep.manifest.value("split", json::array()).empty()) return "";
  std::string text = point_cells(sweep.manifest) + ",frame,view,split";
  for (const std::string_view column : split_columns()) text += fmt::format(",{}", column);
  text += "\n";
  for (const SweepRow& row : sweep.rows)
    if (row.frame.is_object() && row.frame.contains("split"))
      text += split_rows_csv(row.frame, point_cells(sweep.manifest, row.point));
  return text;
}

Goal goal_of(const json& manifest) {
  if (manifest.contains("goal")) return read_goal(manifest["goal"], scene::gltf::Place("sweep.json").at("goal"));
  Goal goal;
  // Cycles of machines with different clocks cannot be compared.
  const json& axes = manifest.at("axes");
  const bool clocks =
      std::any_of(axes.begin(), axes.end(), [](const json& key) { return key == "clock.mhz" || key == kGpuKey; });
  goal.column = clocks ? "timing.time_ms" : "timing.cycles";
  return goal;
}

namespace {

std::string label_of(const json& manifest, std::size_t point) {
  const json& values = manifest.at("points").at(point).at("values");
  std::string label;
  for (std::size_t k = 0; k < manifest.at("axes").size(); ++k)
    label += fmt::format("{}{}={}", k == 0 ? "" : " ", manifest.at("axes")[k].get<std::string>(),
                         values.at(k).is_string() ? values.at(k).get<std::string>() : values.at(k).dump());
  return label;
}

std::vector<double> means_of(const std::vector<std::string>& columns, const std::vector<json>& frames) {
  std::vector<double> means(columns.size(), 0);
  for (const json& frame : frames) {
    const std::map<std::string, json> values = frame_values(frame);
    for (std::size_t c = 0; c < columns.size(); ++c)
      if (const auto at = values.find(columns[c]); at != values.end() && at->second.is_number())
        means[c] += at->second.get<double>() / static_cast<double>(frames.size());
  }
  return means;
}

}  // namespace

std::vector<Candidate> rank_candidates(const JoinedSweep& sweep) {
  const json& manifest = sweep.manifest;
  const Goal goal = goal_of(manifest);
  std::map<std::string, std::size_t> first_of;
  std::map<std::size_t, std::vector<json>> frames_of;
  for (const SweepRow& row : sweep.rows) {
    const std::string values = manifest.at("points").at(row.point).at("values").dump();
    const std::size_t first = first_of.try_emplace(values, row.point).first->second;
    if (row.frame.is_object()) frames_of[first].push_back(row.frame);
  }
  std::vector<Candidate> candidates;
  for (const auto& [point, frames] : frames_of) {
    const Score score = score_of(goal, frames);
    if (std::isinf(score.violation)) continue;
    candidates.push_back({point, label_of(manifest, point), score, means_of(goal_columns(goal), frames)});
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.score.better_than(b.score); });
  return candidates;
}

void write_tables(const SweepFolder& folder, const JoinedSweep& sweep) {
  write_file_atomically(folder.path() / "sweep.csv", sweep_csv(sweep));
  const fs::path split = folder.path() / "split.csv";
  std::error_code ignored;
  if (const std::string text = split_csv(sweep); !text.empty())
    write_file_atomically(split, text);
  else
    fs::remove(split, ignored);  // of the study as it was
}

}  // namespace tessera::replay

#include "replay/statistics.h"

#include <algorithm>
#include <bit>

#include <fmt/format.h>

#include "base/atomic_file.h"
#include "base/json_text.h"
#include "base/simd_targets.h"
#include "gpu/counter_list.h"
#include "replay/machine_report.h"

namespace tessera::replay {
namespace {

using nlohmann::json;

json dram_json(const memory::Ledger& ledger) {
  json rows = json::array();
  for (const gpu::TrafficRow& row : gpu::traffic_rows(ledger))
    rows.push_back({{"unit", name(row.unit)},
                    {"purpose", name(row.purpose)},
                    {"read_bytes", row.traffic.read_bytes},
                    {"written_bytes", row.traffic.written_bytes}});
  return rows;
}

}  // namespace

json counters_json(const gpu::FrameCounters& counters) {
  json out = json::object();  // nlohmann sorts the keys
  for (const auto& [name, value] : gpu::counter_values(counters)) out[std::string(name)] = value;
  return out;
}

Statistics::Statistics(const scene::Capture& capture, const gpu::GpuConfiguration& gpu,
                       const gpu::RunSettings& settings, const gpu::RenderRequest& request) {
  head_["schema"] = "tessera.stats/1";
  head_["capture"] = {
      {"file", capture.file.filename().string()}, {"bytes", capture.file_bytes}, {"notices", capture.notices}};
  if (capture.variant != scene::kNone)
    head_["capture"]["variant"] = capture.variants[static_cast<std::size_t>(capture.variant)];
  head_["gpu"] = gpu::gpu_json(gpu);
  head_["gpu_notices"] = gpu.key_notes;
  head_["settings"] = settings_json(settings);
  head_["settings"]["width"] = request.width;
  head_["settings"]["height"] = request.height;
  head_["settings"]["region"] = {request.region.x0, request.region.y0, request.region.width(), request.region.height()};
}

json effect_places_json(const gpu::FrameEffectPlaces& places) {
  json out = json::object();
  for (const auto& [name, at] : places)
    out[name] = {{"sub_patches", at.sub_patches}, {"sub_patches_elided", at.sub_patches_elided}, {"tiles", at.tiles}};
  return out;
}

json frame_json(const gpu::FrameResult& frame, const baselines::BaselineSet* schemes) {
  json out = {{"frame", frame.frame},
              {"effects", frame.effects},
              {"effect_reasons", frame.effect_reasons},
              {"effect_places", effect_places_json(frame.effect_places)},
              {"counters", counters_json(frame.counters)},
              {"dram", dram_json(frame.counters.ledger)}};
  if (frame.model) {
    out["timing"] = timing_json(frame.model->timing);
    out["energy"] = energy_json(frame.model->energy);
    out["area"] = area_json(frame.model->area);
  }
  if (frame.right) out["right_eye"] = {{"counters", counters_json(frame.right->counters)}};
  if (schemes != nullptr) out["baselines"] = baselines_json(*schemes);
  return out;
}

void Statistics::set_host(double load, double decode, double assemble) {
  head_["host"]["stages"] = {{"load", load}, {"decode", decode}, {"assemble", assemble}};
}

void Statistics::add_gpu_notice(const std::string& notice) {
  if (!notice.empty()) head_["gpu_notices"].push_back(notice);
}

void Statistics::add(const gpu::FrameResult& frame, const baselines::BaselineSet* schemes, const FrameCosts* costs) {
  nlohmann::json stages = nlohmann::json::object();
  for (const auto& [stage, seconds] : frame.stage_seconds) stages[stage] = seconds;
  frames_.push_back(frame_json(frame, schemes));
  if (costs != nullptr) {
    frames_.back()["drawables"] = costs->drawables();
    frames_.back()["materials"] = costs->materials();
  }
  frames_.back()["host"] = {{"seconds", frame.seconds}, {"stages", stages}, {"simd", simd_target_name()}};
  if (frame.model) {
    if (!timing_) timing_.emplace();
    timing_->accumulate(frame.model->timing);
    energy_.accumulate(frame.model->energy);
    area_ = frames_.back()["area"];
  }
  if (schemes != nullptr) {
    baselines_.add(frame.frame, *schemes);
    has_baselines_ = true;
  }
  // Frames are much alike: looking at a few keeps this off the time of short ones.
  if (std::has_single_bit(frames_.size())) frame_bytes_ = std::max(frame_bytes_, json_text(frames_.back(), 1).size());
  total_.accumulate(frame.counters);
  total_seconds_ += frame.seconds;
}

std::uint64_t Statistics::bytes_at_most() const {
  // A frame in stats.json and its row in the CSV files; the whole is written beside what was there before.
  return (frames_.size() + 2) * (frame_bytes_ + frame_bytes_ / 2) + (std::uint64_t{256} << 10);
}

json Statistics::json() const {
  nlohmann::json out = head_;
  out["frames"] = frames_;
  out["total"] = {{"frames", frames_.size()},
                  {"counters", counters_json(total_)},
                  {"dram", dram_json(total_.ledger)},
                  {"host", {{"seconds", total_seconds_}}}};
  if (timing_) {
    out["total"]["timing"] = timing_json(*timing_);
    out["total"]["energy"] = energy_json(energy_);
    out["total"]["area"] = area_;
  }
  if (has_baselines_) out["total"]["baselines"] = baselines_json(baselines_.total());
  return out;
}

std::string Statistics::csv() const {
  std::string text = "frame,host_seconds";
  const nlohmann::json names = counters_json(total_);
  for (const auto& [counter, value] : names.items()) text += "," + counter;
  if (timing_) text += model_csv_header();
  text += "\n";
  for (const nlohmann::json& frame : frames_) {
    text += fmt::format("{},{:.6f}", frame["frame"].get<int>(), frame["host"]["seconds"].get<double>());
    // A unit that ran in another frame only leaves its columns empty here.
    for (const auto& [counter, value] : names.items()) {
      const auto found = frame["counters"].find(counter);
      text += found == frame["counters"].end() ? "," : fmt::format(",{}", found->get<std::uint64_t>());
    }
    if (frame.contains("timing")) text += model_csv(frame);
    text += "\n";
  }
  return text;
}

void Statistics::write(const std::filesystem::path& folder) const {
  write_file_atomically(folder / "stats.json", json_text(json(), 1) + "\n");
  write_file_atomically(folder / "stats.csv", csv());
  if (has_baselines_) baselines_.write(folder);
}

}  // namespace tessera::replay

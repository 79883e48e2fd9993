#include "replay/statistics.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/atomic_file.h"
#include "base/json_text.h"
#include "base/simd_targets.h"
#include "base/text.h"
#include "baselines/baseline_counters.h"
#include "gpu/counter_list.h"
#include "gpu/unread_keys.h"
#include "replay/baseline_verdict.h"
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

namespace {

// The value that `part` of the sorted values do not exceed, by nearest rank.
double percentile(const std::vector<double>& sorted, double part) {
  return sorted[static_cast<std::size_t>(std::ceil(part * static_cast<double>(sorted.size()))) - 1];
}

// {"mean", "median", "p95", "worst", "worst_frame"} of a number that is better the less it is.
json spread_json(const std::vector<json>& frames, const json::json_pointer& number) {
  std::vector<double> values;
  values.reserve(frames.size());
  for (const json& frame : frames) values.push_back(frame.contains(number) ? frame.at(number).get<double>() : 0.0);
  const auto worst = std::max_element(values.begin(), values.end()) - values.begin();
  json out = {{"mean", std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size())},
              {"worst", values[static_cast<std::size_t>(worst)]},
              {"worst_frame", frames[static_cast<std::size_t>(worst)].at("frame")}};
  std::sort(values.begin(), values.end());
  out["median"] = percentile(values, 0.5);
  out["p95"] = percentile(values, 0.95);
  return out;
}

json spreads_json(const std::vector<json>& frames) {
  json out;
  for (const auto& [name, number] : {std::pair{"time_ms", "/timing/time_ms"},
                                     {"energy_nj", "/energy/total_nj"},
                                     {"dram_read_bytes", "/counters/dram.read_bytes"},
                                     {"dram_written_bytes", "/counters/dram.written_bytes"},
                                     {"list_bytes", "/counters/binner.queue_bytes_peak"}})
    out[name] = spread_json(frames, json::json_pointer(number));
  return out;
}

}  // namespace

namespace {

// Images that the capture's materials sample.
std::size_t sampled_textures(const scene::Capture& capture) {
  std::set<const void*> textures;
  for (const scene::Material& material : capture.materials)
    for (const auto* slot : material.slots())
      if (slot->texture != nullptr) textures.insert(slot->texture.get());
  return textures.size();
}

}  // namespace

Statistics::Statistics(const scene::Capture& capture, const gpu::GpuConfiguration& gpu,
                       const gpu::RunSettings& settings, const gpu::RenderRequest& request)
    : machine_(gpu) {
  head_["schema"] = "tessera.stats/1";
  head_["capture"] = {{"file", capture.file.filename().string()},
                      {"bytes", capture.file_bytes},
                      {"lights", capture.lights.size()},
                      {"textures", sampled_textures(capture)},
                      {"notices", capture.notices}};
  if (capture.variant != scene::kNone)
    head_["capture"]["variant"] = capture.variants[static_cast<std::size_t>(capture.variant)];
  head_["gpu"] = gpu::gpu_json(gpu);
  head_["gpu_notices"] = gpu::configuration_notes(gpu);
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

json passes_json(const std::vector<gpu::PassResult>& passes) {
  json out = json::array();
  for (const gpu::PassResult& of : passes) {
    json& pass = out.emplace_back(json::object({{"name", of.name}}));
    // A single pass has all that its frame has.
    if (passes.size() == 1) continue;
    pass["counters"] = counters_json(of.counters);
    pass["dram"] = dram_json(of.counters.ledger);
  }
  return out;
}

json frame_json(const hardware::Machine& gpu, const gpu::FrameResult& frame, const baselines::BaselineSet* schemes) {
  json out = {{"frame", frame.frame},
              {"effects", frame.effects},
              {"effect_reasons", frame.effect_reasons},
              {"effect_places", effect_places_json(frame.effect_places)},
              {"counters", counters_json(frame.counters)},
              {"dram", dram_json(frame.counters.ledger)}};
  out["passes"] = passes_json(frame.passes);
  if (frame.model) {
    put_model(gpu, frame.model->timing, frame.model->energy, 1, out);
    out["area"] = area_json(frame.model->area);
  }
  if (frame.right)
    out["right_eye"] = {{"counters", counters_json(frame.right->counters)},
                        {"passes", passes_json(frame.right->passes)}};
  if (schemes != nullptr) out["baselines"] = baselines_json(*schemes);
  return out;
}

void Statistics::set_host(double load, double decode, double assemble) {
  head_["host"]["stages"] = {{"load", load}, {"decode", decode}, {"assemble", assemble}};
}

void Statistics::add_notice(const std::string& notice) {
  if (!notice.empty()) head_["capture"]["notices"].push_back(notice);
}

void Statistics::add_gpu_notice(const std::string& notice) {
  if (!notice.empty()) head_["gpu_notices"].push_back(notice);
}

void Statistics::add(const gpu::FrameResult& frame, const baselines::BaselineSet* schemes, const FrameCosts* costs) {
  nlohmann::json stages = nlohmann::json::object();
  for (const auto& [stage, seconds] : frame.stage_seconds) stages[stage] = seconds;
  frames_.push_back(frame_json(machine_, frame, schemes));
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

void Statistics::add_baseline_passes(std::span<const baselines::PassSet> passes) {
  if (passes.size() < 2) return;
  frames_.back()["baseline_passes"] = baseline_passes_json(passes);
  frame_bytes_ = std::max(frame_bytes_, json_text(frames_.back(), 1).size());
}

std::uint64_t Statistics::bytes_at_most() const {
  // A frame's text in stats.json plus its row in the CSV files; the new files are written beside the old ones.
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
    put_model(machine_, *timing_, energy_, static_cast<double>(frames_.size()), out["total"]);
    out["total"]["area"] = area_;
    out["total"]["over_frames"] = spreads_json(frames_);
  }
  if (has_baselines_) {
    out["total"]["baselines"] = baselines_json(baselines_.total());
    out["total"]["baseline_verdict"] = baseline_verdict_json(baselines_.total());
    out["baseline_kinds"] = baseline_kinds_json();
  }
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

std::string Statistics::verdict() const {
  return baseline_verdict_text(baselines_.total(), machine_.clock_mhz, static_cast<double>(frames_.size()));
}

void Statistics::write(const std::filesystem::path& folder) const {
  write_file_atomically(folder / "stats.json", json_text(json(), 1) + "\n");
  write_file_atomically(folder / "stats.csv", csv());
  if (has_baselines_) baselines_.write(folder);
}

namespace {

using nlohmann::json;

using Shares = std::vector<std::pair<std::string, double>>;

// "dram 52 %, shader 20 %, texture 11 %": the three largest, none below one percent.
std::string largest(Shares shares, double whole) {
  constexpr std::size_t kShown = 3;
  std::stable_sort(shares.begin(), shares.end(), [](const auto& a, const auto& b) { return a.second > b.second; });
  std::string text;
  for (std::size_t k = 0; k < std::min(kShown, shares.size()) && shares[k].second >= 0.01 * whole && whole > 0; ++k)
    text += fmt::format("{}{} {:.0f} %", k == 0 ? "" : ", ", shares[k].first, 100 * shares[k].second / whole);
  return text;
}

std::string with(const std::string& before, const std::string& text) { return text.empty() ? "" : before + text; }

std::string bytes_text(double bytes) { return human_bytes(static_cast<std::uint64_t>(bytes)); }

std::string time_line(const json& timing, double frames, double clock_mhz, const std::string& machine) {
  const double cycles = timing.at("cycles").get<double>() / frames, ms = cycles / clock_mhz * 1e-3;
  return fmt::format("{:.3f} ms a frame, {:.0f} frames/s: {:.0f} cycles of {} at {:g} MHz{}", ms,
                     ms > 0 ? 1000 / ms : 0.0, cycles, escape_control(machine, 40), clock_mhz,
                     with(", ", coarser_models_note(timing)));
}

std::string bound_line(const json& timing) {
  const std::string by = timing.at("bound_by");
  if (by.empty()) return "nothing: no work was done";
  Shares busy;
  for (const auto& [unit, row] : timing.at("units").items())
    if (unit != "tilecores") busy.emplace_back(unit, row.at("utilisation").get<double>());
  const double cycles = timing.at("cycles").get<double>(), saved = timing.at("bound_by_cycles").get<double>();
  return fmt::format("{}: with twice as much of it a frame takes {:.0f} % less time{}", by,
                     cycles > 0 ? 100 * saved / cycles : 0.0, with("; busy: ", largest(busy, 1)));
}

// "meets 60 frames/s: 3.1 ms of 16.7"; over several frames how many do, and how their times spread.
std::string target_line(const json& statistics, double target) {
  const json &spread = statistics.at("total").at("over_frames").at("time_ms"), &frames = statistics.at("frames");
  const double allowed = 1000 / target;
  const auto meets = std::count_if(frames.begin(), frames.end(), [&](const json& frame) {
    return frame.at("timing").at("time_ms").get<double>() <= allowed;
  });
  if (frames.size() == 1) {
    const double ms = spread.at("mean").get<double>();
    return fmt::format("{} {:g} frames/s: {:.3f} ms where {:.3f} are allowed, {:.0f} % {}",
                       meets > 0 ? "meets" : "misses", target, ms, allowed, 100 * std::abs(1 - ms / allowed),
                       meets > 0 ? "to spare" : "too much");
  }
  return fmt::format(
      "{} of {} frames meet {:g} frames/s ({:.3f} ms): median {:.3f}, 95th percentile {:.3f}, worst {:.3f} ms in frame "
      "{}",
      meets, frames.size(), target, allowed, spread.at("median").get<double>(), spread.at("p95").get<double>(),
      spread.at("worst").get<double>(), spread.at("worst_frame").get<int>());
}

std::string traffic_line(const json& total, double frames) {
  std::map<std::string, double> sums;  // of a purpose over the units
  double read = 0, written = 0;
  for (const json& row : total.at("dram")) {
    const double in = row.at("read_bytes").get<double>(), out = row.at("written_bytes").get<double>();
    read += in, written += out;
    sums[row.at("purpose").get<std::string>()] += in + out;
  }
  const Shares purposes(sums.begin(), sums.end());
  return fmt::format("{} a frame, {} read and {} written{}", bytes_text((read + written) / frames),
                     bytes_text(read / frames), bytes_text(written / frames),
                     with(": ", largest(purposes, read + written)));
}

std::string energy_line(const json& total, double frames, const json& gpu) {
  const json& energy = total.at("energy");
  Shares units;
  for (const auto& [unit, nj] : energy.at("by_unit").items()) units.emplace_back(unit, nj.get<double>());
  const double nj = energy.at("total_nj").get<double>(), target = gpu.at("machine").at("target_fps").get<double>(),
               possible = total.at("timing").at("frames_per_second").get<double>(),
               rate = target > 0 ? std::min(target, possible) : possible;
  return fmt::format("{:.3f} mJ a frame, {:.2f} W at {:.0f} frames/s{}", nj / frames * 1e-6,
                     energy.at("power_w").get<double>(), rate, with(": ", largest(units, nj)));
}

}  // namespace

std::string replay_summary(const json& statistics, const std::string& results) {
  const json& total = statistics.at("total");
  const auto frames = total.at("frames").get<double>(),
             clock_mhz = statistics.at("gpu").at("clock").at("mhz").get<double>();
  const json& gpu = statistics.at("gpu");
  const std::string machine = gpu.value("name", gpu.value("preset", std::string()));
  const bool modelled = total.contains("timing");
  constexpr std::string_view kNotModelled = "not modelled (output.machine_model=false)";
  std::string text;
  const auto line = [&](const char* what, std::string_view said) { text += fmt::format("{:<9} {}\n", what, said); };
  line("time", modelled ? time_line(total.at("timing"), frames, clock_mhz, machine) : std::string(kNotModelled));
  if (const double target = gpu.at("machine").at("target_fps").get<double>(); modelled && target > 0)
    line("target", target_line(statistics, target));
  line("bound by", modelled ? bound_line(total.at("timing")) : std::string(kNotModelled));
  line("traffic", traffic_line(total, frames));
  line("energy", modelled ? energy_line(total, frames, gpu) : std::string(kNotModelled));
  line("results", results);
  return text;
}

nlohmann::json describe_counters() {
  std::vector<gpu::CounterInfo> infos = gpu::counter_infos();
  gpu::append_counter_infos<baselines::BaselineCounters>(infos);
  std::sort(infos.begin(), infos.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  nlohmann::json rows = nlohmann::json::array();
  for (const gpu::CounterInfo& info : infos)
    rows.push_back({{"name", info.name},
                    {"unit", info.unit},
                    {"over_frames", info.over_frames == Combine::kSum ? "sum" : "peak"},
                    {"meaning", info.meaning},
                    {"vendor", info.vendor}});
  return rows;
}

}  // namespace tessera::replay

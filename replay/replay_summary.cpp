#include "replay/replay_summary.h"

#include <algorithm>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/text.h"

namespace tessera::replay {
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
  const double cycles = timing["cycles"].get<double>() / frames, ms = cycles / clock_mhz * 1e-3;
  return fmt::format("{:.3f} ms a frame, {:.0f} frames/s: {:.0f} cycles of {} at {:g} MHz", ms,
                     ms > 0 ? 1000 / ms : 0.0, cycles, escape_control(machine, 40), clock_mhz);
}

std::string bound_line(const json& timing) {
  const std::string by = timing["bound_by"];
  if (by.empty()) return "nothing: no work was done";
  Shares busy;
  for (const auto& [unit, row] : timing["units"].items())
    if (unit != "tilecores") busy.emplace_back(unit, row["utilisation"].get<double>());
  const double cycles = timing["cycles"].get<double>(), saved = timing["bound_by_cycles"].get<double>();
  return fmt::format("{}: with twice as much of it {:.0f} % faster{}", by,
                     cycles > saved ? 100 * saved / (cycles - saved) : 0.0, with("; busy: ", largest(busy, 1)));
}

std::string traffic_line(const json& total, double frames) {
  std::map<std::string, double> sums;  // of a purpose over the units
  double read = 0, written = 0;
  for (const json& row : total["dram"]) {
    const double in = row["read_bytes"].get<double>(), out = row["written_bytes"].get<double>();
    read += in, written += out;
    sums[row["purpose"].get<std::string>()] += in + out;
  }
  const Shares purposes(sums.begin(), sums.end());
  return fmt::format("{} a frame, {} read and {} written{}", bytes_text((read + written) / frames),
                     bytes_text(read / frames), bytes_text(written / frames),
                     with(": ", largest(purposes, read + written)));
}

std::string energy_line(const json& total, double frames, double clock_mhz) {
  const json& energy = total["energy"];
  Shares units;
  for (const auto& [unit, nj] : energy["by_unit"].items()) units.emplace_back(unit, nj.get<double>());
  const double nj = energy["total_nj"].get<double>(),
               us = total["timing"]["cycles"].get<double>() / clock_mhz;  // nJ per microsecond: mW
  return fmt::format("{:.3f} mJ a frame, {:.2f} W{}", nj / frames * 1e-6, us > 0 ? nj / us * 1e-3 : 0.0,
                     with(": ", largest(units, nj)));
}

}  // namespace

std::string replay_summary(const json& statistics, const std::string& results) {
  const json& total = statistics["total"];
  const auto frames = total["frames"].get<double>(), clock_mhz = statistics["gpu"]["clock"]["mhz"].get<double>();
  const json& gpu = statistics["gpu"];
  const std::string machine = gpu.value("name", gpu.value("preset", std::string()));
  const bool modelled = total.contains("timing");
  constexpr std::string_view kNotModelled = "not modelled (output.machine_model=false)";
  std::string text;
  const auto line = [&](const char* what, std::string_view said) { text += fmt::format("{:<9} {}\n", what, said); };
  line("time", modelled ? time_line(total["timing"], frames, clock_mhz, machine) : std::string(kNotModelled));
  line("bound by", modelled ? bound_line(total["timing"]) : std::string(kNotModelled));
  line("traffic", traffic_line(total, frames));
  line("energy", modelled ? energy_line(total, frames, clock_mhz) : std::string(kNotModelled));
  line("results", results);
  return text;
}

}  // namespace tessera::replay

#include "replay/sensitivity.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/error.h"
#include "base/parallel.h"
#include "gpu/machine_model.h"

namespace tessera::replay {
namespace {

using nlohmann::json;

double key_number(const KeyValue& value) {
  return std::holds_alternative<double>(value) ? std::get<double>(value)
                                               : static_cast<double>(std::get<std::int64_t>(value));
}

bool has_number(const KeyValue& value) {
  return std::holds_alternative<double>(value) || std::holds_alternative<std::int64_t>(value);
}

// Whether a key changes energy or area only, not cycles.
bool prices_alone(std::string_view key) {
  return key.starts_with("energy.") || key.starts_with("area.") || key.starts_with("voltage.") ||
         key == "memory.pj_per_bit";
}

gpu::GpuConfiguration with_number(const gpu::GpuConfiguration& machine, const std::string& name, double number) {
  const auto& key = *gpu::gpu_keys().find(name);
  gpu::GpuConfiguration changed = machine;
  if (std::holds_alternative<std::int64_t>(key.get(machine)))
    key.set(changed, static_cast<std::int64_t>(number));
  else
    key.set(changed, number);
  return changed;
}

std::string bound_of(const gpu::GpuConfiguration& machine, const std::vector<timing::FrameWork>& views) {
  const auto bound = gpu::frame_cost(machine, views).timing.bound_by;
  return bound ? std::string(name(*bound)) : "-";
}

std::vector<Influence> timing_numbers(const gpu::GpuConfiguration& machine) {
  std::vector<Influence> all;
  for (const auto& key : gpu::gpu_keys().keys()) {
    const KeyValue value = key.get(machine);
    if (!key.timing || !has_number(value)) continue;
    const double number = key_number(value);
    const PlausibleRange ends = key_ends(key, number, key_number(gpu::gpu_keys().default_value(key)));
    Influence of;
    of.key = key.name;
    of.assumed = key.assumed();
    of.value = number;
    of.ends = {ends.low, ends.high};
    if (std::holds_alternative<std::int64_t>(value)) of.ends = {std::floor(ends.low), std::floor(ends.high)};
    of.cycles = of.energy = {1, 1};
    all.push_back(std::move(of));
  }
  return all;
}

Uncertainty uncertainty_of(const std::vector<Influence>& numbers, std::array<double, 2> Influence::*of) {
  double down = 0, up = 0;
  for (const Influence& number : numbers) {
    if (!number.assumed) continue;
    const auto& [low, high] = number.*of;
    const double less = std::min({low - 1, high - 1, 0.0}), more = std::max({low - 1, high - 1, 0.0});
    down += less * less, up += more * more;
  }
  return {std::sqrt(down), std::sqrt(up)};
}

}  // namespace

double Influence::most() const {
  double most = 0;
  for (const double ratio : {cycles[0], cycles[1], energy[0], energy[1]}) most = std::max(most, std::abs(ratio - 1));
  return most;
}

std::vector<std::string> Sensitivity::verdict_hangs_on() const {
  std::vector<std::string> keys;
  for (const Influence& of : numbers)
    if (of.assumed && (of.bound_by[0] != bound_by || of.bound_by[1] != bound_by)) keys.push_back(of.key);
  return keys;
}

Sensitivity measure_sensitivity(const gpu::GpuConfiguration& machine, const std::vector<timing::FrameWork>& views) {
  Sensitivity out;
  std::vector<Influence>& all = out.numbers;
  all = timing_numbers(machine);
  const gpu::CycleCost plain = gpu::cycle_cost(machine, views);
  parallel_for(2 * all.size(), [&](std::size_t k) {
    Influence& of = all[k / 2];
    const gpu::GpuConfiguration changed = with_number(machine, of.key, of.ends[k % 2]);
    gpu::CycleCost cost = plain;
    if (prices_alone(of.key))
      cost.energy_nj = gpu::energy_nj(changed, plain);
    else
      cost = gpu::cycle_cost(changed, views);
    of.cycles[k % 2] = plain.cycles > 0 ? cost.cycles / plain.cycles : 1;
    of.energy[k % 2] = plain.energy_nj > 0 ? cost.energy_nj / plain.energy_nj : 1;
  });
  std::stable_sort(all.begin(), all.end(), [](const Influence& a, const Influence& b) { return a.most() > b.most(); });

  out.bound_by = bound_of(machine, views);
  parallel_for(2 * all.size(), [&](std::size_t k) {
    Influence& of = all[k / 2];
    std::string& bound = of.bound_by[k % 2];
    bound = out.bound_by;
    if (of.most() < Influence::kWorthSaying || prices_alone(of.key)) return;
    try {
      bound = bound_of(with_number(machine, of.key, of.ends[k % 2]), views);
    } catch (const UsageError&) {
      // No such machine can be built: it has no verdict of its own.
    }
  });
  out.cycles = uncertainty_of(all, &Influence::cycles);
  out.energy = uncertainty_of(all, &Influence::energy);
  return out;
}

void print_sensitivity(std::FILE* words, const Sensitivity& sensitivity) {
  fmt::print(words, "\n{:<32} {:>11} {:>11} {:>11} {:>15} {:>10} {:>15} {:>10}\n", "number", "value", "low", "high",
             "cycles at low", "at high", "energy at low", "at high");
  for (const Influence& of : sensitivity.numbers) {
    if (of.most() < Influence::kWorthSaying) continue;
    fmt::print(words, "{:<32} {:>11.6g} {:>11.6g} {:>11.6g} {:>+14.1f}% {:>+9.1f}% {:>+14.1f}% {:>+9.1f}%\n", of.key,
               of.value, of.ends[0], of.ends[1], 100 * (of.cycles[0] - 1), 100 * (of.cycles[1] - 1),
               100 * (of.energy[0] - 1), 100 * (of.energy[1] - 1));
  }
  fmt::print(words,
             "all assumed numbers, independent of each other: cycles -{:.0f} % to +{:.0f} %, energy -{:.0f} % to "
             "+{:.0f} %\n",
             100 * sensitivity.cycles.down, 100 * sensitivity.cycles.up, 100 * sensitivity.energy.down,
             100 * sensitivity.energy.up);
  const std::vector<std::string> hangs_on = sensitivity.verdict_hangs_on();
  fmt::print(words, "bound by {}, which hangs on {}\n", sensitivity.bound_by,
             hangs_on.empty() ? "none of them alone" : fmt::format("{}", fmt::join(hangs_on, ", ")));
  for (const Influence& of : sensitivity.numbers)
    for (std::size_t end = 0; end < 2; ++end)
      if (of.bound_by[end] != sensitivity.bound_by)
        fmt::print(words, "  {}={:.6g}: {}\n", of.key, of.ends[end], of.bound_by[end]);
}

json sensitivity_json(const Sensitivity& sensitivity) {
  json numbers = json::array();
  for (const Influence& of : sensitivity.numbers)
    numbers.push_back({{"key", of.key},
                       {"assumed", of.assumed},
                       {"value", of.value},
                       {"ends", of.ends},
                       {"cycles", of.cycles},
                       {"energy", of.energy},
                       {"bound_by", of.bound_by}});
  return {{"bound_by", sensitivity.bound_by},
          {"verdict_hangs_on", sensitivity.verdict_hangs_on()},
          {"cycles", {sensitivity.cycles.down, sensitivity.cycles.up}},
          {"energy", {sensitivity.energy.down, sensitivity.energy.up}},
          {"numbers", numbers}};
}

}  // namespace tessera::replay

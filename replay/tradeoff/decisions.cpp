#include "replay/tradeoff/decisions.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>

#include "replay/tradeoff/tradeoff_files.h"

namespace tessera::replay {
namespace {

Spread spread_of(std::vector<double> rounds) {
  if (rounds.empty()) return {};
  std::sort(rounds.begin(), rounds.end());
  const std::size_t n = rounds.size();
  return {n % 2 == 1 ? rounds[n / 2] : std::midpoint(rounds[n / 2 - 1], rounds[n / 2]), rounds.front(), rounds.back()};
}

std::optional<std::uint64_t> whole_figure(const TrialResult& trial, const std::string& name) {
  const auto found = trial.figures.find(name);
  return found == trial.figures.end() ? std::nullopt : std::optional(std::get<std::uint64_t>(found->second));
}

// Image and work of a setting, which a knob without effect leaves equal. Host times always differ.
auto image_and_work(const Measurement& m) {
  return std::tie(m.image_sha256, m.cycles, m.dram_bytes, m.energy_nj, m.watched);
}

// Compares settings that time the same frame with the finest one.
void compare_times(KnobResult& knob, const Measurement& finest) {
  for (SettingResult& setting : knob.settings) {
    const Measurement& m = setting.measured;
    setting.front = {};
    if (m.cycles && finest.cycles && *finest.cycles > 0)
      setting.cycles_error = static_cast<double>(*m.cycles) / static_cast<double>(*finest.cycles) - 1;
    if (m.energy_nj && finest.energy_nj && *finest.energy_nj > 0)
      setting.energy_error = *m.energy_nj / *finest.energy_nj - 1;
  }
}

}  // namespace

Measurement measurement_of(const TrialResult& trial, const std::string& watched, double clock_mhz) {
  Measurement out;
  out.error = trial.error;
  out.image_sha256 = trial.image_sha256;
  out.cycles = whole_figure(trial, "timing.cycles");
  if (out.cycles) out.ms = static_cast<double>(*out.cycles) / (1e3 * clock_mhz);
  const auto read_bytes = whole_figure(trial, "dram.read_bytes"), written = whole_figure(trial, "dram.written_bytes");
  if (read_bytes || written) out.dram_bytes = read_bytes.value_or(0) + written.value_or(0);
  if (const auto energy = trial.figures.find("energy.total_nj"); energy != trial.figures.end())
    out.energy_nj = std::get<double>(energy->second);
  if (!watched.empty() && !trial.figures.empty()) {
    const auto found = trial.figures.find(watched);
    out.watched = found == trial.figures.end() ? Figure{std::uint64_t{0}} : found->second;
  }
  out.wall_seconds = spread_of(trial.host.wall_seconds);
  out.processor_seconds = spread_of(trial.host.processor_seconds);
  return out;
}

std::optional<double> cost_of(const Measurement& measured, Cost cost) {
  switch (cost) {
    case Cost::kMs:
      return measured.ms;
    case Cost::kDramBytes:
      return measured.dram_bytes;
    case Cost::kMj:
      return measured.energy_nj ? std::optional(*measured.energy_nj * 1e-6) : std::nullopt;
    case Cost::kWallSeconds:
      return measured.wall_seconds.median;
    case Cost::kProcessorSeconds:
      break;
  }
  return measured.processor_seconds.median;
}

std::vector<bool> pareto_front(const std::vector<ErrorAndCost>& points) {
  std::vector<bool> front(points.size(), true);
  for (std::size_t a = 0; a < points.size(); ++a)
    for (const ErrorAndCost& b : points)
      if (b.error <= points[a].error && b.cost <= points[a].cost &&
          (b.error < points[a].error || b.cost < points[a].cost))
        front[a] = false;
  return front;
}

void judge(KnobResult& knob) {
  knob.idle = false;
  if (knob.settings.empty()) return;
  const SettingResult against = knob.settings[knob.against];
  for (SettingResult& setting : knob.settings) {
    setting.same_image = setting.measured.image_sha256 == against.measured.image_sha256;
    setting.says = setting_in_words(setting, against, knob.watched_as);
  }
  knob.idle = std::all_of(knob.settings.begin(), knob.settings.end(), [&](const SettingResult& setting) {
    return image_and_work(setting.measured) == image_and_work(against.measured);
  });
  if (knob.timed) return compare_times(knob, against.measured);
  for (const Cost cost : kCosts) {
    std::vector<ErrorAndCost> points;
    std::vector<SettingResult*> of;
    for (SettingResult& setting : knob.settings) {
      setting.front[static_cast<std::size_t>(cost)].reset();
      const auto value = cost_of(setting.measured, cost);
      if (!value) continue;
      points.push_back({setting.measured.error->flip, *value});
      of.push_back(&setting);
    }
    const std::vector<bool> front = pareto_front(points);
    for (std::size_t k = 0; k < of.size(); ++k) of[k]->front[static_cast<std::size_t>(cost)] = front[k];
  }
}

double shortfall_db(const ImageError& error, const CheapestWanted& wanted) {
  double missing = 0;
  if (wanted.min_psnr_db && error.psnr_db) missing = *wanted.min_psnr_db - *error.psnr_db;
  if (wanted.max_flip && error.flip > *wanted.max_flip)
    missing = std::max(missing, *wanted.max_flip > 0 ? 20 * std::log10(error.flip / *wanted.max_flip)
                                                     : std::numeric_limits<double>::infinity());
  return std::max(missing, 0.0);
}

namespace {

// The first of the machine's settings in the order of `rank`, among the settings that have a rank.
template <class Rank>
std::optional<CheapestSetting> first_by(const std::vector<KnobResult>& knobs, Cost cost, const Rank& rank) {
  std::optional<CheapestSetting> best;
  std::optional<std::pair<double, double>> least;
  for (const KnobResult& knob : knobs) {
    if (knob.timed) continue;  // all its settings time one machine
    for (const SettingResult& setting : knob.settings) {
      const auto of = cost_of(setting.measured, cost);
      if (!of || setting.in_double) continue;
      const std::optional<std::pair<double, double>> at = rank(*setting.measured.error, *of);
      if (!at || (least && *at >= *least)) continue;
      best = {knob.name, setting};
      least = at;
    }
  }
  return best;
}

}  // namespace

std::optional<CheapestSetting> cheapest(const std::vector<KnobResult>& knobs, const CheapestWanted& wanted) {
  return first_by(knobs, wanted.cost, [&](const ImageError& error, double cost) {
    return shortfall_db(error, wanted) > 0 ? std::nullopt : std::optional(std::pair(cost, error.flip));
  });
}

std::optional<CheapestSetting> nearest_miss(const std::vector<KnobResult>& knobs, const CheapestWanted& wanted) {
  return first_by(knobs, wanted.cost, [&](const ImageError& error, double cost) {
    const double missing = shortfall_db(error, wanted);
    return missing > 0 ? std::optional(std::pair(missing, cost)) : std::nullopt;
  });
}

}  // namespace tessera::replay

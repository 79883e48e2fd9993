#include "replay/tradeoff/tradeoff_files.h"

#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/atomic_file.h"
#include "base/json_text.h"
#include "replay/csv_cell.h"
#include "replay/tradeoff/trial_file.h"

namespace tessera::replay {
namespace {

using nlohmann::json;

template <class T>
json or_null(const std::optional<T>& value) {
  return value ? json(*value) : json();
}

json figure_or_null(const std::optional<Figure>& figure) {
  return figure ? std::visit([](auto value) { return json(value); }, *figure) : json();
}

json spread_json(const Spread& spread) {
  return {{"median", spread.median}, {"low", spread.low}, {"high", spread.high}};
}

constexpr bool is_host_cost(Cost cost) { return cost == Cost::kWallSeconds || cost == Cost::kProcessorSeconds; }

json setting_json(const SettingResult& setting) {
  const Measurement& m = setting.measured;
  json front = json::object(),
       host = {{"seconds", spread_json(m.wall_seconds)}, {"processor_seconds", spread_json(m.processor_seconds)}};
  for (std::size_t c = 0; c < kCosts.size(); ++c) {
    const std::string name(kCostNames[c]);
    if (setting.front[c]) (is_host_cost(kCosts[c]) ? host["front_" + name] : front[name]) = *setting.front[c];
  }
  json out = {{"label", setting.label},
              {"arguments", setting.arguments},
              {"base", setting.is_base},
              {"in_double", setting.in_double},
              {"error", error_json(m.error)},
              {"picture", m.image_sha256},
              {"cycles", or_null(m.cycles)},
              {"dram_bytes", or_null(m.dram_bytes)},
              {"energy_nj", or_null(m.energy_nj)},
              {"watched", figure_or_null(m.watched)},
              {"same_picture", setting.same_image},
              {"front", front},
              {"says", setting.says},
              {"host", host}};
  if (setting.cycles_error) out["cycles_error"] = *setting.cycles_error;
  if (setting.energy_error) out["energy_error"] = *setting.energy_error;
  return out;
}

json knob_json(const KnobResult& knob) {
  json settings = json::array();
  for (const SettingResult& setting : knob.settings) settings.push_back(setting_json(setting));
  return {
      {"name", knob.name},     {"title", knob.title},     {"context", knob.context},       {"against", knob.against},
      {"visual", knob.visual}, {"watched", knob.watched}, {"watched_as", knob.watched_as}, {"skipped", knob.skipped},
      {"timed", knob.timed},   {"idle", knob.idle},       {"settings", settings}};
}

json cheapest_json(const CheapestAnswer& answer) {
  json setting;
  if (answer.found) {
    setting = setting_json(answer.found->setting);
    setting["knob"] = answer.found->knob;
  }
  return {{"cost", kCostNames[static_cast<std::size_t>(answer.wanted.cost)]},
          {"max_flip", or_null(answer.wanted.max_flip)},
          {"min_psnr", or_null(answer.wanted.min_psnr_db)},
          {"setting", setting}};
}

std::string csv_row(const KnobResult& knob, const SettingResult& setting) {
  const Measurement& m = setting.measured;
  const auto of_error = [&](const auto& value) { return m.error ? json(value(*m.error)) : json(); };
  std::vector<json> cells = {knob.name,
                             setting.label,
                             setting.arguments,
                             setting.is_base,
                             of_error([](const ImageError& e) { return or_null(e.psnr_db); }),
                             of_error([](const ImageError& e) { return e.ssim; }),
                             of_error([](const ImageError& e) { return e.flip; }),
                             of_error([](const ImageError& e) { return e.max_error; }),
                             or_null(m.cycles),
                             or_null(m.dram_bytes),
                             or_null(m.energy_nj),
                             knob.watched,
                             figure_or_null(m.watched)};
  for (const Cost cost : {Cost::kCycles, Cost::kDramBytes, Cost::kEnergyNj})
    cells.push_back(or_null(setting.on_front(cost)));
  cells.emplace_back(setting.says);
  for (const Spread& times : {m.wall_seconds, m.processor_seconds})
    for (const double seconds : {times.median, times.low, times.high}) cells.emplace_back(seconds);
  cells.push_back(or_null(setting.cycles_error));
  cells.push_back(or_null(setting.energy_error));
  std::vector<std::string> texts;
  for (const json& cell : cells) texts.push_back(csv_cell(cell));
  return fmt::format("{}\n", fmt::join(texts, ","));
}

}  // namespace

json tradeoff_json(const TradeoffResult& tradeoff, const std::optional<CheapestAnswer>& cheapest) {
  json knobs = json::array();
  for (const KnobResult& knob : tradeoff.knobs) knobs.push_back(knob_json(knob));
  json out = {{"schema", "tessera.tradeoff/1"},
              {"capture", tradeoff.capture},
              {"frame", tradeoff.frame},
              {"first_frame", tradeoff.first_frame},
              {"size", {tradeoff.width, tradeoff.height}},
              {"rounds", tradeoff.rounds},
              {"arguments", tradeoff.arguments},
              {"settings", gpu::settings_json(tradeoff.settings)},
              {"gpu", gpu::gpu_json(tradeoff.gpu)},
              {"gpu_name", tradeoff.gpu_name},
              {"reference", tradeoff.reference ? reference::reference_info_json(*tradeoff.reference) : json()},
              {"knobs", knobs},
              {"stopped", tradeoff.stopped}};
  if (tradeoff.variant) out["variant"] = *tradeoff.variant;
  if (!tradeoff.view.empty()) out["view"] = tradeoff.view.json();
  if (cheapest) out["cheapest"] = cheapest_json(*cheapest);
  return out;
}

std::string tradeoff_csv(const TradeoffResult& tradeoff) {
  std::string text =
      "knob,setting,arguments,base,psnr_db,ssim,flip,max_error,cycles,dram_bytes,energy_nj,watched,watched_value,front_"
      "cycles,front_dram_bytes,front_energy_nj,says,seconds_median,seconds_low,seconds_high,processor_seconds_median,"
      "processor_seconds_low,processor_seconds_high,cycles_error,energy_error\n";
  for (const KnobResult& knob : tradeoff.knobs)
    for (const SettingResult& setting : knob.settings) text += csv_row(knob, setting);
  return text;
}

void write_tradeoff(const std::filesystem::path& folder, const TradeoffResult& tradeoff,
                    const std::optional<CheapestAnswer>& cheapest) {
  write_file_atomically(folder / "tradeoff.csv", tradeoff_csv(tradeoff));
  write_file_atomically(folder / "tradeoff.json", json_text(tradeoff_json(tradeoff, cheapest), 1) + "\n");
}

}  // namespace tessera::replay

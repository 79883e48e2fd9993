#include "replay/tradeoff/tradeoff_files.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/atomic_file.h"
#include "base/json_text.h"
#include "replay/tradeoff/decisions.h"
#include "replay/tradeoff/effect_costs.h"
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
              {"ms", or_null(m.ms)},
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

json named_setting_json(const std::optional<CheapestSetting>& named) {
  if (!named) return {};
  json setting = setting_json(named->setting);
  setting["knob"] = named->knob;
  return setting;
}

json effect_json(const EffectResult& effect) {
  return {{"name", effect.name},
          {"ran", effect.ran},
          {"reason", effect.reason},
          {"sub_patches", effect.sub_patches},
          {"tiles", effect.tiles},
          {"counters", effect.counters},
          {"without", effect.without},
          {"stays", effect.stays},
          {"setting", or_null(effect.setting)}};
}

json cheapest_json(const CheapestAnswer& answer) {
  return {{"cost", kCostNames[static_cast<std::size_t>(answer.wanted.cost)]},
          {"max_flip", or_null(answer.wanted.max_flip)},
          {"min_psnr", or_null(answer.wanted.min_psnr_db)},
          {"setting", named_setting_json(answer.found)},
          {"missed", named_setting_json(answer.missed)}};
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
                             or_null(m.ms),
                             or_null(m.cycles),
                             or_null(m.dram_bytes),
                             or_null(cost_of(m, Cost::kMj)),
                             knob.watched,
                             figure_or_null(m.watched)};
  for (const Cost cost : {Cost::kMs, Cost::kDramBytes, Cost::kMj}) cells.push_back(or_null(setting.on_front(cost)));
  cells.emplace_back(setting.says);
  for (const Spread& times : {m.wall_seconds, m.processor_seconds})
    for (const double seconds : {times.median, times.low, times.high}) cells.emplace_back(seconds);
  cells.push_back(or_null(setting.cycles_error));
  cells.push_back(or_null(setting.energy_error));
  std::vector<std::string> texts;
  texts.reserve(cells.size());
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
  for (const EffectResult& effect : tradeoff.effects) out["effects"].push_back(effect_json(effect));
  if (tradeoff.variant) out["variant"] = *tradeoff.variant;
  if (!tradeoff.view.empty()) out["view"] = tradeoff.view.json();
  if (cheapest) out["cheapest"] = cheapest_json(*cheapest);
  return out;
}

std::string tradeoff_csv(const TradeoffResult& tradeoff) {
  std::string text =
      "knob,setting,arguments,base,psnr_db,ssim,flip,max_error,ms,cycles,dram_bytes,mj,watched,watched_value,front_"
      "ms,front_dram_bytes,front_mj,says,seconds_median,seconds_low,seconds_high,processor_seconds_median,"
      "processor_seconds_low,processor_seconds_high,cycles_error,energy_error\n";
  for (const KnobResult& knob : tradeoff.knobs)
    for (const SettingResult& setting : knob.settings) text += csv_row(knob, setting);
  return text;
}

void write_tradeoff(const std::filesystem::path& folder, const TradeoffResult& tradeoff,
                    const std::optional<CheapestAnswer>& cheapest) {
  write_file_atomically(folder / "tradeoff.csv", tradeoff_csv(tradeoff));
  if (!tradeoff.effects.empty() && !tradeoff.knobs.empty())
    write_file_atomically(folder / "effects.csv", effects_csv(std::filesystem::path(tradeoff.capture).stem().string(),
                                                              tradeoff.effects, tradeoff.knobs.front()));
  write_file_atomically(folder / "tradeoff.json", json_text(tradeoff_json(tradeoff, cheapest), 1) + "\n");
}

namespace {

// "saves 12.0 % of cycles", "takes 3.1 % more cycles", "takes 2.40 times the cycles"; "" for less than 0.05 %.
std::string change(std::optional<double> now, std::optional<double> before, const std::string& name) {
  if (!now || !before) return "";
  const double a = *before, b = *now;
  if (a == 0 && b == 0) return "";
  if (a == 0) return fmt::format("takes {:.0f} {} where there were none", b, name);
  const double share = b / a - 1;
  if (std::abs(share) < 0.0005) return "";
  if (share >= 1) return fmt::format("takes {:.2f} times the {}", b / a, name);
  return share < 0 ? fmt::format("saves {:.1f} % of {}", -100 * share, name)
                   : fmt::format("takes {:.1f} % more {}", 100 * share, name);
}

std::optional<double> as_number(const std::optional<Figure>& figure) {
  if (!figure) return std::nullopt;
  return std::visit([](auto value) { return static_cast<double>(value); }, *figure);
}

std::string error_change(const SettingResult& setting, const SettingResult& against) {
  const std::string& other = against.label;
  if (setting.measured.image_sha256 == against.measured.image_sha256) return fmt::format("the same image as {}", other);
  if (!against.measured.error || !setting.measured.error) return fmt::format("another image than {}", other);
  const std::optional<double>&a = against.measured.error->psnr_db, &b = setting.measured.error->psnr_db;
  if (!a || !b)
    return !b ? "equals the reference" : fmt::format("{:.1f} dB from {}, which is the reference", *b, other);
  const double gain = *b - *a;
  if (std::abs(gain) < 0.005) return fmt::format("less than 0.01 dB from {}", other);
  return gain < 0 ? fmt::format("costs {:.2f} dB against {}", -gain, other)
                  : fmt::format("gains {:.2f} dB over {}", gain, other);
}

std::string whole_or_dash(const std::optional<std::uint64_t>& value) { return value ? std::to_string(*value) : "-"; }

std::string number_or_dash(const std::optional<double>& value, int decimals) {
  return value ? fmt::format("{:.{}f}", *value, decimals) : "-";
}

std::string table_row(const SettingResult& setting) {
  const Measurement& m = setting.measured;
  return fmt::format(
      "{}{}{:<36} {:>8} {:>8.5f} {:>8.5f} {:>7.4f} {:>9} {:>12} {:>9} {:>9.3f} {:>7.3f} ({:.2f}-{:.2f})\n",
      setting.is_base ? '>' : ' ', setting.on_front(Cost::kMs).value_or(false) ? '*' : ' ', setting.label,
      m.error->psnr_db ? fmt::format("{:.2f}", *m.error->psnr_db) : "equal", m.error->ssim, m.error->flip,
      m.error->max_error, number_or_dash(m.ms, 3), whole_or_dash(m.dram_bytes),
      number_or_dash(cost_of(m, Cost::kMj), 4), m.processor_seconds.median, m.wall_seconds.median, m.wall_seconds.low,
      m.wall_seconds.high);
}

std::string percent_or_dash(const std::optional<double>& share) {
  return share ? fmt::format("{:+.1f} %", 100 * *share) : "-";
}

// A timed knob: how far off each setting is of the finest, and how much sooner the host has it.
std::string timed_table(const KnobResult& knob) {
  std::string text = fmt::format("  {:<36} {:>11} {:>9} {:>12} {:>9} {:>9} {:>9} {:>15}\n", "setting", "cycles",
                                 "error", "energy uJ", "error", "CPU s", "as fast", "wall s (spread)");
  const double finest = knob.settings[knob.against].measured.processor_seconds.median;
  for (const SettingResult& setting : knob.settings) {
    const Measurement& m = setting.measured;
    text += fmt::format(
        "{} {:<36} {:>11} {:>9} {:>12} {:>9} {:>9.3f} {:>8.1f}x {:>7.3f} ({:.2f}-{:.2f})\n",
        setting.is_base ? '>' : ' ', setting.label, whole_or_dash(m.cycles), percent_or_dash(setting.cycles_error),
        m.energy_nj ? fmt::format("{:.1f}", *m.energy_nj * 1e-3) : "-", percent_or_dash(setting.energy_error),
        m.processor_seconds.median, m.processor_seconds.median > 0 ? finest / m.processor_seconds.median : 0,
        m.wall_seconds.median, m.wall_seconds.low, m.wall_seconds.high);
  }
  return text;
}

}  // namespace

std::string setting_in_words(const SettingResult& setting, const SettingResult& against,
                             const std::string& watched_as) {
  const Measurement &now = setting.measured, &before = against.measured;
  if (setting.label == against.label && now.image_sha256 == before.image_sha256)
    return fmt::format("{}: the others are compared with this", setting.label);
  std::vector<std::string> costs;
  if (!watched_as.empty()) costs.push_back(change(as_number(now.watched), as_number(before.watched), watched_as));
  costs.push_back(change(now.ms, before.ms, "time"));
  costs.push_back(change(now.dram_bytes, before.dram_bytes, "memory traffic"));
  costs.push_back(change(now.energy_nj, before.energy_nj, "energy"));
  std::erase(costs, "");
  return fmt::format("{}: {}; {}", setting.label, error_change(setting, against),
                     !now.ms         ? "no machine, no time"
                     : costs.empty() ? "costs the same"
                                     : fmt::format("{}", fmt::join(costs, ", ")));
}

namespace {

const SettingResult* base_of(const TradeoffResult& tradeoff) {
  for (const KnobResult& knob : tradeoff.knobs)
    for (const SettingResult& setting : knob.settings)
      if (setting.is_base && !knob.timed) return &setting;
  return nullptr;
}

// The tried settings: "7 settings of samples" or "23 settings of 3 knobs and 32 combinations".
std::string tried_text(const TradeoffResult& tradeoff) {
  std::size_t settings = 0, knobs = 0, combinations = 0;
  std::string name;
  for (const KnobResult& knob : tradeoff.knobs) {
    if (knob.timed || knob.settings.empty()) continue;
    if (knob.combines) {
      combinations += knob.settings.size();
      continue;
    }
    settings += knob.settings.size();
    name = knob.name;
    ++knobs;
  }
  return fmt::format("{} settings of {}{}", settings, knobs == 1 ? name : fmt::format("{} knobs", knobs),
                     combinations > 0 ? fmt::format(" and {} combinations", combinations) : "");
}

std::string line_of(const std::string& name, const Measurement& m) {
  return fmt::format("  {:<11} {:>8} {:>8.5f} {:>9} {:>9} {:>12} {:>8.3f}\n", name,
                     m.error->psnr_db ? fmt::format("{:.2f}", *m.error->psnr_db) : "equal", m.error->flip,
                     number_or_dash(m.ms, 3), number_or_dash(cost_of(m, Cost::kMj), 4), whole_or_dash(m.dram_bytes),
                     m.wall_seconds.median);
}

}  // namespace

std::string cheapest_text(const TradeoffResult& tradeoff, const CheapestAnswer& answer) {
  std::string wanted;
  if (answer.wanted.min_psnr_db) wanted = fmt::format("PSNR of at least {:g} dB", *answer.wanted.min_psnr_db);
  if (answer.wanted.max_flip)
    wanted += fmt::format("{}FLIP of at most {:g}", wanted.empty() ? "" : " and ", *answer.wanted.max_flip);
  const char* const cost = kCostNames[static_cast<std::size_t>(answer.wanted.cost)].data();
  std::string text;
  if (answer.found)
    text = fmt::format("{}: least {} with {}\n  {}\n", wanted, cost, answer.found->setting.label,
                       answer.found->setting.arguments.empty() ? "(as asked for)" : answer.found->setting.arguments);
  else
    text = fmt::format("none of {} has a {}\n", tried_text(tradeoff), wanted);
  text += fmt::format("  {:<11} {:>8} {:>8} {:>9} {:>9} {:>12} {:>8}\n", "", "PSNR dB", "FLIP", "ms", "mJ",
                      "DRAM bytes", "host s");
  if (answer.found) text += line_of("this", answer.found->setting.measured);
  if (const SettingResult* base = base_of(tradeoff)) text += line_of("as asked", base->measured);
  if (!answer.missed) return text;
  text += line_of("nearest", answer.missed->setting.measured);
  return text + fmt::format("  nearest to being good enough, but not: {}\n", answer.missed->setting.label);
}

namespace {

std::string knob_table(const KnobResult& knob, bool all) {
  if (knob.timed) return timed_table(knob);
  std::string text =
      fmt::format("  {:<36} {:>8} {:>8} {:>8} {:>7} {:>9} {:>12} {:>9} {:>9} {:>15}\n", "setting", "PSNR dB", "SSIM",
                  "FLIP", "max", "ms", "DRAM bytes", "mJ", "CPU s", "wall s (spread)");
  std::vector<const SettingResult*> shown;
  for (const SettingResult& setting : knob.settings)
    if (all || decides(setting)) shown.push_back(&setting);
  // Settings of a knob have an order of their own, combinations have none.
  if (knob.combines)
    std::stable_sort(shown.begin(), shown.end(), [](const SettingResult* a, const SettingResult* b) {
      return a->measured.ms.value_or(0) < b->measured.ms.value_or(0);
    });
  for (const SettingResult* setting : shown) text += table_row(*setting);
  const std::size_t beaten = knob.settings.size() - shown.size();
  if (beaten > 0) text += fmt::format("  {} more, which others beat in FLIP and ms\n", beaten);
  if (all)
    for (const SettingResult& setting : knob.settings) text += fmt::format("    {}\n", setting.says);
  return text;
}

}  // namespace

bool decides(const SettingResult& setting) { return setting.is_base || setting.on_front(Cost::kMs).value_or(true); }

std::string tradeoff_table(const TradeoffResult& tradeoff, bool all) {
  std::string text;
  std::vector<std::string> idle;
  std::map<std::string, std::vector<std::string>> skipped;  // by the reason
  for (const KnobResult& knob : tradeoff.knobs) {
    if (!knob.skipped.empty()) {
      skipped[knob.skipped].push_back(knob.name);
    } else if (knob.idle) {
      idle.push_back(knob.name);
    } else {
      text += fmt::format("\n{} ({}{}), {} {}\n{}", knob.title, knob.name,
                          knob.context.empty() ? "" : ", with " + knob.context, knob.settings.size(),
                          knob.combines ? "combinations" : "settings", knob_table(knob, all));
    }
  }
  if (!idle.empty() || !skipped.empty()) text += "\n";
  if (!idle.empty())
    text += fmt::format("without effect here, the same image at the same cost: {}\n", fmt::join(idle, ", "));
  for (const auto& [reason, names] : skipped)
    text += fmt::format("left out, because {}: {}\n", reason, fmt::join(names, ", "));
  return text + fmt::format("\n> the configuration asked for   * on the front of error (FLIP) against ms{}\n",
                            all ? "" : "   --all: every setting, with its costs in words");
}

}  // namespace tessera::replay

#include "replay/tradeoff/tradeoff_words.h"

#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace tessera::replay {
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
    return !b ? "equals the reference" : fmt::format("differs from the reference, which {} does not", other);
  const double gain = *b - *a;
  if (std::abs(gain) < 0.005) return fmt::format("less than 0.01 dB from {}", other);
  return gain < 0 ? fmt::format("costs {:.2f} dB against {}", -gain, other)
                  : fmt::format("gains {:.2f} dB over {}", gain, other);
}

std::string whole_or_dash(const std::optional<std::uint64_t>& value) { return value ? std::to_string(*value) : "-"; }

std::string table_row(const SettingResult& setting) {
  const Measurement& m = setting.measured;
  return fmt::format(
      "{}{}{:<36} {:>8} {:>8.5f} {:>8.5f} {:>7.4f} {:>11} {:>12} {:>12} {:>9.3f} {:>7.3f} ({:.2f}-{:.2f})\n",
      setting.is_base ? '>' : ' ', setting.on_front(Cost::kCycles).value_or(false) ? '*' : ' ', setting.label,
      m.error->psnr_db ? fmt::format("{:.2f}", *m.error->psnr_db) : "equal", m.error->ssim, m.error->flip,
      m.error->max_error, whole_or_dash(m.cycles), whole_or_dash(m.dram_bytes),
      m.energy_nj ? fmt::format("{:.1f}", *m.energy_nj * 1e-3) : "-", m.processor_seconds.median, m.wall_seconds.median,
      m.wall_seconds.low, m.wall_seconds.high);
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
    return fmt::format("{}: what the others are compared with", setting.label);
  std::vector<std::string> costs;
  if (!watched_as.empty()) costs.push_back(change(as_number(now.watched), as_number(before.watched), watched_as));
  costs.push_back(change(now.cycles, before.cycles, "cycles"));
  costs.push_back(change(now.dram_bytes, before.dram_bytes, "memory traffic"));
  costs.push_back(change(now.energy_nj, before.energy_nj, "energy"));
  std::erase(costs, "");
  return fmt::format("{}: {}; {}", setting.label, error_change(setting, against),
                     !now.cycles     ? "no machine, no cycles"
                     : costs.empty() ? "costs the same"
                                     : fmt::format("{}", fmt::join(costs, ", ")));
}

std::string tradeoff_table(const TradeoffResult& tradeoff) {
  std::string text;
  for (const KnobResult& knob : tradeoff.knobs) {
    text += fmt::format("\n{} ({}{})\n", knob.title, knob.name, knob.context.empty() ? "" : ", with " + knob.context);
    if (!knob.skipped.empty()) {
      text += fmt::format("  left out: {}\n", knob.skipped);
      continue;
    }
    if (knob.idle) {
      text += "  without effect here: all of its settings give the same image at the same cost\n";
      continue;
    }
    if (knob.timed) {
      text += timed_table(knob);
      continue;
    }
    text += fmt::format("  {:<36} {:>8} {:>8} {:>8} {:>7} {:>11} {:>12} {:>12} {:>9} {:>15}\n", "setting", "PSNR dB",
                        "SSIM", "FLIP", "max", "cycles", "DRAM bytes", "energy uJ", "CPU s", "wall s (spread)");
    for (const SettingResult& setting : knob.settings) text += table_row(setting);
    for (const SettingResult& setting : knob.settings) text += fmt::format("    {}\n", setting.says);
  }
  return text + "\n> the configuration asked for   * on the front of error (FLIP) against cycles\n";
}

}  // namespace tessera::replay

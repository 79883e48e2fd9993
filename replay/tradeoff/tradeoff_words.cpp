#include "replay/tradeoff/tradeoff_words.h"

#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/text.h"
#include "replay/tradeoff/tradeoff.h"

namespace tessera::replay {
namespace {

using nlohmann::json;

// "saves 12.0 % of cycles", "takes 3.1 % more cycles", "takes 2.40 times the cycles"; "" for less than 0.05 %.
std::string change(const json& row, const json& against, const std::string& member, const std::string& name) {
  if (row.at(member).is_null() || against.at(member).is_null()) return "";
  const double a = against.at(member).get<double>(), b = row.at(member).get<double>();
  if (a == 0 && b == 0) return "";
  if (a == 0) return fmt::format("takes {:.0f} {} where there were none", b, name);
  const double share = b / a - 1;
  if (std::abs(share) < 0.0005) return "";
  if (share >= 1) return fmt::format("takes {:.2f} times the {}", b / a, name);
  return share < 0 ? fmt::format("saves {:.1f} % of {}", -100 * share, name)
                   : fmt::format("takes {:.1f} % more {}", 100 * share, name);
}

std::string error_change(const json& row, const json& against) {
  const std::string other = against.at("label");
  if (row.at("picture") == against.at("picture")) return fmt::format("the same image as {}", other);
  const json &a = against.at("error").at("psnr_db"), &b = row.at("error").at("psnr_db");
  if (a.is_null() || b.is_null())
    return b.is_null() ? "equals the reference" : fmt::format("differs from the reference, which {} does not", other);
  const double gain = b.get<double>() - a.get<double>();
  if (std::abs(gain) < 0.005) return fmt::format("less than 0.01 dB from {}", other);
  return gain < 0 ? fmt::format("costs {:.2f} dB against {}", -gain, other)
                  : fmt::format("gains {:.2f} dB over {}", gain, other);
}

std::string psnr_text(const json& error) {
  return error.at("psnr_db").is_null() ? "equal" : fmt::format("{:.2f}", error.at("psnr_db").get<double>());
}

std::string number_or_dash(const json& value) {
  return value.is_null() ? "-" : value.is_number_float() ? fmt::format("{:.0f}", value.get<double>()) : value.dump();
}

std::string csv_cell(const json& value) {
  if (value.is_null()) return "";
  if (!value.is_string()) return value.dump();
  const std::string& text = value.get_ref<const std::string&>();
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

}  // namespace

std::string setting_in_words(const json& row, const json& against, const json& knob) {
  std::vector<std::string> costs;
  const std::string watched_as = knob.at("watched_as");
  if (!watched_as.empty()) costs.push_back(change(row, against, "watched", watched_as));
  costs.push_back(change(row, against, "cycles", "cycles"));
  costs.push_back(change(row, against, "dram_bytes", "memory traffic"));
  costs.push_back(change(row, against, "energy_nj", "energy"));
  std::erase(costs, "");
  if (row == against || (row.at("label") == against.at("label") && row.at("picture") == against.at("picture")))
    return fmt::format("{}: what the others are compared with", row.at("label").get<std::string>());
  const bool machine = !row.at("cycles").is_null();
  return fmt::format("{}: {}; {}", row.at("label").get<std::string>(), error_change(row, against),
                     !machine        ? "no machine, no cycles"
                     : costs.empty() ? "costs the same"
                                     : fmt::format("{}", fmt::join(costs, ", ")));
}

std::string tradeoff_table(const json& tradeoff) {
  std::string text;
  for (const json& knob : tradeoff.at("knobs")) {
    const std::string context = knob.at("context");
    text += fmt::format("\n{} ({}{})\n", knob.at("title").get<std::string>(), knob.at("name").get<std::string>(),
                        context.empty() ? "" : ", with " + context);
    if (const std::string skipped = knob.at("skipped"); !skipped.empty()) {
      text += fmt::format("  left out: {}\n", skipped);
      continue;
    }
    if (knob.at("idle").get<bool>()) {
      text += "  without effect here: all of its settings give the same image at the same cost\n";
      continue;
    }
    text += fmt::format("  {:<36} {:>8} {:>8} {:>8} {:>7} {:>11} {:>12} {:>12} {:>9} {:>15}\n", "setting", "PSNR dB",
                        "SSIM", "FLIP", "max", "cycles", "DRAM bytes", "energy uJ", "CPU s", "wall s (spread)");
    for (const json& row : knob.at("settings")) {
      const json &error = row.at("error"), &host = row.at("host");
      text += fmt::format(
          "{}{}{:<36} {:>8} {:>8.5f} {:>8.5f} {:>7.4f} {:>11} {:>12} {:>12} {:>9.3f} {:>7.3f} ({:.2f}-{:.2f})\n",
          row.at("base").get<bool>() ? '>' : ' ', row.at("front").value("cycles", false) ? '*' : ' ',
          row.at("label").get<std::string>(), psnr_text(error), error.at("ssim").get<double>(),
          error.at("flip").get<double>(), error.at("max_error").get<double>(), number_or_dash(row.at("cycles")),
          number_or_dash(row.at("dram_bytes")),
          row.at("energy_nj").is_null() ? "-" : fmt::format("{:.1f}", row.at("energy_nj").get<double>() * 1e-3),
          host.at("processor_seconds").at("median").get<double>(), host.at("seconds").at("median").get<double>(),
          host.at("seconds").at("low").get<double>(), host.at("seconds").at("high").get<double>());
    }
    for (const json& row : knob.at("settings")) text += fmt::format("    {}\n", row.at("says").get<std::string>());
  }
  return text + "\n> the configuration asked for   * on the front of error (FLIP) against cycles\n";
}

std::string tradeoff_csv(const json& tradeoff) {
  std::string text =
      "knob,setting,arguments,base,psnr_db,ssim,flip,max_error,cycles,dram_bytes,energy_nj,watched,watched_value,front_"
      "cycles,front_dram_bytes,front_energy_nj,says,";
  text +=
      "seconds_median,seconds_low,seconds_high,processor_seconds_median,processor_seconds_low,processor_seconds_high\n";
  for (const json& knob : tradeoff.at("knobs"))
    for (const json& row : knob.at("settings")) {
      const json &error = row.at("error"), &host = row.at("host"), &front = row.at("front");
      std::vector<json> cells = {knob.at("name"),
                                 row.at("label"),
                                 row.at("arguments"),
                                 row.at("base"),
                                 error.at("psnr_db"),
                                 error.at("ssim"),
                                 error.at("flip"),
                                 error.at("max_error"),
                                 row.at("cycles"),
                                 row.at("dram_bytes"),
                                 row.at("energy_nj"),
                                 knob.at("watched"),
                                 row.at("watched"),
                                 front.value("cycles", json()),
                                 front.value("dram_bytes", json()),
                                 front.value("energy_nj", json()),
                                 row.at("says")};
      for (const char* clock : {"seconds", "processor_seconds"})
        for (const char* which : {"median", "low", "high"}) cells.push_back(host.at(clock).at(which));
      for (std::size_t c = 0; c < cells.size(); ++c) text += (c == 0 ? "" : ",") + csv_cell(cells[c]);
      text += "\n";
    }
  return text;
}

}  // namespace tessera::replay

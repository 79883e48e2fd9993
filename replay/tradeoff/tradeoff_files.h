#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "replay/tradeoff/results.h"

namespace tessera::replay {

// The question of --max-flip and --min-psnr with its answer, and the setting that is nearest to being good enough.
struct CheapestAnswer {
  CheapestWanted wanted;
  std::optional<CheapestSetting> found, missed;
};

// {"schema": "tessera.tradeoff/1", "capture", "frame", "first_frame", "size", "rounds", "arguments", "settings", "gpu",
//  "gpu_name", "reference": reference_info_json(), or null where all knobs are "timed",
//  "knobs": [{"name", "title", "context", "against", "visual", "watched", "watched_as", "skipped": reason or "",
//     "timed": whether it is about how a frame is timed; its settings have "cycles_error" and "energy_error" against the
//     finest, no fronts, and null for "error", "idle": whether all settings gave the same image at the same cost, "settings": [
//     {"label", "arguments", "base": whether this is the configuration that was asked for, "in_double", "error",
//      "picture", "ms", "cycles", "dram_bytes", "energy_nj", "watched", "same_picture": as `against`, "front": {"ms",
//      "dram_bytes", "mj"}, "says": one line, "host": {"seconds": {"median", "low", "high"},
//      "processor_seconds": {...}, "front_seconds", "front_processor_seconds"}}]}],
//  "effects": [{"name", "ran", "reason", "sub_patches", "tiles", "counters": {of its work}, "without": how it is left out,
//     "stays": why it could not be, or "", "setting": its row of the knob "effects", or null}],   with --effects
//  "stopped": whether a signal ended it early,
//  "cheapest": {"cost", "max_flip", "min_psnr", "setting": as above with its "knob", or null, "missed": likewise}}   where it was asked for
// The last knob is "joint" where knobs were turned together.
nlohmann::json tradeoff_json(const TradeoffResult& tradeoff, const std::optional<CheapestAnswer>& cheapest);

// For spreadsheets: a row per knob and setting.
std::string tradeoff_csv(const TradeoffResult& tradeoff);

// tradeoff.csv, tradeoff.json and, with --effects, effects.csv, each whole or not at all. Throws WriteError.
void write_tradeoff(const std::filesystem::path& folder, const TradeoffResult& tradeoff,
                    const std::optional<CheapestAnswer>& cheapest);

// One line that compares a setting with the one of its knob's `against`: its cost or gain in decibels, and the changes
// of cycles, bytes, energy and the watched figure (`watched_as`; "" for none). It uses figures of the emulated machine
// alone, because host times differ from run to run.
//   "bilinear: costs 0.58 dB against cubic; saves 1.0 % of resolve cycles"
std::string setting_in_words(const SettingResult& setting, const SettingResult& against, const std::string& watched_as);

// The answer in at most ten lines: the cheapest setting compared with the requested configuration, and the nearest
// miss.
std::string cheapest_text(const TradeoffResult& tradeoff, const CheapestAnswer& answer);

// Whether no other setting of its knob beats it in error and time, or it is the requested configuration.
bool decides(const SettingResult& setting);

// The settings of each knob that decide, for people, after judge(): the ones on its front, and the requested one. `all`
// adds beaten settings, and the sentence about each.
std::string tradeoff_table(const TradeoffResult& tradeoff, bool all);

}  // namespace tessera::replay

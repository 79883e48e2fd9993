#pragma once

#include <string>

#include "replay/tradeoff/results.h"

namespace tessera::replay {

// One line about a setting beside the one that its knob compares with: what it costs or gains in decibels, and by how
// much cycles, bytes, energy and what the knob watches (`watched_as`; "" for nothing) change. From figures of the
// emulated machine alone: host times differ from run to run.
//   "bilinear: costs 0.58 dB against cubic; saves 1.0 % of resolve cycles"
std::string setting_in_words(const SettingResult& setting, const SettingResult& against, const std::string& watched_as);

// All knobs for people, after judge().
std::string tradeoff_table(const TradeoffResult& tradeoff);

}  // namespace tessera::replay

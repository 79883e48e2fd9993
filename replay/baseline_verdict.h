#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "baselines/baseline_set.h"

namespace tessera::replay {

// Which scheme wins by how much: {"sentence": "...", "against": {"shipped": {...}, "idealised": {...}}}. For each kind
// of baseline it names the best one by each measure, "dram_bytes" and, where the machine was timed, "cycles" and
// "energy_nj": {"scheme", "value", "ratio": tessera's value over this one}.
nlohmann::json baseline_verdict_json(const baselines::BaselineSet& set);

// A table for people, a row per scheme, sorted by cycles, or by bytes where the machine was not timed. Tessera's row is
// marked, and ratios are relative to it. Ends with the sentence. `set`: sums over `frames`.
std::string baseline_verdict_text(const baselines::BaselineSet& set, double clock_mhz, double frames);

}  // namespace tessera::replay

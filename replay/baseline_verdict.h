#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "baselines/baseline_set.h"

namespace tessera::replay {

// Who wins what by how much: {"sentence": "...", "against": {"shipped": {...}, "idealised": {...}}}. Of each kind the best
// baseline in each measure, "cycles" and "energy_nj" where the machine was timed and "dram_bytes": {"scheme", "value",
// "ratio": tessera's value by its}.
nlohmann::json baseline_verdict_json(const baselines::BaselineSet& set);

// A table for people, a row per scheme: by cycles, or by bytes where the machine was not timed; tessera's row is marked, and
// ratios are to it. Ends with the sentence. `set`: sums over `frames`.
std::string baseline_verdict_text(const baselines::BaselineSet& set, double clock_mhz, double frames);

}  // namespace tessera::replay

#pragma once

#include <array>
#include <cstdio>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "gpu/configuration.h"
#include "timing/work.h"

namespace tessera::replay {

// What a frame's cycles, energy and verdict hang on: its record timed again with each number that timing reads at both
// ends of what it may be (key_ends(), base/key_table.h), one number at a time.

// Of one number.
struct Influence {
  std::string key;
  bool assumed = false;  // nobody publishes it, in whole or in part
  double value = 0;
  std::array<double, 2> ends{};              // low, high
  std::array<double, 2> cycles{}, energy{};  // over those of the machine as it is
  std::array<std::string, 2> bound_by;       // as before where neither cycles nor energy change by kWorthSaying
  static constexpr double kWorthSaying = 0.005;

  double most() const;  // of the four ratios, away from 1
};

// How far all assumed numbers together may move a sum, each within its ends and independent of the others: the roots of
// the sums of squares of what each takes away and adds.
struct Uncertainty {
  double down = 0, up = 0;  // parts of the sum
};

struct Sensitivity {
  std::string bound_by;            // of the machine as it is
  std::vector<Influence> numbers;  // those with the most influence first
  Uncertainty cycles, energy;

  // Assumed numbers with which something else bounds the frame.
  std::vector<std::string> verdict_hangs_on() const;
};

// Of a frame's views, on caches that are empty.
Sensitivity measure_sensitivity(const gpu::GpuConfiguration& machine, const std::vector<timing::FrameWork>& views);

void print_sensitivity(std::FILE* words, const Sensitivity& sensitivity);

// {"bound_by", "verdict_hangs_on": [keys], "cycles": [down, up], "energy": [down, up],
//  "numbers": [{"key", "assumed", "value", "ends", "cycles", "energy", "bound_by"}]}
nlohmann::json sensitivity_json(const Sensitivity& sensitivity);

}  // namespace tessera::replay

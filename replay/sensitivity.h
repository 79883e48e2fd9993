#pragma once

#include <array>
#include <cstdio>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "gpu/configuration.h"
#include "timing/work.h"

namespace tessera::replay {

// Sensitivity of a frame's cycles, energy and verdict: its record is timed again with each number that timing reads at
// both ends of its plausible range (key_ends(), base/key_table.h), one number at a time.

// The influence of one number.
struct Influence {
  std::string key;
  bool assumed = false;  // not published, in whole or in part
  double value = 0;
  std::array<double, 2> ends{};              // low, high
  std::array<double, 2> cycles{}, energy{};  // over the unchanged machine's
  std::array<std::string, 2> bound_by;       // unchanged where neither cycles nor energy change by kWorthSaying
  static constexpr double kWorthSaying = 0.005;

  double most() const;  // the largest of the four changes of the ratios from 1
};

// Combined effect of all assumed numbers on a sum, with each number within its ends and independent of the others: the
// roots of the sums of squares of the individual decreases and increases.
struct Uncertainty {
  double down = 0, up = 0;  // parts of the sum
};

struct Sensitivity {
  std::string bound_by;            // bound of the unchanged machine
  std::vector<Influence> numbers;  // sorted by influence, the largest first
  Uncertainty cycles, energy;

  // Assumed numbers that change which unit bounds the frame.
  std::vector<std::string> verdict_hangs_on() const;
};

// Measures the views of a frame, beginning with empty caches.
Sensitivity measure_sensitivity(const gpu::GpuConfiguration& machine, const std::vector<timing::FrameWork>& views);

void print_sensitivity(std::FILE* words, const Sensitivity& sensitivity);

// {"bound_by", "verdict_hangs_on": [keys], "cycles": [down, up], "energy": [down, up],
//  "numbers": [{"key", "assumed", "value", "ends", "cycles", "energy", "bound_by"}]}
nlohmann::json sensitivity_json(const Sensitivity& sensitivity);

}  // namespace tessera::replay

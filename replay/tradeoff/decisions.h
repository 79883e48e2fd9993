#pragma once

#include <optional>
#include <string>
#include <vector>

#include "replay/tradeoff/results.h"

namespace tessera::replay {

// What a setting is judged by, from its trial on a machine of that clock. `watched`: a name among the figures; "" for none.
// A figure that is not there is 0.
Measurement measurement_of(const TrialResult& trial, const std::string& watched, double clock_mhz);

// Nothing where there is none (cycles of what ran in double). Of host times the median.
std::optional<double> cost_of(const Measurement& measured, Cost cost);

// Which of the points no other one beats: none has both numbers as small and one of them smaller.
struct ErrorAndCost {
  double error, cost;
};
std::vector<bool> pareto_front(const std::vector<ErrorAndCost>& points);

// Fills what follows from the measurements of all settings: fronts of mean FLIP against every cost (TO2), whether the
// knob is idle here, and what is said of each setting.
void judge(KnobResult& knob);

// The setting of the machine with the least cost among those that are good enough; nothing when none is. Ties: the
// smaller error, then the first.
std::optional<CheapestSetting> cheapest(const std::vector<KnobResult>& knobs, const CheapestWanted& wanted);

// Decibels by which an error is too large, 0 where it is good enough: FLIP counts as an amplitude.
double shortfall_db(const ImageError& error, const CheapestWanted& wanted);

// The setting with the least shortfall among those that are not good enough. Ties: the smaller cost, then the first.
std::optional<CheapestSetting> nearest_miss(const std::vector<KnobResult>& knobs, const CheapestWanted& wanted);

}  // namespace tessera::replay

#pragma once

#include <optional>
#include <string>
#include <vector>

#include "replay/tradeoff/results.h"

namespace tessera::replay {

// The quantities by which a setting is judged, from its trial on a machine with that clock. `watched`: a name among the
// figures; "" for none. A missing figure is 0.
Measurement measurement_of(const TrialResult& trial, const std::string& watched, double clock_mhz);

// Nothing where there is none (cycles of a trial in double precision). Of host times it is the median.
std::optional<double> cost_of(const Measurement& measured, Cost cost);

// Returns which points are on the front: no other point has both numbers as small and one of them smaller.
struct ErrorAndCost {
  double error, cost;
};
std::vector<bool> pareto_front(const std::vector<ErrorAndCost>& points);

// Fills the results that need the measurements of all settings: fronts of mean FLIP against every cost (TO2), whether
// the knob is idle here, and the sentence about each setting.
void judge(KnobResult& knob);

// The machine's setting with the least cost among the good-enough ones; nothing when there is none. Ties: the smaller
// error, then the first.
std::optional<CheapestSetting> cheapest(const std::vector<KnobResult>& knobs, const CheapestWanted& wanted);

// Decibels by which an error is too large, 0 where it is good enough: FLIP counts as an amplitude.
double shortfall_db(const ImageError& error, const CheapestWanted& wanted);

// The setting with the least shortfall among the ones that are not good enough. Ties: the smaller cost, then the first.
std::optional<CheapestSetting> nearest_miss(const std::vector<KnobResult>& knobs, const CheapestWanted& wanted);

}  // namespace tessera::replay

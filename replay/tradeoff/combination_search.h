#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "replay/tradeoff/results.h"

namespace tessera::replay {

// Finds the cheapest combination of settings that is good enough without trying all of them. Costs and errors of an
// untried combination are estimated from the measured ones that share most settings with it: costs by the ratios,
// squared errors and FLIP by the differences that the settings make alone.
//
// Invariants (cited by the tests):
//   CSE1  No combination is proposed twice, nor one whose settings were all measured alone.
//   CSE2  Where costs multiply and squared errors add up, the result is the cheapest combination that is good enough.
class CombinationSearch {
 public:
  // Knobs whose settings were measured alone, with the other knobs at `against`. Settings in double precision are left
  // out.
  CombinationSearch(const std::vector<KnobResult>& knobs, const CheapestWanted& wanted);

  using Combination = std::vector<std::size_t>;  // per knob: the number of its setting

  // The combination to try next: the cheapest that should be good enough and cheaper than the best so far; while none
  // was good enough, the one that should miss by least. Nothing when no such combination is left.
  std::optional<Combination> next() const;
  void add(const Combination& tried, const Measurement& measured);

  bool found() const { return best_.has_value(); }  // a good-enough combination

 private:
  // Squared error, FLIP and cost.
  struct Outcome {
    double squared = 0, flip = 0, cost = 0;
  };
  struct Tried {
    Combination settings;
    Outcome outcome;
  };
  Outcome outcome_of(const Measurement& measured) const;
  Outcome guess(const Combination& settings) const;
  double shortfall(const Outcome& outcome) const;

  CheapestWanted wanted_;
  std::vector<std::vector<Outcome>> alone_;  // by knob and setting
  std::vector<Combination> all_;
  std::vector<Tried> tried_;
  std::optional<double> best_;  // cost of the best good-enough combination
};

}  // namespace tessera::replay

#include "replay/tradeoff/combination_search.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "replay/tradeoff/decisions.h"

namespace tessera::replay {
namespace {

constexpr double kLeastSquared = 1e-12;  // stands for the squared error of an image that equals the reference
constexpr double kLeastShare = 0.1;      // least share of an error that settings are assumed to leave

}  // namespace

CombinationSearch::CombinationSearch(const std::vector<KnobResult>& knobs, const CheapestWanted& wanted)
    : wanted_(wanted), all_(1) {
  Combination base;
  for (const KnobResult& knob : knobs) {
    base.push_back(knob.against);
    std::vector<Outcome>& outcomes = alone_.emplace_back();
    std::vector<Combination> longer;
    for (std::size_t s = 0; s < knob.settings.size(); ++s) {
      outcomes.push_back(outcome_of(knob.settings[s].measured));
      if (knob.settings[s].in_double) continue;
      for (Combination settings : all_) {
        settings.push_back(s);
        longer.push_back(std::move(settings));
      }
    }
    all_ = std::move(longer);
  }
  for (std::size_t k = 0; k < knobs.size(); ++k)
    for (std::size_t s = 0; s < knobs[k].settings.size(); ++s) {
      Combination settings = base;
      settings[k] = s;
      if (!knobs[k].settings[s].in_double) add(settings, knobs[k].settings[s].measured);
    }
}

CombinationSearch::Outcome CombinationSearch::outcome_of(const Measurement& measured) const {
  const std::optional<double> psnr = measured.error->psnr_db;
  return {psnr ? std::pow(10.0, -0.1 * *psnr) : kLeastSquared, measured.error->flip,
          cost_of(measured, wanted_.cost).value_or(std::numeric_limits<double>::infinity())};
}

double CombinationSearch::shortfall(const Outcome& outcome) const {
  ImageError error;
  error.psnr_db = -10 * std::log10(outcome.squared);
  error.flip = outcome.flip;
  return shortfall_db(error, wanted_);
}

void CombinationSearch::add(const Combination& tried, const Measurement& measured) {
  std::erase(all_, tried);
  const Outcome outcome = outcome_of(measured);
  tried_.push_back({tried, outcome});
  if (shortfall(outcome) == 0 && (!best_ || outcome.cost < *best_)) best_ = outcome.cost;
}

// The mean over the nearest.
CombinationSearch::Outcome CombinationSearch::guess(const Combination& settings) const {
  std::size_t nearest = settings.size() + 1;
  double count = 0;
  Outcome sum;
  for (const Tried& from : tried_) {
    std::size_t differ = 0;
    for (std::size_t k = 0; k < settings.size(); ++k) differ += settings[k] != from.settings[k] ? 1 : 0;
    if (differ > nearest) continue;
    if (differ < nearest) nearest = differ, count = 0, sum = {};
    Outcome at = from.outcome;
    for (std::size_t k = 0; k < settings.size(); ++k) {
      const Outcome &before = alone_[k][from.settings[k]], &now = alone_[k][settings[k]];
      at.squared += now.squared - before.squared;
      at.flip += now.flip - before.flip;
      if (before.cost > 0) at.cost *= now.cost / before.cost;
    }
    sum.squared += std::max(at.squared, kLeastShare * from.outcome.squared);
    sum.flip += std::max(at.flip, kLeastShare * from.outcome.flip);
    sum.cost += at.cost;
    ++count;
  }
  return {sum.squared / count, sum.flip / count, sum.cost / count};
}

std::optional<CombinationSearch::Combination> CombinationSearch::next() const {
  const Combination* found = nullptr;
  std::pair<double, double> least;
  for (const Combination& settings : all_) {
    const Outcome outcome = guess(settings);
    const double missing = shortfall(outcome);
    if (best_ && (missing > 0 || outcome.cost >= *best_)) continue;
    const std::pair<double, double> rank(missing, outcome.cost);
    if (found != nullptr && rank >= least) continue;
    found = &settings, least = rank;
  }
  return found == nullptr ? std::nullopt : std::optional(*found);
}

}  // namespace tessera::replay

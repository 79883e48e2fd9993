#include "replay/sweep/unit_samples.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "base/check.h"

namespace tessera::replay {

bool Score::better_than(const Score& other) const {
  return violation != other.violation ? violation < other.violation : objective < other.objective;
}

DifferentialEvolution::DifferentialEvolution(std::size_t dimensions, std::size_t population, std::uint64_t seed)
    : numbers_(seed ^ 0x6a09e667f3bcc908u),
      candidates_(unit_samples(SampleMethod::kLatinHypercube, population, dimensions, seed)) {
  TESSERA_CHECK(population >= 4 && dimensions >= 1, "a mutant has a target and three others");
}

std::vector<double> DifferentialEvolution::mutant_of(std::size_t target) {
  std::array<std::size_t, 3> others{};
  for (std::size_t k = 0; k < others.size(); ++k) {
    const auto taken = [&](std::size_t member) {
      return member == target || std::find(others.begin(), others.begin() + k, member) != others.begin() + k;
    };
    do others[k] = numbers_.below(members_.size());
    while (taken(others[k]));
  }
  const std::vector<double>&base = members_[others[0]], &plus = members_[others[1]], &minus = members_[others[2]];
  std::vector<double> mutant = members_[target];
  const std::size_t always = numbers_.below(mutant.size());  // at least one coordinate is not the target's
  for (std::size_t d = 0; d < mutant.size(); ++d) {
    if (const bool crosses = numbers_.fraction() < kCrossover; !crosses && d != always) continue;
    double at = base[d] + kWeight * (plus[d] - minus[d]);
    if (at < 0) at = base[d] / 2;
    if (at >= 1) at = (base[d] + 1) / 2;
    mutant[d] = std::min(at, std::nextafter(1.0, 0.0));
  }
  return mutant;
}

void DifferentialEvolution::tell(std::span<const Score> scores) {
  TESSERA_CHECK(scores.size() == candidates_.size(), "a score for each candidate");
  if (members_.empty()) {
    members_ = candidates_;
    scores_.assign(scores.begin(), scores.end());
  } else {
    // An equal score suffices: so the population crosses level ground.
    for (std::size_t i = 0; i < members_.size(); ++i)
      if (!scores_[i].better_than(scores[i])) {
        members_[i] = candidates_[i];
        scores_[i] = scores[i];
      }
  }
  for (std::size_t i = 0; i < members_.size(); ++i) candidates_[i] = mutant_of(i);
}

namespace {

// The fraction may round up to the interval's end.
double within_interval(std::size_t interval, double fraction, std::size_t count) {
  const double n = static_cast<double>(count), begin = static_cast<double>(interval) / n,
               end = static_cast<double>(interval + 1) / n;
  return std::clamp((static_cast<double>(interval) + fraction) / n, begin, std::nextafter(end, 0.0));
}

}  // namespace

std::uint64_t SeededNumbers::whole() {
  state_ += 0x9e3779b97f4a7c15u;
  std::uint64_t z = state_;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

std::string_view name(SampleMethod method) { return method == SampleMethod::kRandom ? "random" : "latin_hypercube"; }

std::vector<std::vector<double>> unit_samples(SampleMethod method, std::size_t count, std::size_t dimensions,
                                              std::uint64_t seed) {
  std::vector<std::vector<double>> points(count, std::vector<double>(dimensions));
  SeededNumbers numbers(seed);
  std::vector<std::size_t> intervals(count);
  for (std::size_t d = 0; d < dimensions; ++d) {
    std::iota(intervals.begin(), intervals.end(), std::size_t{0});
    // Fisher and Yates; std::shuffle differs between libraries.
    if (method == SampleMethod::kLatinHypercube)
      for (std::size_t i = count; i > 1; --i) std::swap(intervals[i - 1], intervals[numbers.below(i)]);
    for (std::size_t i = 0; i < count; ++i)
      points[i][d] = method == SampleMethod::kRandom ? numbers.fraction()
                                                     : within_interval(intervals[i], numbers.fraction(), count);
  }
  return points;
}

}  // namespace tessera::replay

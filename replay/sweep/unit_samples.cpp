#include "replay/sweep/unit_samples.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace tessera::replay {
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

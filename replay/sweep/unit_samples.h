#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace tessera::replay {

// Whole numbers and fractions that follow from a seed alone, on every platform: splitmix64 (Steele, Lea and Flood 2014).
class SeededNumbers {
 public:
  explicit SeededNumbers(std::uint64_t seed) : state_(seed) {}
  std::uint64_t whole();
  // In [0, 1), a multiple of 2^-53.
  double fraction() { return static_cast<double>(whole() >> 11) * 0x1p-53; }
  // In [0, count); the bias of the remainder is below count / 2^64.
  std::size_t below(std::size_t count) { return static_cast<std::size_t>(whole() % count); }

 private:
  std::uint64_t state_;
};

enum class SampleMethod : std::uint8_t { kRandom, kLatinHypercube };
std::string_view name(SampleMethod method);

// `count` points of the unit cube of so many dimensions, each coordinate in [0, 1). Random: independent of each other.
// Latin hypercube (McKay, Beckman and Conover 1979):
//   LH1  Along every dimension each of the `count` intervals [k/count, (k+1)/count) holds exactly one point.
std::vector<std::vector<double>> unit_samples(SampleMethod method, std::size_t count, std::size_t dimensions,
                                              std::uint64_t seed);

}  // namespace tessera::replay

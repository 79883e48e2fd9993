#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tessera::replay {

// Whole numbers and fractions that depend on a seed alone, on every platform: splitmix64 (Steele, Lea and Flood 2014).
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

// How good a candidate is: less is better. `violation` is the sum of the amounts by which limits are missed, each as a
// part of its limit; 0 where all are met, infinite where there is no such machine.
struct Score {
  double objective = 0, violation = 0;

  // Deb's rules (2000): a candidate that meets the constraints is better than one that does not; of two that do, the
  // one with the lower objective; of two that do not, the one with the lower violation.
  bool better_than(const Score& other) const;
};

// Differential evolution, DE/rand/1/bin (Storn and Price 1997), over the unit cube [0, 1)^dimensions, with F = 0.8 and
// CR = 0.9. It differs from the paper in three points: the first generation is a Latin hypercube; a coordinate of a
// mutant that leaves the cube is put halfway between its base and the face; and Score::better_than() decides which one
// survives.
//
//   ask() -> candidates of a generation, as many as the population -> tell(their scores) -> ask() ...
//
// Invariants (cited by the tests):
//   DE1  The candidates of ask() depend on the seed and on the scores of tell(), and on nothing else.
//   DE2  All candidates lie in the cube.
//   DE3  A member of the population is never replaced by a worse one.
class DifferentialEvolution {
 public:
  // At least 4 members: a mutant has a target and three others. At least one dimension.
  DifferentialEvolution(std::size_t dimensions, std::size_t population, std::uint64_t seed);

  const std::vector<std::vector<double>>& ask() const { return candidates_; }
  // One score for each candidate of ask().
  void tell(std::span<const Score> scores);

  const std::vector<std::vector<double>>& population() const { return members_; }
  std::span<const Score> scores() const { return scores_; }

 private:
  std::vector<double> mutant_of(std::size_t target);

  static constexpr double kWeight = 0.8, kCrossover = 0.9;
  SeededNumbers numbers_;
  std::vector<std::vector<double>> candidates_, members_;
  std::vector<Score> scores_;  // of members_
};

}  // namespace tessera::replay

#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "replay/sweep/unit_samples.h"

namespace tessera::replay {

// How good a candidate is: less is better. `violation` sums by how much its constraints are missed, each as a part of
// its limit; 0 where all are met, infinite where there is no such machine.
struct Score {
  double objective = 0, violation = 0;

  // Deb's rules (2000): what meets the constraints is better than what does not; of two that do, the one with the lower
  // objective, of two that do not, the one with the lower violation.
  bool better_than(const Score& other) const;
};

// Differential evolution, DE/rand/1/bin (Storn and Price 1997), over the unit cube [0, 1)^dimensions, with F = 0.8 and
// CR = 0.9. Of the paper it differs in three things: the first generation is a Latin hypercube; a coordinate of a mutant
// that leaves the cube is put halfway between its base and the face; and Score::better_than() decides who survives.
//
//   ask() -> candidates of a generation, as many as the population -> tell(their scores) -> ask() ...
//
// Invariants (cited by the tests):
//   DE1  What is asked follows from the seed and from the scores told, and from nothing else.
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

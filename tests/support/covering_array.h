#pragma once

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace tessera::test {

// One choice for every factor: row[f] < levels[f].
using Choices = std::vector<std::size_t>;

// Rows among which every two factors take every pair of their levels: a few rows in place of the whole product. Each
// new row is the row of the product that has most missing pairs, the first of several; so the result is always the
// same. Meant for products of at most some thousands.
//
// Invariant (cited by the tests):
//   CA1  missing_pairs(levels, covering_array(levels)) is empty.
std::vector<Choices> covering_array(std::span<const std::size_t> levels);

// The whole product, the last factor fastest.
std::vector<Choices> whole_product(std::span<const std::size_t> levels);

// Pairs of choices, as {factor, level} twice, that no row holds.
using Choice = std::pair<std::size_t, std::size_t>;
std::vector<std::pair<Choice, Choice>> missing_pairs(std::span<const std::size_t> levels,
                                                     std::span<const Choices> rows);

}  // namespace tessera::test

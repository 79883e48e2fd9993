#include "tests/support/covering_array.h"
#include "tests/support/tests.h"

namespace tessera::test {
namespace {

using Pair = std::pair<Choice, Choice>;

// Calls `see` with every pair of a row's choices.
template <class See>
void for_each_pair(const Choices& row, const See& see) {
  for (std::size_t a = 0; a < row.size(); ++a)
    for (std::size_t b = a + 1; b < row.size(); ++b) see(Pair{{a, row[a]}, {b, row[b]}});
}

}  // namespace

std::vector<Choices> whole_product(std::span<const std::size_t> levels) {
  std::vector<Choices> rows = {{}};
  for (const std::size_t count : levels) {
    std::vector<Choices> longer;
    for (const Choices& row : rows)
      for (std::size_t level = 0; level < count; ++level) {
        longer.push_back(row);
        longer.back().push_back(level);
      }
    rows = std::move(longer);
  }
  return rows;
}

std::vector<std::pair<Choice, Choice>> missing_pairs(std::span<const std::size_t> levels,
                                                     std::span<const Choices> rows) {
  std::set<Pair> missing;
  for (std::size_t a = 0; a < levels.size(); ++a)
    for (std::size_t b = a + 1; b < levels.size(); ++b)
      for (std::size_t i = 0; i < levels[a]; ++i)
        for (std::size_t j = 0; j < levels[b]; ++j) missing.insert({{a, i}, {b, j}});
  for (const Choices& row : rows) for_each_pair(row, [&](const Pair& pair) { missing.erase(pair); });
  return {missing.begin(), missing.end()};
}

std::vector<Choices> covering_array(std::span<const std::size_t> levels) {
  const std::vector<Choices> candidates = whole_product(levels);
  const std::vector<Pair> all = missing_pairs(levels, {});
  std::set<Pair> left(all.begin(), all.end());
  std::vector<Choices> rows;
  while (!left.empty()) {
    const Choices* best = nullptr;
    std::size_t most = 0;
    for (const Choices& candidate : candidates) {
      std::size_t shown = 0;
      for_each_pair(candidate, [&](const Pair& pair) { shown += left.count(pair); });
      if (shown > most) most = shown, best = &candidate;
    }
    rows.push_back(*best);
    for_each_pair(*best, [&](const Pair& pair) { left.erase(pair); });
  }
  return rows;
}

}  // namespace tessera::test

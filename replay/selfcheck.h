#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tessera::replay {

// A published figure, measured again at the condition that it was published for, as far as that is known.
struct SelfCheck {
  std::string name;       // what is looked at
  std::string condition;  // at which
  std::string expected;   // with its unit, its source and the tolerance
  std::string got;
  bool passed = false;
  std::string reason;  // of one that does not hold, where that is known and docs/validation.md says so
  std::string note;    // where the figure is from, what of its condition is ours
};

// Of checks that do not hold, those whose reason nobody knows: the others are shown, but are no failures.
std::size_t failures(const std::vector<SelfCheck>& checks);

// Streams of reads through memory.model=banks against the data rates of the JEDEC standards.
std::vector<SelfCheck> check_memory_rates();

// On captures: tiling against drawing immediately, vertices shaded again in each tile against positions that are kept,
// texture blocks that several cores ask for. Nothing for no captures. `strict`: scene::CaptureLimits::strict.
std::vector<SelfCheck> check_captures(const std::vector<std::filesystem::path>& captures, bool strict = false);

}  // namespace tessera::replay

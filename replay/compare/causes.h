#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "replay/compare/comparison.h"

namespace tessera::replay {

// A part of the answer to why one run takes longer than another.
struct Cause {
  std::string text;
  std::vector<Cause> parts;
};

// Explains why run `run` takes more or less time than the first one: first the changes (the capture, keys, the size of
// the image, the contents of the scene), then the cycles by drawable and by unit, then bytes. Changes are in the order
// of causes: keys and parts that appeared or disappeared before parts that grew, the largest first. The cycles of a
// level, including its line for the omitted parts, add up to the difference.
//
// Invariants (cited by the tests):
//   WHY1  After a single change to the scene or the settings, the first part of "what changed" names it.
//   WHY2  Cycles by drawable, and by unit where the runs have a critical path, add up to the difference.
Cause causes_of(const Comparison& comparison, std::size_t run);

// {"text", "parts": [...]}
nlohmann::json cause_json(const Cause& cause);
// A line for each, parts indented.
std::string cause_text(const Cause& cause, std::size_t depth = 0);

}  // namespace tessera::replay

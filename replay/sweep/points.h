#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "replay/sweep/study.h"

namespace tessera::replay {

// Of a point's result, and part of what its hash follows from.
inline constexpr const char* kPointSchema = "tessera.point/1";

// One point of a design space.
struct SweepPoint {
  std::size_t capture = 0;           // of Study::captures
  std::vector<std::uint32_t> steps;  // one per axis
  std::string hash;                  // 32 hexadecimal digits: names the result of everything that it follows from
  std::string fault;                 // why these values do not fit each other; then there is nothing to render
};

// All points: capture by capture, the last axis fastest. Reads the captures' bytes for their hashes.
// A hash covers the capture's content, frames, size, the whole machine, every setting, what is kept, and `program`.
std::vector<SweepPoint> expand_points(const Study& study, const std::string& program);

// Values of a point along all axes, in the order of Study::axis_keys().
std::vector<nlohmann::json> point_values(const Study& study, const SweepPoint& point);

// "tile.width=16 frontend.split_depth=2", with the capture in front where there are several.
std::string point_label(const Study& study, const SweepPoint& point);

// Names the program that runs: SHA-256 of its file. A result of another build is never taken for one of this.
std::string program_fingerprint();

}  // namespace tessera::replay

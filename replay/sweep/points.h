#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "replay/sweep/study.h"

namespace tessera::replay {

// Schema of a point's result; it is also among the inputs of the point's hash.
inline constexpr const char* kPointSchema = "tessera.point/1";

// One point of a design space.
struct SweepPoint {
  std::size_t capture = 0;           // index into Study::captures
  std::vector<std::uint32_t> steps;  // one per axis
  std::string hash;                  // 32 hexadecimal digits: hash of all inputs of the result, and its name
  std::string function;  // likewise for the render: hash of the inputs without the keys that only timing reads
  std::string fault;     // why these values do not fit together; such a point is not rendered
};

// Makes points of a study. Reads the captures' bytes for their hashes.
class PointMaker {
 public:
  // `program`: program_fingerprint().
  PointMaker(const Study& study, std::string program);

  // A hash covers the capture's content, frames, size, the whole machine, every setting, the kept results, and
  // `program`; the hash of the function leaves out the keys that only timing reads (gpu::functional_json()). Points of
  // one function share one render. With baselines, whose cycles no record has, each point has a function of its own.
  SweepPoint make(std::size_t capture, const std::vector<std::uint32_t>& steps) const;

 private:
  const Study& study_;
  std::string program_;
  std::vector<std::string> captures_;  // fingerprints
  bool items_ = false;
};

// All points, or the chosen ones: capture by capture, the last axis fastest.
std::vector<SweepPoint> expand_points(const Study& study, const std::string& program);

// Points of one function, in their order: one render suffices for each group.
std::vector<std::vector<std::size_t>> render_groups(const std::vector<SweepPoint>& points);

// The points of one of `shards` parts, in their order: whole groups, dealt out in turn. If there are fewer groups than
// shards, each group is cut into equal parts for its share of the shards, and each part renders it once more.
//   SH1  The parts together are all points, each once.
//   SH2  A group is rendered by at most max(1, shards / groups) parts.
std::vector<std::size_t> points_of_shard(const std::vector<SweepPoint>& points, std::size_t shard, std::size_t shards);

// Whether a frame's record must hold its items: some point is timed by events, or frames are split.
bool needs_items(const Study& study);
// Whether points may differ in timing alone: some axis has a key that only timing reads, or is an axis of machines.
bool varies_in_timing(const Study& study);

// Values of a point along all axes, in the order of Study::axis_keys().
std::vector<nlohmann::json> point_values(const Study& study, const SweepPoint& point);

// "tile.width=16 frontend.split_depth=2", with the capture in front where there are several.
std::string point_label(const Study& study, const SweepPoint& point);

// Identifies the running program: SHA-256 of its file. Results of another build are never reused.
std::string program_fingerprint();

}  // namespace tessera::replay

#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "baselines/baseline_set.h"

namespace tessera::replay {

// Reports that compare the schemes of one frame, or of all frames.

// {"tessera": {"baseline.primitives": 1, ...}, "patch-whole": ..., and so on: a member per scheme}
nlohmann::json baselines_json(const baselines::BaselineSet& set);

// [{"name": "shadow 0.0", "baselines": {"tessera": {"baseline.dram_bytes": 1, ...}, ...}}, ...]: the bytes of each scheme in
// each pass of a frame.
nlohmann::json baseline_passes_json(std::span<const baselines::PassSet> passes);

// {"tessera": "ours", "patch-whole": "ours", "post-tessellation": "shipped", ...}: a member per scheme
nlohmann::json baseline_kinds_json();

// baselines.csv: a row per frame and scheme with its kind, then one per scheme for all frames, whose frame is "total".
class BaselineReport {
 public:
  void add(int frame, const baselines::BaselineSet& set);
  const baselines::BaselineSet& total() const { return total_; }
  std::string csv() const;
  void write(const std::filesystem::path& folder) const;

 private:
  struct Frame {
    int frame;
    baselines::BaselineSet set;
  };
  std::vector<Frame> frames_;
  baselines::BaselineSet total_;
};

}  // namespace tessera::replay

#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "baselines/baseline_set.h"

namespace tessera::replay {

// The schemes of one frame, or of all, side by side.

// {"tessera": {"baseline.primitives": 1, ...}, "patch-whole": ..., and so on: a member per scheme}
nlohmann::json baselines_json(const baselines::BaselineSet& set);

// A table for people: a row per counter, a column per scheme, and post-tessellation over tessera.
std::string baselines_table(const baselines::BaselineSet& set);

// baselines.csv: a row per frame and scheme, then one per scheme for all frames, whose frame is "total".
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

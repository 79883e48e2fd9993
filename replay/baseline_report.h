#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "replay/baselines.h"

namespace tessera::replay {

// The schemes of one frame, or of all, side by side.

// {"pre-tessellation": {"baseline.primitives": 1, ...}, "patch-whole": ..., "post-tessellation": ..., "immediate": ...}
nlohmann::json baselines_json(const BaselineSet& set);

// A table for people: a row per counter, a column per scheme, and post-tessellation over pre-tessellation.
std::string baselines_table(const BaselineSet& set);

// baselines.csv: a row per frame and scheme, then one per scheme for all frames, whose frame is "total".
class BaselineReport {
 public:
  void add(int frame, const BaselineSet& set);
  const BaselineSet& total() const { return total_; }
  std::string csv() const;
  void write(const std::filesystem::path& folder) const;

 private:
  struct Frame {
    int frame;
    BaselineSet set;
  };
  std::vector<Frame> frames_;
  BaselineSet total_;
};

}  // namespace tessera::replay

#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "gpu/device.h"
#include "replay/view_options.h"
#include "scene/capture.h"

namespace tessera::replay {

// The start of a view, from the command line.
struct ViewStart {
  const scene::Capture* capture = nullptr;
  std::string file;                // the capture's name on the command line
  std::string gpu = "mid-mobile";  // preset or file
  std::vector<std::string> sets;   // "KEY=VALUE"
  std::string size;                // "WxH"; "": the capture's size
  std::optional<std::string> variant;
  ViewChoices look;          // choices with which `capture` was read
  std::optional<int> frame;  // none: the capture's first
  int warmup = 0;            // frames before it, where history matters
};

// All inputs of a result.
struct ViewPoint {
  std::uint64_t revision = 0;
  // Key and value of all differences from the start, the latest change last.
  std::vector<std::pair<std::string, nlohmann::json>> changes;
  int frame = 0;
  bool keep = true;  // kept in the history
  gpu::RunSettings settings;
  gpu::GpuConfiguration gpu;
  gpu::RenderRequest request;
  std::string notice;        // notice about its machine; ""
  nlohmann::json function;   // gpu::functional_json()
  bool accumulates = false;  // its frame has a history

  bool renders_as(const ViewPoint& other) const { return frame == other.frame && function == other.function; }
  // First of the frames that are rendered for the history of `frame`.
  int first_frame(int warmup) const;
};

// The start, and the possible changes to it.
class ViewSpace {
 public:
  // Throws UsageError where the values of the start do not fit together.
  explicit ViewSpace(ViewStart start);

  const ViewStart& start() const { return start_; }
  ViewPoint start_point() const { return point({}, first_); }
  // Applies {KEY: value, or null for the start's value} to `from`; "frame" is a key as well. Throws UsageError where
  // keys or values are unknown or do not fit together.
  ViewPoint changed(const ViewPoint& from, const nlohmann::json& changes) const;

  // {KEY: value}
  static nlohmann::json changes_json(const ViewPoint& point);
  // The `tessera replay` command that gives the same result.
  std::string command(const ViewPoint& point) const;
  std::string command_without_frames(const ViewPoint& point) const;
  // Every key with its row from `tessera describe`, "timing" (read by timing alone) and its value at the "start".
  nlohmann::json keys() const;

 private:
  ViewPoint point(std::vector<std::pair<std::string, nlohmann::json>> changes, int frame) const;

  ViewStart start_;
  gpu::RunSettings settings_;
  gpu::GpuConfiguration gpu_;
  gpu::RenderRequest request_;
  int first_ = 0;
};

// The text as a word of a shell, quoted where necessary.
std::string shell_word(const std::string& text);

}  // namespace tessera::replay

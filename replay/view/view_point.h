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

// What a view begins with, as the command line says it.
struct ViewStart {
  const scene::Capture* capture = nullptr;
  std::string file;                // the capture as it was named
  std::string gpu = "mid-mobile";  // preset or file
  std::vector<std::string> sets;   // "KEY=VALUE"
  std::string size;                // "WxH"; "": the capture's
  std::optional<std::string> variant;
  ViewChoices look;          // that `capture` was read with
  std::optional<int> frame;  // none: the capture's first
  int warmup = 0;            // frames before, where history matters
};

// Everything that a result follows from.
struct ViewPoint {
  std::uint64_t revision = 0;
  // Key and value of all that is other than at the start; what was changed last is last.
  std::vector<std::pair<std::string, nlohmann::json>> changes;
  int frame = 0;
  bool keep = true;  // in the history
  gpu::RunSettings settings;
  gpu::GpuConfiguration gpu;
  gpu::RenderRequest request;
  std::string notice;       // of the machine that it takes; ""
  nlohmann::json function;  // gpu::functional_json()

  bool renders_as(const ViewPoint& other) const { return frame == other.frame && function == other.function; }
  // Frames that are rendered before `frame` for their history.
  int first_frame(int warmup) const;
};

// The start and what may be changed about it.
class ViewSpace {
 public:
  // Throws UsageError where the start does not fit together.
  explicit ViewSpace(ViewStart start);

  const ViewStart& start() const { return start_; }
  ViewPoint start_point() const { return point({}, first_); }
  // `from` with {KEY: value, or null for that of the start}; "frame" is a key as well. Throws UsageError where keys or
  // values are unknown or do not fit together.
  ViewPoint changed(const ViewPoint& from, const nlohmann::json& changes) const;

  // {KEY: value}
  static nlohmann::json changes_json(const ViewPoint& point);
  // The `tessera replay` that gives the same.
  std::string command(const ViewPoint& point) const;
  std::string command_without_frames(const ViewPoint& point) const;
  // Every key with what `tessera describe` says of it, "timing" (timed only, not rendered) and the value at the "start".
  nlohmann::json keys() const;

 private:
  ViewPoint point(std::vector<std::pair<std::string, nlohmann::json>> changes, int frame) const;

  ViewStart start_;
  gpu::RunSettings settings_;
  gpu::GpuConfiguration gpu_;
  gpu::RenderRequest request_;
  int first_ = 0;
};

// As a shell takes it: quoted where it must be.
std::string shell_word(const std::string& text);

}  // namespace tessera::replay

#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "gpu/prepared_capture.h"
#include "replay/view_options.h"
#include "scene/limits.h"

namespace tessera::replay {

// Packing of a capture before it is drawn: Draco or meshoptimizer keeps attributes to so many bits. 0 bits: the capture
// is drawn unchanged.
struct Packing {
  bool meshopt = false;
  int bits = 0;

  // "" for an unchanged capture, else pack's options.
  std::string arguments() const;
  bool operator==(const Packing&) const = default;
};

// A capture and its packed versions, each read on first use and kept as long as this object. The files lie in a folder
// of their own below the system's folder for temporary files; it is removed at the end.
class PackedCaptures {
 public:
  // Throws the errors of read_capture().
  PackedCaptures(std::filesystem::path file, const scene::CaptureLimits& limits, ViewChoices view = {},
                 std::optional<ImageSize> size = std::nullopt);
  ~PackedCaptures();
  PackedCaptures(const PackedCaptures&) = delete;
  PackedCaptures& operator=(const PackedCaptures&) = delete;

  const std::shared_ptr<const gpu::PreparedCapture>& original() const { return known_.at("").prepared; }
  // Throws the errors of pack_capture() and read_capture().
  const std::shared_ptr<const gpu::PreparedCapture>& of(const Packing& packing);
  // The original without an effect of its scene: a layer of materials (scene::kMaterialEffectNames), or
  // "environment_image", which the studio light replaces.
  const std::shared_ptr<const gpu::PreparedCapture>& without(const std::string& effect);

 private:
  struct Loaded {
    std::unique_ptr<const scene::Capture> capture;
    std::shared_ptr<const gpu::PreparedCapture> prepared;
  };
  Loaded load(const std::filesystem::path& file) const;

  std::filesystem::path file_, folder_;
  scene::CaptureLimits limits_;
  ViewChoices view_;
  std::optional<ImageSize> size_;
  std::map<std::string, Loaded> known_;    // by Packing::arguments()
  std::map<std::string, Loaded> without_;  // by the name of the missing effect
};

}  // namespace tessera::replay

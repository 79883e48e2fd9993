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

// How a capture is packed before it is drawn: attributes kept to so many bits by Draco or meshoptimizer. 0 bits: it is
// drawn as it is.
struct Packing {
  bool meshopt = false;
  int bits = 0;

  // "" as it is, else pack's options.
  std::string arguments() const;
  bool operator==(const Packing&) const = default;
};

// A capture as it is and as pack writes it, each read when it is first asked for and kept as long as this. Files lie in a
// folder of their own below the system's for temporary ones, which is removed at the end.
class PackedCaptures {
 public:
  // Throws what read_capture() throws.
  PackedCaptures(std::filesystem::path file, const scene::CaptureLimits& limits, ViewChoices view = {},
                 std::optional<ImageSize> size = std::nullopt);
  ~PackedCaptures();
  PackedCaptures(const PackedCaptures&) = delete;
  PackedCaptures& operator=(const PackedCaptures&) = delete;

  const std::shared_ptr<const gpu::PreparedCapture>& original() const { return known_.at("").prepared; }
  // Throws what pack_capture() and read_capture() throw.
  const std::shared_ptr<const gpu::PreparedCapture>& of(const Packing& packing);
  // The original without an effect of its scene: a layer of materials (scene::kMaterialEffectNames), or
  // "environment_image", in whose place the studio lights it.
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
  std::map<std::string, Loaded> without_;  // by the effect that is left out
};

}  // namespace tessera::replay

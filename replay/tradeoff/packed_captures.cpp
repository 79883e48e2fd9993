#include "replay/tradeoff/packed_captures.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include <fmt/format.h>

#include "base/error.h"
#include "replay/pack/meshopt_encoder.h"
#include "replay/pack/packer.h"
#include "scene/capture_reader.h"

namespace tessera::replay {

namespace fs = std::filesystem;

std::string Packing::arguments() const {
  if (bits == 0) return "";
  return fmt::format("{}--position-bits {} --normal-bits {} --texcoord-bits {}", meshopt ? "--meshopt " : "", bits,
                     bits, bits);
}

PackedCaptures::PackedCaptures(fs::path file, const scene::CaptureLimits& limits, ViewChoices view,
                               std::optional<ImageSize> size)
    : file_(std::move(file)), limits_(limits), view_(std::move(view)), size_(size) {
  known_[""] = load(file_);
}

PackedCaptures::~PackedCaptures() {
  std::error_code ignored;
  if (!folder_.empty()) fs::remove_all(folder_, ignored);
}

PackedCaptures::Loaded PackedCaptures::load(const fs::path& file) const {
  Loaded loaded;
  loaded.capture = std::make_unique<const scene::Capture>(read_capture(file, limits_, view_, size_));
  loaded.prepared = std::make_shared<const gpu::PreparedCapture>(*loaded.capture);
  return loaded;
}

const std::shared_ptr<const gpu::PreparedCapture>& PackedCaptures::without(const std::string& effect) {
  const auto [found, fresh] = without_.try_emplace(effect);
  Loaded& loaded = found->second;
  if (!fresh) return loaded.prepared;
  if (effect == "environment_image") {
    auto capture = std::make_unique<scene::Capture>(original()->capture);
    capture->environment_image = nullptr;
    capture->settings.environment_kind = shaders::Surroundings::Kind::kStudio;
    loaded.capture = std::move(capture);
    loaded.prepared = std::make_shared<const gpu::PreparedCapture>(*loaded.capture);
  } else {
    loaded.prepared =
        std::make_shared<const gpu::PreparedCapture>(original()->capture, gpu::CaptureChanges{{}, effect});
  }
  return loaded.prepared;
}

const std::shared_ptr<const gpu::PreparedCapture>& PackedCaptures::of(const Packing& packing) {
  const auto [found, fresh] = known_.try_emplace(packing.arguments());
  if (!fresh) return found->second.prepared;
  if (folder_.empty()) {
    std::string name = (fs::temp_directory_path() / "tessera_packed_XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw SystemError(name + ": no folder for packed captures");
    folder_ = name;
  }
  PackOptions options;
  options.strict = limits_.strict;
  if (packing.meshopt) {
    options.method = PackMethod::kMeshopt;
    options.bits = kMeshoptBits;
  }
  options.bits.position = options.bits.normal = options.bits.texcoord = packing.bits;
  const fs::path target = folder_ / fmt::format("{}_{}.glb", packing.meshopt ? "meshopt" : "draco", packing.bits);
  pack_capture(file_, target, options);
  found->second = load(target);
  fs::remove(target);
  return found->second.prepared;
}

}  // namespace tessera::replay

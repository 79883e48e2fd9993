#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "frontend/bounds/sub_patch_bounder.h"
#include "scene/assembly.h"
#include "scene/capture.h"
#include "scene/geometry_settings.h"
#include "scene/texture_settings.h"

namespace tessera::gpu {

// A capture ready for drawing, with its textures and geometry in the formats of the emulated memory.
struct PreparedScene {
  explicit PreparedScene(scene::Assembly assembled) : assembly(std::move(assembled)), pyramids(assembly) {}

  const scene::Assembly assembly;
  const frontend::PyramidLibrary pyramids;
};

// Changes to the surfaces that a device draws of a capture; its camera, lights and framing stay the same.
struct CaptureChanges {
  scene::DrawnFilter drawn{};
  std::string without_effect{};  // a layer of materials (scene::kMaterialEffectNames); "": none
};

// Data that all devices of one capture share, for any machine and settings. Many devices may use it at once.
class PreparedCapture {
 public:
  // `capture_in` must outlive it.
  explicit PreparedCapture(const scene::Capture& capture_in, CaptureChanges changes = {});

  const scene::Capture& capture;

  // Returns the scene, made at the first request and kept as long as this object; all texture targets share one if the
  // capture has no KTX2 textures. Throws LimitError if texture.format or geometry.encoding needs more memory than
  // reading the capture left.
  const PreparedScene& scene(scene::TextureSettings textures, const scene::GeometrySettings& geometry = {}) const;

 private:
  scene::Assembly assemble() const;

  CaptureChanges changes_;
  mutable std::mutex mutex_;
  using Held = std::pair<scene::GeometrySettings, scene::TextureSettings>;
  mutable std::map<Held, std::unique_ptr<const PreparedScene>> scenes_;
  mutable std::vector<scene::Material> materials_;  // as assembled, with the capture's own textures
};

}  // namespace tessera::gpu

#pragma once

#include <array>
#include <memory>
#include <mutex>

#include "base/ktx2/ktx2.h"
#include "frontend/bounds/sub_patch_bounder.h"
#include "scene/assembly.h"
#include "scene/capture.h"

namespace tessera::gpu {

// A capture ready to be drawn, its KTX2 textures as one target holds them.
struct PreparedScene {
  explicit PreparedScene(scene::Assembly assembled) : assembly(std::move(assembled)), pyramids(assembly) {}

  const scene::Assembly assembly;
  const frontend::PyramidLibrary pyramids;
};

// What all devices of one capture share, whatever the machine and the settings. Many devices may use it at once.
class PreparedCapture {
 public:
  // `capture_in` must outlive it.
  explicit PreparedCapture(const scene::Capture& capture_in) : capture(capture_in) {}

  const scene::Capture& capture;

  // Made when first asked for, kept as long as this; one for all targets where the capture has no KTX2 textures.
  const PreparedScene& scene(ktx2::BasisTarget target) const;

 private:
  mutable std::mutex mutex_;
  mutable std::array<std::unique_ptr<const PreparedScene>, 3> scenes_;  // by target
};

}  // namespace tessera::gpu

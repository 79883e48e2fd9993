#pragma once

#include "frontend/bounds/sub_patch_bounder.h"
#include "scene/assembly.h"
#include "scene/capture.h"

namespace tessera::gpu {

// What all devices of one capture share, whatever the machine and the settings. Read only: many devices may use it at
// once.
struct PreparedCapture {
  // `capture_in` must outlive it.
  explicit PreparedCapture(const scene::Capture& capture_in)
      : capture(capture_in), assembly(scene::assemble(capture_in)), pyramids(assembly) {}

  const scene::Capture& capture;
  const scene::Assembly assembly;
  const frontend::PyramidLibrary pyramids;
};

}  // namespace tessera::gpu

#pragma once

#include "frontend/bounds/sub_patch_bounder.h"
#include "gpu/configuration.h"
#include "gpu/displacement_memory.h"
#include "gpu/frame_result.h"
#include "gpu/observed_work.h"
#include "gpu/patch_table.h"
#include "tilecore/tile_job.h"

namespace tessera::gpu {

// A rendered view, valid while its inputs still exist.
struct RenderedView {
  const GpuConfiguration& gpu;
  const frontend::PyramidLibrary& pyramids;
  const PatchTable& records;
  const DisplacementMemory* heights;  // nullptr if textures are not modelled
  const tilecore::TileJob& job;
  const ObservedWork& record;
  const FrameResult& result;
};

// Observes the views of a device. It is called on the thread that calls Device::render(), for the left or only eye of
// each frame.
class ViewObserver {
 public:
  virtual void view_rendered(const RenderedView& view) = 0;

 protected:
  ~ViewObserver() = default;
};

}  // namespace tessera::gpu

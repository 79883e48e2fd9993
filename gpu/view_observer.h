#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "frontend/bounds/sub_patch_bounder.h"
#include "gpu/configuration.h"
#include "gpu/displacement_memory.h"
#include "gpu/frame_result.h"
#include "gpu/observed_work.h"
#include "gpu/patch_table.h"
#include "memory/line_cache.h"
#include "tilecore/tile_job.h"
#include "timing/work.h"

namespace tessera::gpu {

// A rendered view, valid while its inputs still exist: the camera's view, or a shadow map, whose job has `depths`.
struct RenderedView {
  const GpuConfiguration& gpu;
  const frontend::PyramidLibrary& pyramids;
  const PatchTable& records;
  const DisplacementMemory* heights;  // nullptr if textures are not modelled
  const tilecore::TileJob& job;
  const ObservedWork& record;
  const FrameResult& result;  // of the camera's view: with the counters of the frame's maps; of a map: its own counters
  // Recorded work of the view, round by round; the rounds of FrameResult::image_passes come last, one for each. With
  // output.machine_model alone.
  std::span<const timing::WorkRound> rounds{};
  std::string_view pass = "main";  // name of the pass that draws the view
  // Work of the pass that draws before: a prepass, or the scene behind surfaces that transmit. nullptr without such a pass.
  const ObservedWork* before = nullptr;
  std::string_view light{};       // name of the pass that lights a stored G-buffer
  std::size_t maps_before = 0;    // number of the frame's maps that were shown before
  std::uint32_t first_tile = 0;   // number that the record gives the view's first tile
  memory::LineRange map_lines{};  // lines of maps among the lines of textures
};

// Observes the views of a device. It is called on the thread that calls Device::render(), for the left or only eye of
// each frame: with each shadow map when the map is stored, then with the camera's view.
class ViewObserver {
 public:
  virtual void map_rendered(const RenderedView&) {}
  virtual void view_rendered(const RenderedView& view) = 0;

 protected:
  ~ViewObserver() = default;
};

}  // namespace tessera::gpu

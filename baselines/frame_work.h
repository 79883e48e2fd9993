#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "baselines/baseline_counters.h"
#include "gpu/frame_result.h"
#include "timing/work.h"

namespace tessera::baselines {

// Joins the work of a scheme's passes to the work of a frame, in the order in which the machine renders them: shadow
// maps, the camera's view, then the passes over images.
//
// Invariants (cited by the tests):
//   FW1  The frame moves the bytes of its passes, and each round belongs to one pass.
//   FW2  A frame of one pass has the pass's own rounds.
class FrameWorkJoin {
 public:
  // Adds a pass that draws. `waits`: its geometry waits for the tiles of all passes before.
  void add(timing::FrameWork pass, std::string_view name, bool waits);
  // Adds passes over images, a round each: the machine's own rounds, as every scheme loads, filters and stores images
  // alike. `names`: of the passes.
  void add_images(std::span<const timing::WorkRound> rounds, std::span<const gpu::PassResult> names);
  // Returns the frame. The tile memory of each pass counts.
  timing::FrameWork finish();

 private:
  timing::FrameWork frame_;
  std::vector<std::uint64_t> state_bytes_;  // of a tile, by round
};

// Counters of a pass over images, the same for all schemes: bytes that it loads and stores. A pass writes each line of an
// attachment once and whole, so a colour cache moves the same bytes as tiles.
BaselineCounters image_pass_counters(const gpu::FrameCounters& pass);

}  // namespace tessera::baselines

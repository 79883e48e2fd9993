#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "gpu/frame_result.h"
#include "gpu/frame_timeline.h"

namespace tessera::gpu {

// Stages of a pass, by the names that profilers of tile-based GPUs give them (Android GPU Inspector, render stages in
// Perfetto). Binning is on the vertex queue, all others are on the fragment queue.
enum class RenderStage : std::uint8_t { kBinning, kLoadColor, kLoadDepth, kRender, kStoreColor, kStoreDepth };
inline constexpr std::size_t kRenderStageCount = 6;
constexpr std::string_view name(RenderStage stage) {
  constexpr std::array<std::string_view, kRenderStageCount> kNames = {"Binning", "LoadColor",  "LoadDepth",
                                                                      "Render",  "StoreColor", "StoreDepth"};
  return kNames[static_cast<std::size_t>(stage)];
}

// Time from the first begin to the last end of a stage of a pass, over all of its rounds and tiles. Cycles from the
// start of the frame.
struct StageSpan {
  RenderStage stage{};
  std::uint32_t pass = 0;  // FrameWork::passes
  std::uint32_t tiles = 0;
  double begin = 0, end = 0;
};

// The stages of a frame's passes. A pass has a load or a store exactly where its ledger moved such bytes: finished pixels,
// attachments, colours behind surfaces that transmit, depths of shadow maps, and samples of partial renders, which are
// colours and depths together. Loads have no phase of their own in the model: their bytes come in the first phase of a
// tile. `depth_pass`: the name of the pass that stores depths into an attachment; "" for none.
//
// Invariants (cited by the tests):
//   RS1  Render of a pass begins with its first tile and ends when its last tile has only its store left.
//   RS2  A pass has a stage exactly if its ledger moved the stage's bytes.
std::vector<StageSpan> render_stages(const FrameTimeline& frame, const timing::FrameWork& work,
                                     std::span<const PassResult> passes, std::string_view depth_pass);

}  // namespace tessera::gpu

#pragma once

#include <cstdint>

#include "hardware/machine.h"
#include "timing/work.h"

namespace tessera::replay {

// Lines of textures that a frame's warps ask for, and those of them that more than one core asks for.
struct SharedLines {
  std::uint64_t lines = 0, shared = 0;
  double share() const { return lines > 0 ? static_cast<double>(shared) / static_cast<double>(lines) : 0; }
};

// Who shades a warp: the core that its tile was given to (machine.timing=phases says which), or all cores in turn, as on
// machines that deal the quads of a tile out to their cores.
enum class WarpOwner { kCoreOfTile, kCoresInTurn };

// `work` with its items (RenderRequest::record_items).
SharedLines shared_lines(const hardware::Machine& gpu, const timing::FrameWork& work, WarpOwner owner);

}  // namespace tessera::replay

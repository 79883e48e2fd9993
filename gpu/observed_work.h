#pragma once

#include <cstdint>
#include <vector>

#include "binner/list_entry.h"
#include "tilecore/tile_core.h"

namespace tessera::gpu {

// Traffic of a tile's texture units and heights, displacement maps and shadow maps included.
struct TextureUse {
  std::uint64_t visibility_bytes = 0, shading_bytes = 0;  // over the external memory interface
  std::uint64_t l2_lines = 0;                             // requested from the L2, and filled into it
};

// Work that a run of the machine requested from its tile cores, kept for the baselines.
struct ObservedWork {
  std::vector<std::vector<binner::ListEntry>> entries;       // by tile; record numbers continue after lists are emptied
  std::vector<tilecore::TessellationRequest> tessellations;  // tile by tile, in emulated order
  std::vector<TextureUse> textures;                          // per tile, with output.machine_model
};

}  // namespace tessera::gpu

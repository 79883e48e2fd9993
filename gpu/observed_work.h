#pragma once

#include <cstdint>
#include <vector>

#include "binner/list_entry.h"
#include "tilecore/tile_core.h"

namespace tessera::gpu {

// What the texture units and the heights of a tile moved, displacement maps included.
struct TextureUse {
  std::uint64_t visibility_bytes = 0, shading_bytes = 0;  // over the external memory interface
  std::uint64_t l2_lines = 0;                             // asked of the L2, and filled into it
};

// What a run of the machine asked of its tile cores, kept to be looked at by the baselines.
struct ObservedWork {
  std::vector<std::vector<binner::ListEntry>> entries;       // per tile; records numbered on where lists were emptied
  std::vector<tilecore::TessellationRequest> tessellations;  // tile by tile, in emulated order
  std::vector<TextureUse> textures;                          // per tile, with output.machine_model
};

}  // namespace tessera::gpu

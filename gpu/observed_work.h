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

// Lighting of a tile apart from its draws: light halves of a G-buffer on chip, and bytes of the G-buffer and of light lists that
// shaders write and read in the tile memory.
struct LightUse {
  std::uint64_t invocations = 0, warps = 0, lookups = 0;
  std::uint64_t tile_bytes = 0;
};

// Work that a pass of the machine requested from its tile cores, kept for the baselines.
struct ObservedWork {
  std::vector<std::vector<binner::ListEntry>> entries;       // by tile; record numbers continue after lists are emptied
  std::vector<tilecore::TessellationRequest> tessellations;  // tile by tile, in emulated order
  std::vector<TextureUse> textures;                          // per tile, with output.machine_model
  std::vector<LightUse> lights;                              // per tile
  // Tiles that the next pass draws again, where this one draws the scene behind surfaces that transmit; empty otherwise.
  std::vector<bool> open;
};

}  // namespace tessera::gpu

#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "gpu/machine_model.h"
#include "timing/attribution.h"

namespace tessera::gpu {

// The work of a tile for one drawable.
struct DrawableInTile {
  std::uint32_t drawable = 0;     // its number in scene::Assembly, plus one; 0: no drawable
  std::uint64_t sub_patches = 0;  // sub-patches of the tile's list that it works on
  std::uint64_t invocations = 0;  // of the pixel shader
};

// Shares of drawables and of tiles in a frame's cycles, bytes and energy (timing/attribution.h).
//
// Invariant (cited by the tests):
//   FSH1  Traffic of all tiles and of the units in front of them adds up to the ledger, purpose by purpose.
struct CostAttribution {
  std::map<std::uint32_t, timing::DrawableShare> drawables;  // by DrawableInTile::drawable
  std::vector<timing::TileShare> tiles;            // rendered tiles of the image, in the order of their numbers
  timing::TileBounds bounds{};                     // method that found what bounds the tiles
  std::vector<TileTraffic> traffic;                // by tile number
  std::vector<std::vector<DrawableInTile>> lists;  // by tile number; in the order of their drawables

  // Joins a further view of the same frame. A tile's bound is the bound of the view in which more cycles depend on it.
  void add(const CostAttribution& view);
};

// Attributes the costs of one view, whose work has items. `before`: the caches with which it began. `bounds`: finds the
// units that bound tiles; with machine.timing=events it is an estimate, and needs a schedule with the paths of tiles.
CostAttribution attribute_costs(const GpuConfiguration& gpu, const timing::FrameWork& work,
                                const timing::Schedule& schedule, const timing::FrameTiming& timing,
                                const hardware::FrameEnergy& energy, std::vector<TileTraffic> traffic,
                                const timing::WarmCaches& before, bool bounds = true);

}  // namespace tessera::gpu

#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "gpu/machine_model.h"
#include "timing/attribution.h"

namespace tessera::gpu {

// What a tile draws of a drawable.
struct DrawableInTile {
  std::uint32_t drawable = 0;     // its number in scene::Assembly, plus one; 0: of none
  std::uint64_t sub_patches = 0;  // of its list that it works on
  std::uint64_t invocations = 0;  // of the pixel shader
};

// How a frame's cycles, bytes and energy split over what it draws and over its tiles (timing/attribution.h).
//
// Invariant (cited by the tests):
//   FSH1  Traffic of all tiles and of what is in front of them adds up to the ledger, purpose by purpose.
struct CostAttribution {
  std::map<std::uint32_t, timing::DrawableShare> drawables;  // by DrawableInTile::drawable
  std::vector<timing::TileShare> tiles;                      // of the image, rendered, in the order of their numbers
  timing::TileBounds bounds{};                               // how it was found what bounds them
  std::vector<TileTraffic> traffic;                          // by number
  std::vector<std::vector<DrawableInTile>> lists;            // by number; in the order of their drawables

  // Joins a further view of the same frame. A tile is bound by what binds the view in which more hangs on it.
  void add(const CostAttribution& view);
};

// Of one view, whose work has items. `before`: the caches with which it began. `bounds`: what binds tiles is looked for;
// with machine.timing=events it is estimated, where the schedule has the paths of tiles.
CostAttribution attribute_costs(const GpuConfiguration& gpu, const timing::FrameWork& work,
                                const timing::Schedule& schedule, const timing::FrameTiming& timing,
                                const hardware::FrameEnergy& energy, std::vector<TileTraffic> traffic,
                                const timing::WarmCaches& before, bool bounds = true);

}  // namespace tessera::gpu

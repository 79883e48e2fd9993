#pragma once

#include "base/image.h"

namespace tessera::captures {

// Images of the city. All repeat; walls and pavements measure two metres, slabs 2.4.

Image8 brick_colors(bool yellow);
Image8 brick_heights();
Image8 stucco_colors();
Image8 stucco_heights();
Image8 ashlar_colors();
Image8 ashlar_heights();
Image8 slate_colors();
Image8 slate_heights();
Image8 slab_colors();
Image8 slab_heights();
Image8 asphalt_colors();
Image8 stone_colors();

// An atlas of 4 x 2: six windows, a door, a shop window.
Image8 pane_colors();
Image8 pane_heights();

// One bay and floor of a tower.
Image8 tower_colors(bool bricks);
Image8 tower_heights();

Image8 awning_colors();

}  // namespace tessera::captures

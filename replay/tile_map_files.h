#pragma once

#include <string>

#include "gpu/tile_maps.h"

namespace tessera::replay {

// {"schema": "tessera.tiles/1", "frame", "origin": [x, y], "tile": [w, h], "grid": [columns, rows],
//  "maps": {NAME: {"unit", "meaning", "values": [...]}}}; one line per map.
std::string tile_maps_json(int frame, const gpu::TileMaps& maps);

// "tiles_0007.json"
std::string tile_maps_name(int frame);

}  // namespace tessera::replay

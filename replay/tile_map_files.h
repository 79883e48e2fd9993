#pragma once

#include <string>

#include "gpu/tile_maps.h"

namespace tessera::replay {

// {"schema": "tessera.tiles/1", "frame", "origin": [x, y], "tile": [w, h], "grid": [columns, rows],
//  "maps": {NAME: {"unit", "meaning", "values": [...]}}}; one line per map. `members`: more of them, in front of the maps,
// each with a comma behind it.
std::string tile_maps_json(int frame, const gpu::TileMaps& maps, const std::string& members = "");

// "tiles_0007.json"
std::string tile_maps_name(int frame);

}  // namespace tessera::replay

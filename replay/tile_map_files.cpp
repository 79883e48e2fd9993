#include "replay/tile_map_files.h"

#include <fmt/format.h>

namespace tessera::replay {

std::string tile_maps_json(int frame, const gpu::TileMaps& maps, const std::string& members) {
  std::string text = fmt::format(
      "{{\"schema\": \"tessera.tiles/1\", \"frame\": {}, \"origin\": [{}, {}], \"tile\": [{}, {}], \"grid\": [{}, "
      "{}],\n"
      "{} \"maps\": {{\n",
      frame, maps.x0, maps.y0, maps.tile_width, maps.tile_height, maps.columns, maps.rows, members);
  for (const gpu::TileMapField& field : gpu::kTileMapFields) {
    text += fmt::format(" \"{}\": {{\"unit\": \"{}\", \"meaning\": \"{}\", \"values\": [", field.name, field.unit,
                        field.meaning);
    for (std::size_t t = 0; t < maps.tiles.size(); ++t)
      text += fmt::format("{}{}", t == 0 ? "" : ",", maps.tiles[t].*field.member);
    text += &field == &gpu::kTileMapFields.back() ? "]}\n" : "]},\n";
  }
  return text + "}}\n";
}

std::string tile_maps_name(int frame) { return fmt::format("tiles_{:04d}.json", frame); }

}  // namespace tessera::replay

#include "replay/tile_maps.h"

#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace tessera::replay {

TileMaps::TileMaps(const binner::TileGrid& grid)
    : x0(grid.column_edge(0)), y0(grid.row_edge(0)), tile_width(grid.tile_width()), tile_height(grid.tile_height()), columns(grid.columns()), rows(grid.rows()), tiles(grid.tile_count()) {}

void TileMaps::add(const TileMaps& view) {
  for (std::size_t t = 0; t < tiles.size(); ++t)
    for (const TileMapField& field : kTileMapFields) tiles[t].*field.member += view.tiles[t].*field.member;
}

void TileMeter::stop() {
  const tilecore::TileCoreCounters& now = core_.counters();
  const tilecore::ShadingCounters& shaded = core_.shading_counters();
  work_.entries += now.entries_fetched - entries_.entries_fetched;
  work_.culled_occlusion += now.culled_occlusion - entries_.culled_occlusion;
  work_.box_tests += now.box_tests - entries_.box_tests;
  work_.triangle_tests += now.triangle_tests - entries_.triangle_tests;
  work_.sample_hits += now.sample_hits - entries_.sample_hits;
  work_.samples_visible += shaded.samples_visible - shading_.samples_visible;
  work_.pixel_shader_invocations += shaded.pixel_shader_invocations - shading_.pixel_shader_invocations;
}

void count_tessellations(const std::vector<tilecore::TessellationRequest>& requests, TileCounts& work) {
  work.sub_patches += requests.size();
  for (const tilecore::TessellationRequest& request : requests) {
    work.moving_sub_patches += request.moving ? 1 : 0;
    work.triangles += request.triangles;
  }
}

std::string tile_maps_json(int frame, const TileMaps& maps) {
  std::string text = fmt::format("{{\"schema\": \"tessera.tiles/1\", \"frame\": {}, \"origin\": [{}, {}], \"tile\": [{}, {}], \"grid\": [{}, {}], \"maps\": {{\n", frame, maps.x0, maps.y0,
                                 maps.tile_width, maps.tile_height, maps.columns, maps.rows);
  for (const TileMapField& field : kTileMapFields) {
    text += fmt::format(" \"{}\": {{\"unit\": \"{}\", \"meaning\": \"{}\", \"values\": [", field.name, field.unit, field.meaning);
    for (std::size_t t = 0; t < maps.tiles.size(); ++t) text += fmt::format("{}{}", t == 0 ? "" : ",", maps.tiles[t].*field.member);
    text += &field == &kTileMapFields.back() ? "]}\n" : "]},\n";
  }
  return text + "}}\n";
}

std::string tile_maps_name(int frame) { return fmt::format("tiles_{:04d}.json", frame); }

}  // namespace tessera::replay

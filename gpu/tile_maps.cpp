#include "gpu/tile_maps.h"

namespace tessera::gpu {

TileMaps::TileMaps(const binner::TileGrid& grid)
    : x0(grid.column_edge(0)),
      y0(grid.row_edge(0)),
      tile_width(grid.tile_width()),
      tile_height(grid.tile_height()),
      columns(grid.columns()),
      rows(grid.rows()),
      tiles(grid.tile_count()) {}

void TileMaps::add(const TileMaps& view) {
  for (std::size_t t = 0; t < tiles.size(); ++t)
    for (const TileMapField& field : kTileMapFields) tiles[t].*field.member += view.tiles[t].*field.member;
}

void count_work(const tilecore::CoreCounters& counted, TileCounts& work) {
  work.entries += counted.tilecore.entries_fetched;
  work.culled_occlusion += counted.tilecore.culled_occlusion;
  work.box_tests += counted.tilecore.box_tests;
  work.triangle_tests += counted.tilecore.triangle_tests;
  work.sample_hits += counted.tilecore.sample_hits;
  work.samples_visible += counted.shading.samples_visible;
  work.pixel_shader_invocations += counted.shading.pixel_shader_invocations;
  work.procedure_samples += counted.sampling.samples;
  work.desampled_blocks += counted.desampling.blocks_rate_4 + counted.desampling.blocks_rate_8;
  work.advected_pixels += counted.desampling.pixels_advected;
  work.foveated_blocks += counted.desampling.blocks_foveated;
}

void count_tessellations(const std::vector<tilecore::TessellationRequest>& requests, TileCounts& work) {
  work.sub_patches += requests.size();
  for (const tilecore::TessellationRequest& request : requests) {
    work.moving_sub_patches += request.moving ? 1 : 0;
    work.defocused_sub_patches += request.defocused ? 1 : 0;
    work.displaced_sub_patches += request.displaced ? 1 : 0;
    work.alpha_tested_sub_patches += request.alpha_tested ? 1 : 0;
    work.blended_sub_patches += request.blended ? 1 : 0;
    work.triangles += request.triangles;
  }
}

}  // namespace tessera::gpu

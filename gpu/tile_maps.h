#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "binner/tile_grid.h"
#include "tilecore/tile_core.h"

namespace tessera::gpu {

// The work of one tile of a frame, partial renders and second passes included. Every member is a map of the report;
// kTileMapFields declares it.
struct TileCounts {
  std::uint64_t entries = 0;
  std::uint64_t queue_bytes_read = 0;
  std::uint64_t culled_occlusion = 0;
  std::uint64_t sub_patches = 0;
  std::uint64_t moving_sub_patches = 0;
  std::uint64_t defocused_sub_patches = 0;
  std::uint64_t displaced_sub_patches = 0;
  std::uint64_t alpha_tested_sub_patches = 0;
  std::uint64_t blended_sub_patches = 0;
  std::uint64_t procedure_samples = 0;
  std::uint64_t desampled_blocks = 0;
  std::uint64_t advected_pixels = 0;
  std::uint64_t foveated_blocks = 0;
  std::uint64_t triangles = 0;
  std::uint64_t box_tests = 0;
  std::uint64_t triangle_tests = 0;
  std::uint64_t sample_hits = 0;
  std::uint64_t samples_visible = 0;
  std::uint64_t pixel_shader_invocations = 0;
};

// Declaration of one map. `counter` is the frame's counter to which the map adds up over all tiles; "" if there is
// none.
struct TileMapField {
  std::string_view name;
  std::uint64_t TileCounts::*member;
  std::string_view unit;
  std::string_view meaning;
  std::string_view counter;
};
inline constexpr auto kTileMapFields = std::to_array<TileMapField>({
    {"entries", &TileCounts::entries, "entries", "Entries of lists that the tile read.", "tilecore.entries_fetched"},
    {"queue_bytes_read", &TileCounts::queue_bytes_read, "bytes",
     "Bytes of its lists and of the sub-patch table that the tile read.", "binner.queue_bytes_read"},
    {"culled_occlusion", &TileCounts::culled_occlusion, "entries",
     "Entries dropped because all samples of the tile saw a nearer surface.", "tilecore.culled_occlusion"},
    {"sub_patches", &TileCounts::sub_patches, "sub-patches",
     "Tessellated sub-patches that the tile tested, from the cache or made anew.", "tilecore.tessellation_requests"},
    {"moving_sub_patches", &TileCounts::moving_sub_patches, "sub-patches",
     "Sub-patches of these that ran the kernels for motion.", ""},
    {"defocused_sub_patches", &TileCounts::defocused_sub_patches, "sub-patches",
     "Sub-patches of these that ran the kernels for the lens.", ""},
    {"displaced_sub_patches", &TileCounts::displaced_sub_patches, "sub-patches",
     "Sub-patches of these whose vertices were displaced.", ""},
    {"alpha_tested_sub_patches", &TileCounts::alpha_tested_sub_patches, "sub-patches",
     "Sub-patches of these whose hits were tested for alpha.", ""},
    {"blended_sub_patches", &TileCounts::blended_sub_patches, "sub-patches",
     "Sub-patches of these that were kept as layers.", ""},
    {"procedure_samples", &TileCounts::procedure_samples, "samples",
     "Samples of procedures that the tile's array took.", "procedures.samples"},
    {"desampled_blocks", &TileCounts::desampled_blocks, "blocks",
     "Blocks of which fewer than 16 pixels were to be shaded.", ""},
    {"advected_pixels", &TileCounts::advected_pixels, "pixels",
     "Pixels taken from the previous frame or the other eye.", ""},
    {"foveated_blocks", &TileCounts::foveated_blocks, "blocks",
     "Blocks that foveation limits to fewer than 16 samples.", ""},
    {"triangles", &TileCounts::triangles, "triangles", "Triangles of these sub-patches.", ""},
    {"box_tests", &TileCounts::box_tests, "tests", "Samples or tiles tested against boxes.", "tilecore.box_tests"},
    {"triangle_tests", &TileCounts::triangle_tests, "tests", "Samples tested against triangles.",
     "tilecore.triangle_tests"},
    {"sample_hits", &TileCounts::sample_hits, "samples", "Triangle tests that hit.", "tilecore.sample_hits"},
    {"samples_visible", &TileCounts::samples_visible, "samples", "Samples that see an opaque surface.",
     "tilecore.samples_visible"},
    {"pixel_shader_invocations", &TileCounts::pixel_shader_invocations, "invocations", "Pixel-shader invocations.",
     "tilecore.pixel_shader_invocations"},
});
static_assert(sizeof(TileCounts) == sizeof(std::uint64_t) * kTileMapFields.size(),
              "each map needs exactly one declaration");

// The maps of one frame, tile by tile, row by row from the top left. Like counters, they follow from the frame alone.
struct TileMaps {
  int x0 = 0, y0 = 0;  // pixel of the frame at which the first tile begins; it may lie before the region
  int tile_width = 0, tile_height = 0, columns = 0, rows = 0;
  std::vector<TileCounts> tiles;

  TileMaps() = default;
  explicit TileMaps(const binner::TileGrid& grid);

  // Adds the work of another view of the same frame.
  void add(const TileMaps& view);
};

// Adds the counters of the tile's core.
void count_work(const tilecore::CoreCounters& counted, TileCounts& work);

// Adds the tile's requests to the tessellator.
void count_tessellations(const std::vector<tilecore::TessellationRequest>& requests, TileCounts& work);

}  // namespace tessera::gpu

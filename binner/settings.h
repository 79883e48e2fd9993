#pragma once

#include <cstdint>

#include "base/key_table.h"

namespace tessera::binner {

// Choice of the tiles that get an entry.
enum class CoverageMethod : std::uint8_t {
  kRectangle,  // all tiles of the bounding rectangle
  kExact,      // tiles that the moving box itself may touch
};

// Reaction to a full parameter buffer.
enum class FullPolicy : std::uint8_t {
  kPartialRender,  // renders the sub-patches binned so far
  kSpill,          // continues the lists in an overflow area
};

// Keys binner.*.
struct Settings {
  CoverageMethod coverage = CoverageMethod::kExact;
  bool time_intervals = true;
  int time_segments = 1;                // 0: chosen from blur length over primitive size
  int queue_levels = 1;                 // lists of single tiles, of 2x2, 4x4 ... tiles
  std::int64_t combining_bursts = 256;  // write-combining lines in front of the parameter buffer
};
Keys<Settings> settings_keys();

// Keys tile.*: size in pixels, multiples of 8; whether tiles with unchanged inputs are skipped.
struct TileSize {
  int width = 32, height = 32;
  bool rendering_elimination = false;
  bool fit = false;  // width and height follow from the tile memory (gpu/tile_memory.h)
};
Keys<TileSize> tile_keys();

// Keys parameter_buffer.*.
struct ParameterBufferSettings {
  std::int64_t bytes = 10 << 20;
  std::int64_t first_chunk_bytes = 32;
  std::int64_t chunk_bytes = 64;
  FullPolicy full_policy = FullPolicy::kPartialRender;
};
Keys<ParameterBufferSettings> parameter_buffer_keys();

// Settings of the binner and its parameter buffer, and the memory's burst.
struct BinnerSpec {
  Settings binner;
  ParameterBufferSettings parameter_buffer;
  std::int64_t burst_bytes = 64;
};

}  // namespace tessera::binner

namespace tessera {

template <>
inline constexpr auto kEnumWords<binner::CoverageMethod> = std::to_array<std::string_view>({"rectangle", "exact"});
template <>
inline constexpr auto kEnumWords<binner::FullPolicy> = std::to_array<std::string_view>({"partial_render", "spill"});

}  // namespace tessera

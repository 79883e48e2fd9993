#include "binner/settings.h"

namespace tessera::binner {

Keys<Settings> settings_keys() {
  return {
      {"binner.coverage", &Settings::coverage,
       "Tiles that get an entry: all tiles of the bounding rectangle, or the tiles that the moving box itself may "
       "touch.",
       "[assumed]"},
      {"binner.time_intervals", &Settings::time_intervals,
       "Stores in an entry the times at which the moving box may touch the tile, from the box against the tile's "
       "frustum; drops tiles that it touches at no time.",
       "[assumed]"},
      {"binner.time_segments", &Settings::time_segments, "segments", 0, 16,
       "Pieces into which the shutter is cut, each with its own bounding rectangle; 0: the distance that the box's "
       "centre travels on screen, in units of the box's larger side (at least a tile).",
       "[assumed]"},
      {"binner.queue_levels", &Settings::queue_levels, "levels", 1, 5,
       "Levels of lists: single tiles, then groups of 2x2, 4x4, 8x8 and 16x16 tiles; every tile of a group reads the "
       "group's entries.",
       "[spec] Mali since Midgard: power-of-two multiples of 16x16 pixels; [assumed] flat"},
      {"binner.combining_bursts", &Settings::combining_bursts, "bursts", 1, 65536,
       "Bursts that the binner keeps open on chip to combine writes to lists, their cursors and the sub-patch table.",
       "[assumed]"},
  };
}

Keys<TileSize> tile_keys() {
  return {
      {"tile.width", &TileSize::width, "pixels", 8, 256, "Width of the on-chip render area of one tile core.",
       "[spec] 16 on Mali-G31, 32 on classic PowerVR and Mali-G715, 64 on Immortalis-G720"},
      {"tile.height", &TileSize::height, "pixels", 8, 256, "Height of the on-chip render area of one tile core.",
       "[spec] as tile.width"},
      {"tile.rendering_elimination", &TileSize::rendering_elimination,
       "Whether a tile is not rendered, and its pixels stay as they are, when all that it would be rendered from has "
       "the signature (frame_buffer.signature_bits) of the frame before. Signatures are read and written in memory.",
       "[spec] Anglada et al. 2019, rendering elimination; [assumed] off"},
      {"tile.fit", &TileSize::fit,
       "Whether tiles have the largest power of two of pixels, from 64 to 4096, whose samples fit twice into "
       "tilecore.memory_bytes; tile.width and tile.height are then of no account. Samples that do not fit into a tile "
       "of "
       "8x8 pixels are written to memory and read back.",
       "[spec] as on Mali, Apple and V3D, hardware/tile_rules.h; [assumed] off"},
  };
}

Keys<ParameterBufferSettings> parameter_buffer_keys() {
  return {
      {"parameter_buffer.bytes", &ParameterBufferSettings::bytes, "bytes", 256, 4294967296.0,
       "Memory that holds the tile lists and the sub-patch table.",
       "[spec] PowerVR drivers start at 2 MiB, Mali's at 10 MiB (up to 128 MiB)"},
      {"parameter_buffer.first_chunk_bytes", &ParameterBufferSettings::first_chunk_bytes, "bytes", 16, 4096,
       "First chunk of each list, which the number of the list addresses.",
       "[spec] Broadcom V3D: 64-byte initial lists; [assumed] 32, which hold most lists"},
      {"parameter_buffer.chunk_bytes", &ParameterBufferSettings::chunk_bytes, "bytes", 32, 2097152,
       "Size of the further chunks in which lists get the parameter buffer.",
       "[spec] Broadcom V3D: 4 KiB; [assumed] 64, as lists are short"},
      {"parameter_buffer.full_policy", &ParameterBufferSettings::full_policy,
       "Reaction to a full parameter buffer: render the sub-patches binned so far and go on, or continue in an "
       "overflow area.",
       "[spec] PowerVR, Mali and Apple render partially; V3D takes overflow memory"},
  };
}

}  // namespace tessera::binner

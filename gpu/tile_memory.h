#pragma once

#include <cstdint>
#include <string>

#include "gpu/configuration.h"
#include "gpu/settings.h"

namespace tessera::gpu {

// A core works on at least one tile, so its memory must hold the samples of one tile. A machine with less cannot be
// built. If a preset's memory is too small for the samples or tiles of a replay, the machine gets as much as one tile
// needs, with the area, leakage and energy per access of that memory; a size that the user chose is refused instead.
// Further data of frames (layers, tables of triangles, vertices) reduce the number of tiles in progress and do not
// enlarge the memory.

// With tile.fit the memory decides: tiles are as large as it holds, and samples that the smallest tile does not hold spill
// (TileCore::spill()).

// Bytes of tile.width x tile.height pixels, tilecore::SampleLayout::room_bytes() for each sample.
std::uint64_t tile_sample_bytes(const GpuConfiguration& gpu, const RunSettings& settings);

// Sets tile.width and tile.height to the largest power of two of pixels whose state fits twice.
void fit_tile(GpuConfiguration& gpu, const RunSettings& settings);

// Makes tilecore.memory_bytes at least that, or, with tile.fit, the tile as large as it may be. Returns a note for people;
// "" if the memory was large enough.
std::string grow_tile_memory(GpuConfiguration& gpu, const RunSettings& settings);

// Throws UsageError naming the numbers that do not fit, if it is less.
void check_tile_memory(const GpuConfiguration& gpu, const RunSettings& settings);

// Calls the check if `chosen`, the size being the user's own and not a preset's; otherwise grows the memory.
std::string fit_tile_memory(GpuConfiguration& gpu, const RunSettings& settings, bool chosen);

}  // namespace tessera::gpu

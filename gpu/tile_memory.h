#pragma once

#include <cstdint>
#include <string>

#include "gpu/configuration.h"
#include "gpu/settings.h"

namespace tessera::gpu {

// A core works on one tile at least, so its memory holds what the samples of one see. A machine with less cannot be built.
// Where a preset's memory is too small for the samples or the tiles that someone asks for, the machine has as much as one
// tile needs, and its area, leakage and energy per access are those of that memory; a size that someone has chosen is
// refused. What frames keep beside (layers, tables of triangles, vertices) leaves fewer tiles in work, not a larger memory.

// With tile.fit it is the other way round: tiles have what the memory holds, and what the smallest one does not hold spills
// (TileCore::spill()).

// Bytes of tile.width x tile.height pixels, tilecore::SampleLayout::room_bytes() for each sample.
std::uint64_t tile_sample_bytes(const GpuConfiguration& gpu, const RunSettings& settings);

// Sets tile.width and tile.height to the largest power of two of pixels whose state fits twice.
void fit_tile(GpuConfiguration& gpu, const RunSettings& settings);

// Makes tilecore.memory_bytes at least that, or, with tile.fit, the tile as large as it may be. Returns what was done, for people; "" where it was enough.
std::string grow_tile_memory(GpuConfiguration& gpu, const RunSettings& settings);

// Throws UsageError saying which numbers do not fit, if it is less.
void check_tile_memory(const GpuConfiguration& gpu, const RunSettings& settings);

// Either of the two; `chosen`: the size is someone's own, not that of a preset.
std::string fit_tile_memory(GpuConfiguration& gpu, const RunSettings& settings, bool chosen);

}  // namespace tessera::gpu

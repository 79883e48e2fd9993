#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "baselines/baseline_counters.h"
#include "binner/tile_grid.h"
#include "gpu/configuration.h"
#include "gpu/view_observer.h"

namespace tessera::baselines {

// What a smaller buffer would cost, by what the frame did with one that held all: one in which what is handed out, behind
// what every list has from the start, finds half the room that it needs. It is handed out in the order in which it was
// asked for.
struct BufferPressure {
  std::uint64_t needed_bytes = 0;          // the smallest buffer with neither a partial render nor a spill
  std::uint64_t partial_render_bytes = 0;  // tile state stored and loaded again, with half the room
  std::uint64_t spill_bytes = 0;           // written to and read from the overflow area, with half the room
};

inline void set_pressure(const BufferPressure& pressure, BaselineCounters& counters) {
  counters.smallest_buffer_bytes = pressure.needed_bytes;
  counters.partial_render_bytes = pressure.partial_render_bytes;
  counters.spill_bytes = pressure.spill_bytes;
}

// A tile's list grew when so many bytes of the buffer were in use.
struct Growth {
  std::uint64_t bytes_in_use;
  binner::TileIndex tile;
};

// Tiles that got something since the buffer was emptied render it: they load the state that they stored before, if any,
// and store it; at the end all load it. So every tile that gets something in a round that is not the last stores and
// loads its state once. `state_bytes`: of a tile, in bursts.
std::uint64_t partial_render_bytes(std::span<const Growth> growth, std::uint64_t fixed_bytes,
                                   std::uint64_t needed_bytes, std::uint64_t capacity_bytes,
                                   std::span<const std::uint64_t> state_bytes);

// Bytes of that smaller buffer. `fixed_bytes`: what every list has from the start; `least_bytes`: smallest room.
std::uint64_t half_buffer_bytes(std::uint64_t needed_bytes, std::uint64_t fixed_bytes, std::uint64_t least_bytes,
                                std::uint64_t burst_bytes);

// State of unfinished tiles in bursts: `bytes_per_sample` for each sample.
std::vector<std::uint64_t> tile_state_bytes(const binner::TileGrid& grid, int samples_per_pixel,
                                            std::uint64_t bytes_per_sample, std::uint64_t burst_bytes);

// Of a machine that bins patches: its sub-patches put into further parameter buffers in the same order, as if each tile
// had a list of its own, tile by tile. What spills is written once and read once.
BufferPressure queue_pressure(const gpu::ObservedWork& record, const gpu::GpuConfiguration& gpu,
                              std::span<const std::uint64_t> state_bytes);

}  // namespace tessera::baselines

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "baselines/baseline_counters.h"
#include "binner/tile_grid.h"
#include "gpu/configuration.h"
#include "gpu/view_observer.h"

namespace tessera::baselines {

// Cost of a smaller parameter buffer, computed from a frame whose buffer held everything. The smaller buffer has half
// the needed room behind the fixed part that every list has from the start. Room is given in the order of the requests.
struct BufferPressure {
  std::uint64_t needed_bytes = 0;          // the smallest buffer with neither a partial render nor a spill
  std::uint64_t partial_render_bytes = 0;  // tile state stored and loaded again, with half the room
  std::uint64_t spill_bytes = 0;           // bytes written to and read from the overflow area, with half the room
};

inline void set_pressure(const BufferPressure& pressure, BaselineCounters& counters) {
  counters.smallest_buffer_bytes = pressure.needed_bytes;
  counters.partial_render_bytes = pressure.partial_render_bytes;
  counters.spill_bytes = pressure.spill_bytes;
}

// Growth of a tile's list, and the bytes of the buffer in use at that time.
struct Growth {
  std::uint64_t bytes_in_use;
  binner::TileIndex tile;
};

// Tile state that partial renders move. When the buffer is full, the tiles that got entries since it was emptied are
// rendered: they load their stored state, if any, and store it; at the end all load it. So every tile that gets
// entries in a round before the last stores and loads its state once. `state_bytes`: bytes of each tile, in bursts.
std::uint64_t partial_render_bytes(std::span<const Growth> growth, std::uint64_t fixed_bytes,
                                   std::uint64_t needed_bytes, std::uint64_t capacity_bytes,
                                   std::span<const std::uint64_t> state_bytes);

// Size of the smaller buffer. `fixed_bytes`: fixed part of all lists; `least_bytes`: smallest room behind it.
std::uint64_t half_buffer_bytes(std::uint64_t needed_bytes, std::uint64_t fixed_bytes, std::uint64_t least_bytes,
                                std::uint64_t burst_bytes);

// State of unfinished tiles in bursts, with `bytes_per_sample` for each sample.
std::vector<std::uint64_t> tile_state_bytes(const binner::TileGrid& grid, int samples_per_pixel,
                                            std::uint64_t bytes_per_sample, std::uint64_t burst_bytes);

// Pressure of a machine that bins patches: its sub-patches are put into further parameter buffers in the same order,
// as if each tile had its own list, tile by tile. Spilled entries are written once and read once.
BufferPressure queue_pressure(const gpu::ObservedWork& record, const gpu::GpuConfiguration& gpu,
                              std::span<const std::uint64_t> state_bytes);

}  // namespace tessera::baselines

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "baselines/baseline_counters.h"
#include "binner/tile_grid.h"
#include "gpu/configuration.h"
#include "gpu/machine_record.h"

namespace tessera::baselines {

// What a buffer half as large as a frame's lists need would cost, by what the frame did with one that held all. List
// heads always fit; what follows them is handed out in the order in which it was asked for.
struct BufferPressure {
  std::uint64_t needed_bytes = 0;          // the smallest buffer with neither a partial render nor a spill
  std::uint64_t partial_render_bytes = 0;  // tile state stored and loaded again, with half of it
  std::uint64_t spill_bytes = 0;           // written to and read from the overflow area, with half of it
};

inline void set_pressure(const BufferPressure& pressure, BaselineCounters& counters) {
  counters.smallest_buffer_bytes = pressure.needed_bytes;
  counters.partial_render_bytes = pressure.partial_render_bytes;
  counters.spill_bytes = pressure.spill_bytes;
}

// A tile's list grew when so many bytes of the buffer, its list heads included, were in use.
struct Growth {
  std::uint64_t bytes_in_use;
  binner::TileIndex tile;
};

// Tiles that got something since the buffer was emptied render it: they load the state that they stored before, if any,
// and store it; at the end all load it. So every tile that gets something in a round that is not the last stores and
// loads its state once. `state_bytes`: of a tile, in bursts.
std::uint64_t partial_render_bytes(std::span<const Growth> growth, std::uint64_t head_bytes, std::uint64_t needed_bytes,
                                   std::uint64_t capacity_bytes, std::span<const std::uint64_t> state_bytes);

// State of unfinished tiles in bursts: `bytes_per_sample` for each sample.
std::vector<std::uint64_t> tile_state_bytes(const binner::TileGrid& grid, int samples_per_pixel,
                                            std::uint64_t bytes_per_sample, std::uint64_t burst_bytes);

// Of a machine that bins patches, from the lists of its run as if each tile had its own. Entries of a patch count as
// written tile by tile.
BufferPressure queue_pressure(const gpu::MachineRecord& record, const gpu::GpuConfiguration& gpu,
                              std::span<const std::uint64_t> state_bytes);

}  // namespace tessera::baselines

#pragma once

#include <cstdint>
#include <vector>

#include "gpu/device.h"
#include "memory/address_map.h"
#include "memory/dram_trace.h"

namespace tessera::gpu {

// Bursts of a frame in the order of their cycles, which count from the start of the frame: those of each phase spread
// evenly over the time that the timing model gives it, what the tile cores do at the same time interleaved.
//
// Invariants (cited by the tests):
//   DT1  As many bursts as the frame's ledger has bytes over burst_bytes, reads and writes apart.
//   DT2  Cycles never fall.
std::vector<memory::Burst> frame_bursts(const MachineModel& model, const memory::AddressMap& map,
                                        std::uint64_t burst_bytes);

// Where a frame's buffers lie.
memory::AddressMap address_map(const Device& renderer, const GpuConfiguration& gpu, const RunSettings& settings,
                               const RenderRequest& request);

}  // namespace tessera::gpu

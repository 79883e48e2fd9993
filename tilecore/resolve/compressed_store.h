#pragma once

#include <array>
#include <cstdint>

#include "base/counter.h"
#include "base/image.h"
#include "base/rect.h"
#include "memory/ledger.h"

namespace tessera::tilecore {

struct CompressionCounters {
  std::uint64_t frame_blocks = 0;
  std::uint64_t frame_blocks_raw = 0;
  std::uint64_t frame_bytes_raw = 0;
  std::uint64_t frame_bytes_compressed = 0;
};

// Charges the frame buffer for the finished image of `region` as lossless compression (frame_compression.h) stores
// it: blocks of 8x4 pixels that lie on multiples of 8 and 4 pixels of the frame, and so in one tile each. Blocks that
// the region cuts are stored raw, by rows. `color`: linear RGB and coverage; it is the half floats of it that are
// compressed. Runs on all threads.
void charge_compressed_frame(const Image& color, IntRect region, std::uint64_t burst_bytes,
                             CompressionCounters& counters, memory::Ledger& ledger);

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr bool kAbsentWhenIdle<tilecore::CompressionCounters> = true;

template <>
inline constexpr auto kCounterFields<tilecore::CompressionCounters> =
    std::to_array<CounterField<tilecore::CompressionCounters>>({
        {"resolve.frame_blocks", &tilecore::CompressionCounters::frame_blocks, Combine::kSum, "blocks",
         "Blocks of 8x4 finished pixels, with frame_buffer.compression.", ""},
        {"resolve.frame_blocks_raw", &tilecore::CompressionCounters::frame_blocks_raw, Combine::kSum, "blocks",
         "Of these, stored as they are: no shorter code, or cut by the region.", ""},
        {"resolve.frame_bytes_raw", &tilecore::CompressionCounters::frame_bytes_raw, Combine::kSum, "bytes",
         "What the frame would take without compression, in bursts.", ""},
        {"resolve.frame_bytes_compressed", &tilecore::CompressionCounters::frame_bytes_compressed, Combine::kSum,
         "bytes", "What it takes, headers included, in bursts.",
         "Arm AFBC, Qualcomm UBWC: write bandwidth of the display buffer"},
    });
TESSERA_COUNTERS_COVER(tilecore::CompressionCounters);

}  // namespace tessera

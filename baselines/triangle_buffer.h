#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "baselines/buffer_pressure.h"
#include "binner/tile_grid.h"
#include "binner/tile_lists.h"
#include "binner/write_combiner.h"
#include "gpu/configuration.h"
#include "memory/ledger.h"

namespace tessera::baselines {

// Payload bytes that moved, by the burst that they lie in.
class BurstBytes {
 public:
  explicit BurstBytes(std::uint64_t burst_bytes) : burst_bytes_(burst_bytes) {}
  void add(std::uint64_t address, std::uint64_t bytes);
  // Sum of the bytes at and after an address, which must be a multiple of the burst.
  std::uint64_t from(std::uint64_t address) const;

 private:
  std::uint64_t burst_bytes_;
  std::vector<std::uint64_t> bytes_;
};

// The parameter buffer of a machine that bins triangles: blocks of triangles, and a list of bytes per tile.
//
// Memory layout: the fixed part of TileLists; then, in the order of requests, chunks of parameter_buffer.chunk_bytes on whole
// bursts, and blocks aligned to kBlockAlignment. Lists are built as in this machine (chunks, links, cursors, ends), behind the
// same write combiner; the writer's state fits a cursor's word [in their favour]. The buffer never refuses: see overflows().
//
// Invariants (cited by the tests):
//   TB1  A list's bytes come back in the order in which they were appended.
//   TB2  Every burst that moves is in the ledger once, under tile_queue.
class TriangleBuffer {
 public:
  TriangleBuffer(const gpu::GpuConfiguration& gpu, binner::TileIndex tile_count);

  // Address of the next block.
  std::uint64_t next_block() const;
  // Writes a block at next_block() and returns its address.
  std::uint64_t store_block(std::span<const std::uint8_t> bytes);
  // Adds bytes to a tile's list.
  void append(binner::TileIndex tile, std::span<const std::uint8_t> bytes);
  void finish();

  // Reads a tile's list. Bursts are charged to `ledger` as tilecore / tile_queue; payload is added to `bytes_read`
  // and, unless nullptr, to `reads`.
  std::vector<std::uint8_t> read_list(binner::TileIndex tile, memory::Ledger& ledger, std::uint64_t& bytes_read,
                                      BurstBytes* reads = nullptr) const;
  std::span<const std::uint8_t> memory() const { return memory_; }

  std::uint64_t bytes_in_use() const { return memory_.size(); }
  std::uint64_t bytes_written() const { return block_bytes_ + lists_.content_bytes(); }
  // Number of times that a buffer of parameter_buffer.bytes ran full and another was taken.
  std::uint64_t overflows() const { return bytes_in_use() == 0 ? 0 : (bytes_in_use() - 1) / capacity_; }
  const memory::Ledger& ledger() const { return ledger_; }
  // `reads`: all bytes that were read. `state_bytes`: bytes of each tile.
  BufferPressure pressure(const BurstBytes& reads, std::span<const std::uint64_t> state_bytes) const;

 private:
  std::uint64_t add_chunk();
  void write(std::uint64_t address, std::uint64_t bytes);

  std::uint64_t capacity_, chunk_bytes_, burst_bytes_;
  std::vector<std::uint8_t> memory_;
  BurstBytes writes_;
  std::vector<Growth> growth_;
  std::vector<std::uint64_t> grew_at_;  // by tile: size at which its last growth was recorded
  std::uint64_t block_bytes_ = 0;
  memory::Ledger ledger_;
  binner::WriteCombiner combiner_;
  binner::TileLists lists_;
};

}  // namespace tessera::baselines

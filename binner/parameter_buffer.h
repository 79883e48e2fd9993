#pragma once

#include <cstdint>
#include <vector>

#include "base/counter.h"
#include "binner/queue_entry.h"
#include "binner/queue_hierarchy.h"
#include "binner/settings.h"
#include "binner/write_combiner.h"
#include "memory/ledger.h"
#include "scene/limits.h"

namespace tessera::binner {

struct BinnerCounters {
  std::uint64_t entries = 0;
  std::uint64_t group_entries = 0;
  std::uint64_t tile_overlaps = 0;
  std::uint64_t tiles_dropped_exact = 0;
  std::uint64_t tiles_dropped_time = 0;
  std::uint64_t interval_codes = 0;
  std::uint64_t queue_bytes_written = 0;
  std::uint64_t queue_bytes_read = 0;
  std::uint64_t queue_bytes_peak = 0;
  std::uint64_t partial_renders = 0;
  std::uint64_t spilled_chunks = 0;
};

// What begins a list in a parameter buffer, and each of its chunks.
inline constexpr std::uint64_t kListHeadBytes = 16, kChunkLinkBytes = 8;

// Queues of sub-patch references, one per tile or group of tiles, inside one parameter buffer of fixed size.
//
// Memory layout: one list head per queue (number of the first chunk, of the last, entries in all, zero), then chunks of
// parameter_buffer.chunk_bytes, each a link (number of the next chunk) and as many entries as fit.
// The bytes are really there: what a tile core reads is decoded from them.
//
// Configured by parameter_buffer.*, binner.combining_bursts, memory.burst_bytes.
// Invariants (cited by the tests):
//   PB1  bytes_in_use() <= capacity unless the policy is to spill: a full buffer refuses, it never drops an entry.
//   PB2  A queue's entries come back in the order in which they were appended.
//   PB3  Every burst that moves is in the ledger once, under tile_queue.
class ParameterBuffer {
 public:
  // Throws UsageError when not even the list heads and one chunk fit.
  ParameterBuffer(const BinnerSpec& spec, QueueIndex queue_count);

  // False: full, nothing was written; the caller renders what is there and calls reset().
  [[nodiscard]] bool append(QueueIndex queue, const QueueEntry& entry);

  // Writes back what is still on chip. Between this and the next append queues may be read.
  void finish();

  // Adds the queue's entries to `entries`, in order. Bursts read are charged to `ledger` as tilecore / tile_queue,
  // payload bytes to `bytes_read`. May be called by many threads at once.
  void read_queue(QueueIndex queue, std::vector<QueueEntry>& entries, memory::Ledger& ledger,
                  std::uint64_t& bytes_read) const;

  // Empties all queues.
  void reset();

  std::uint64_t bytes_in_use() const;
  const BinnerCounters& counters() const { return counters_; }
  BinnerCounters& counters() { return counters_; }
  const memory::Ledger& ledger() const { return ledger_; }
  // What the buffer takes of the emulator's memory from now on is charged to `budget`; LimitError when that is too much.
  void limit(scene::MemoryBudget* budget) { budget_ = budget; }
  // The binner's own transfers from now on also go to `log`.
  void record_accesses(memory::AccessLog* log) { ledger_.record_into(log); }

 private:
  struct Head {
    std::uint32_t first_chunk = 0, last_chunk = 0, entries = 0;
  };
  static_assert(sizeof(Head) <= kListHeadBytes);
  std::uint64_t chunk_address(std::uint64_t chunk) const { return heads_bytes_ + chunk * chunk_bytes_; }
  bool add_chunk(Head& head);
  void store_head(QueueIndex queue, const Head& head);
  Head load_head(QueueIndex queue) const;

  std::uint64_t capacity_, chunk_bytes_, burst_bytes_, entries_per_chunk_, heads_bytes_;
  bool spill_;
  std::vector<std::uint8_t> memory_;  // grows with the chunks in use
  scene::MemoryBudget* budget_ = nullptr;
  std::uint64_t chunks_in_use_ = 0;
  BinnerCounters counters_;
  memory::Ledger ledger_;
  WriteCombiner combiner_;
};

}  // namespace tessera::binner

namespace tessera {

template <>
inline constexpr auto kCounterFields<binner::BinnerCounters> = std::to_array<CounterField<binner::BinnerCounters>>({
    {"binner.entries", &binner::BinnerCounters::entries, Combine::kSum, "entries",
     "Entries written to tile lists. A sub-patch counts once for every queue it is in.",
     "PowerVR Tiles per Triangle (times Triangles Out); Adreno visibility stream size"},
    {"binner.group_entries", &binner::BinnerCounters::group_entries, Combine::kSum, "entries",
     "Those of binner.entries that went to queues of groups of tiles.", ""},
    {"binner.tile_overlaps", &binner::BinnerCounters::tile_overlaps, Combine::kSum, "tiles",
     "Pairs of a sub-patch and a tile that it may touch, as far as the selected coverage methods can tell.",
     "PowerVR Tiles per Triangle (times primitives)"},
    {"binner.tiles_dropped_exact", &binner::BinnerCounters::tiles_dropped_exact, Combine::kSum, "tiles",
     "Pairs of a sub-patch and a tile of its bounding rectangle that exact coverage dropped.", ""},
    {"binner.tiles_dropped_time", &binner::BinnerCounters::tiles_dropped_time, Combine::kSum, "tiles",
     "Pairs of a sub-patch and a tile of its coverage that time intervals or segments dropped: never both in place at "
     "once.",
     ""},
    {"binner.interval_codes", &binner::BinnerCounters::interval_codes, Combine::kSum, "1/256 shutter",
     "Lengths of the time intervals of all entries; 256 each without motion.", ""},
    {"binner.queue_bytes_written", &binner::BinnerCounters::queue_bytes_written, Combine::kSum, "bytes",
     "Bytes of entries, chunk links and list heads written by the binner, before rounding to bursts.",
     "MaliTilerWrBt (times the bus width); V3D PTB-memory-words-writes"},
    {"binner.queue_bytes_read", &binner::BinnerCounters::queue_bytes_read, Combine::kSum, "bytes",
     "Bytes of entries, chunk links and list heads read by tile cores, before rounding to bursts.",
     "MaliTilerRdBt (times the bus width); V3D PTB-memory-reads"},
    {"binner.queue_bytes_peak", &binner::BinnerCounters::queue_bytes_peak, Combine::kPeak, "bytes",
     "Most parameter-buffer memory in use at any time: list heads and whole chunks.",
     "PowerVR Parameter Buffer size; Apple tiled vertex buffer"},
    {"binner.partial_renders", &binner::BinnerCounters::partial_renders, Combine::kSum, "renders",
     "Times that a full parameter buffer made all tiles render what they had.",
     "PowerVR SPM; Apple partial render; Mali incremental render; Adreno vsc_draw_overflow, vsc_prim_overflow"},
    {"binner.spilled_chunks", &binner::BinnerCounters::spilled_chunks, Combine::kSum, "chunks",
     "Chunks taken from the overflow area because the parameter buffer was full.",
     "V3D binner out-of-memory interrupt"},
});
TESSERA_COUNTERS_COVER(binner::BinnerCounters);

}  // namespace tessera

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/counter.h"
#include "binner/list_entry.h"
#include "binner/list_levels.h"
#include "binner/settings.h"
#include "binner/tile_lists.h"
#include "binner/write_combiner.h"
#include "memory/ledger.h"
#include "scene/limits.h"

namespace tessera::binner {

struct BinnerCounters {
  std::uint64_t entries = 0;
  std::uint64_t tile_overlaps = 0;
  std::uint64_t tiles_dropped = 0;
  std::uint64_t table_records = 0;
  std::uint64_t queue_bytes_written = 0;
  std::uint64_t queue_bytes_read = 0;
  std::uint64_t queue_bytes_peak = 0;
  std::uint64_t partial_renders = 0;
  std::uint64_t spilled_bytes = 0;
};

// A table of sub-patches, and lists of them, one per tile or group of tiles, inside one parameter buffer of fixed size.
//
// Lists (TileLists) grow from address 0 on, the table from table_address() on, both in virtual memory: together they
// take no more than parameter_buffer.bytes. The bytes really exist: tile cores decode their entries from them.
//
//   lists    entries as in list_code.h
//   table    a record for each sub-patch that is in a list, in the order of binning, as in list_entry.h; a record's
//            number is its address over kSlotBytes
//
// Configured by parameter_buffer.*, binner.combining_bursts, memory.burst_bytes.
// Invariants (cited by the tests):
//   PB1  bytes_in_use() <= capacity unless the policy is to spill: a full buffer refuses, it never drops an entry.
//   PB2  A list's entries come back in the order in which they were appended.
//   PB3  Every burst that moves is in the ledger once, under tile_queue.
//   PB4  An entry that is refused leaves no byte behind, neither in the list nor in the table.
//   PB5  A sub-patch has one record, which says how many lists hold it.
class ParameterBuffer {
 public:
  // The first address that no list can reach.
  static std::uint64_t table_address(const BinnerSpec& spec);

  // Throws UsageError when the first chunks, one further chunk and one burst of records do not fit.
  ParameterBuffer(const BinnerSpec& spec, QueueIndex list_count);

  // Puts a sub-patch into the lists of `placements` from `next` on and moves `next` behind the lists that took it.
  // Returns false when the buffer is full: the caller then renders the entries in the buffer, calls reset() and goes on
  // with `next`.
  [[nodiscard]] bool append(const ListEntry& sub_patch, std::span<const ListLevels::Placement> placements,
                            std::uint32_t& next);

  // Writes back the lines that are still on chip, and reads, for the tile scheduler, which lists have entries. Lists
  // may be read between this call and the next append.
  void finish();

  // Transfers of list signatures, which the binner makes on chip beside the lists: it reads the previous frame's for
  // the tile scheduler and writes the new ones. Both begin a burst.
  void read_signatures(std::uint64_t offset, std::uint64_t bytes) {
    ledger_.read_at(memory::Unit::kBinner, memory::Purpose::kSignatures, offset, bytes, burst_bytes_);
  }
  void write_signatures(std::uint64_t offset, std::uint64_t bytes) {
    ledger_.write_at(memory::Unit::kBinner, memory::Purpose::kSignatures, offset, bytes, burst_bytes_);
  }

  // Adds the list's entries to `entries`, in order. Charges the bursts of the list to `ledger` as tilecore / tile_queue
  // and adds its bytes to `bytes_read`; RecordCache charges the reads of the table. Many threads may call it at once.
  void read_queue(QueueIndex list, std::vector<ListEntry>& entries, memory::Ledger& ledger,
                  std::uint64_t& bytes_read) const;

  // Empties lists and table.
  void reset();

  // Bytes of first chunks, further chunks and records, in whole bursts.
  std::uint64_t bytes_in_use() const { return bytes_with(chunks_, table_.size()); }
  // One more than the largest record number.
  std::uint32_t end_of_records() const { return static_cast<std::uint32_t>(table_.size() / kSlotBytes); }
  std::span<const std::uint8_t> table() const { return table_; }
  std::span<const std::uint8_t> lists_memory() const { return memory_; }
  const TileLists::Layout& layout() const { return lists_.layout(); }
  std::uint64_t table_bytes_written() const { return table_bytes_written_; }
  const BinnerCounters& counters() const { return counters_; }
  BinnerCounters& counters() { return counters_; }
  const memory::Ledger& ledger() const { return ledger_; }
  // Charges the emulator's memory that the buffer takes from now on to `budget`; throws LimitError when it is too much.
  void limit(scene::MemoryBudget* budget) { budget_ = budget; }
  // Also sends the binner's own transfers from now on to `log`.
  void record_accesses(memory::AccessLog* log) { ledger_.record_into(log); }

 private:
  std::uint64_t bytes_with(std::uint64_t chunks, std::uint64_t table_bytes) const;
  // `record`: the record of a sub-patch that has none yet; otherwise null.
  bool append_entry(const ListLevels::Placement& placement, const PackedRecord* record);
  std::uint32_t number_of_next(const PackedRecord& record) const;
  void write_record(std::uint32_t number, std::span<const std::uint8_t> bytes);
  void grow(std::vector<std::uint8_t>& memory, std::uint64_t bytes);
  std::uint64_t add_chunk();
  void count_content();

  std::uint64_t capacity_, burst_bytes_, table_address_;
  bool spill_;
  std::vector<std::uint8_t> memory_, table_;  // they grow with the bytes in use
  scene::MemoryBudget* budget_ = nullptr;
  std::uint64_t chunks_ = 0;
  std::uint64_t spilled_from_ = 0, records_spilled_from_ = 0;  // first addresses of the overflow area
  std::uint32_t last_record_ = 0;
  std::vector<std::uint8_t> code_;
  std::uint64_t table_bytes_written_ = 0;
  BinnerCounters counters_;
  memory::Ledger ledger_;
  WriteCombiner combiner_;
  TileLists lists_;
};

}  // namespace tessera::binner

namespace tessera {

template <>
inline constexpr auto kCounterFields<binner::BinnerCounters> = std::to_array<CounterField<binner::BinnerCounters>>({
    {"binner.entries", &binner::BinnerCounters::entries, Combine::kSum, "entries",
     "Entries written to tile lists. A sub-patch counts once for every list that holds it.",
     "PowerVR Tiles per Triangle (times Triangles Out); Adreno visibility stream size"},
    {"binner.tile_overlaps", &binner::BinnerCounters::tile_overlaps, Combine::kSum, "tiles",
     "Pairs of a sub-patch and a tile that it may touch, as far as the selected coverage methods can tell.",
     "PowerVR Tiles per Triangle (times primitives)"},
    {"binner.tiles_dropped", &binner::BinnerCounters::tiles_dropped, Combine::kSum, "tiles",
     "Pairs of a sub-patch and a tile of its bounding rectangle that exact coverage, time intervals or time segments "
     "dropped: the sub-patch is never in the tile at the right time.",
     ""},
    {"binner.table_records", &binner::BinnerCounters::table_records, Combine::kSum, "records",
     "Records written to the sub-patch table: one for each sub-patch in a list, and again after a partial render.", ""},
    {"binner.queue_bytes_written", &binner::BinnerCounters::queue_bytes_written, Combine::kSum, "bytes",
     "Bytes of tile lists (entries, links, ends, a bit per list, a cursor for each list with entries) and of the "
     "sub-patch table, before rounding to bursts; bytes that are written again count once.",
     "MaliTilerWrBt (times the bus width); V3D PTB-memory-words-writes"},
    {"binner.queue_bytes_read", &binner::BinnerCounters::queue_bytes_read, Combine::kSum, "bytes",
     "Bytes that tile cores read: of lists before rounding to bursts, of the sub-patch table the bursts that its cache "
     "misses.",
     "MaliTilerRdBt (times the bus width); V3D PTB-memory-reads"},
    {"binner.queue_bytes_peak", &binner::BinnerCounters::queue_bytes_peak, Combine::kPeak, "bytes",
     "Most parameter-buffer memory in use at any time: whole chunks, the first one of every list among them, bits and "
     "cursors of lists, and the sub-patch table.",
     "PowerVR Parameter Buffer size; Apple tiled vertex buffer"},
    {"binner.partial_renders", &binner::BinnerCounters::partial_renders, Combine::kSum, "renders",
     "Times that a full parameter buffer made all tiles render the sub-patches binned so far.",
     "PowerVR SPM; Apple partial render; Mali incremental render; Adreno vsc_draw_overflow, vsc_prim_overflow"},
    {"binner.spilled_bytes", &binner::BinnerCounters::spilled_bytes, Combine::kSum, "bytes",
     "Bytes of lists and of the sub-patch table written to the overflow area, before rounding to bursts.",
     "V3D binner out-of-memory interrupt"},
});
TESSERA_COUNTERS_COVER(binner::BinnerCounters);

}  // namespace tessera

#pragma once

#include <cstdint>

#include "binner/parameter_buffer.h"
#include "memory/ledger.h"
#include "memory/lru_cache.h"

namespace tessera::binner {

// An on-chip LRU cache of bursts of the sub-patch table, shared by all tile cores. Tiles use it in emulated order.
//
// Contract: every burst that is fetched is in the ledger, under tilecore / tile_queue.
class RecordCache {
 public:
  static constexpr std::int64_t kBytes = 16 << 10;  // [assumed] a texture cache's size

  explicit RecordCache(const BinnerSpec& spec, std::int64_t capacity_bytes = kBytes)
      : table_address_(ParameterBuffer::table_address(spec)),
        burst_bytes_(static_cast<std::uint64_t>(spec.burst_bytes)),
        cache_(static_cast<std::uint64_t>(capacity_bytes)) {}

  // A tile core reads a record, which never crosses a burst. Returns the bytes fetched; `log` may be null.
  std::uint64_t read(std::uint32_t record, memory::AccessLog* log) {
    const std::uint64_t burst = record * std::uint64_t{kSlotBytes} / burst_bytes_;
    if (cache_.use(static_cast<std::uint32_t>(burst), burst_bytes_)) return 0;
    ledger_.record_into(log);
    ledger_.read_at(memory::Unit::kTilecore, memory::Purpose::kTileQueue, table_address_ + burst * burst_bytes_,
                    burst_bytes_, burst_bytes_);
    ledger_.record_into(nullptr);
    return burst_bytes_;
  }

  const memory::Ledger& ledger() const { return ledger_; }

 private:
  std::uint64_t table_address_, burst_bytes_;
  memory::LruCache cache_;
  memory::Ledger ledger_;
};

}  // namespace tessera::binner

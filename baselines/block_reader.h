#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "baselines/triangle_buffer.h"
#include "memory/ledger.h"
#include "memory/lru_cache.h"

namespace tessera::baselines {

// Counts the reads of parameter-buffer blocks by tile cores, burst by burst, through an LRU cache that the cores share.
class BlockReader {
 public:
  BlockReader(std::uint64_t burst_bytes, std::uint64_t cache_bytes)
      : reads(burst_bytes), burst_bytes_(burst_bytes), cache_(cache_bytes) {}

  // Adds bytes to the next read_asked().
  void ask(std::uint64_t address, std::uint64_t bytes) {
    for (std::uint64_t burst = address / burst_bytes_; bytes > 0 && burst <= (address + bytes - 1) / burst_bytes_;
         ++burst)
      bursts_.push_back(burst);
  }
  // Reads the added bytes in rising order, each burst once, and returns the bytes that the cache missed.
  std::uint64_t read_asked() {
    std::sort(bursts_.begin(), bursts_.end());
    bursts_.erase(std::unique(bursts_.begin(), bursts_.end()), bursts_.end());
    const std::uint64_t before = filled_;
    for (const std::uint64_t burst : bursts_) {
      asked_ += burst_bytes_;
      if (cache_.use(static_cast<std::uint32_t>(burst), burst_bytes_)) continue;
      ledger.read(memory::Unit::kTilecore, memory::Purpose::kTileQueue, burst_bytes_);
      filled_ += burst_bytes_;
      reads.add(burst * burst_bytes_, burst_bytes_);
    }
    bursts_.clear();
    return filled_ - before;
  }

  std::uint64_t asked_bytes() const { return asked_; }    // bytes asked of the cache
  std::uint64_t filled_bytes() const { return filled_; }  // bytes filled into it from memory

  BurstBytes reads;       // bursts that were filled, and further reads of the user
  memory::Ledger ledger;  // the same

 private:
  std::uint64_t burst_bytes_;
  memory::LruCache cache_;
  std::uint64_t asked_ = 0, filled_ = 0;
  std::vector<std::uint64_t> bursts_;
};

}  // namespace tessera::baselines

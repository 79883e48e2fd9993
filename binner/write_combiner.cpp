#include "binner/write_combiner.h"

namespace tessera::binner {

void WriteCombiner::evict(const Line& line) {
  if (line.changed)
    ledger_.write_at(memory::Unit::kBinner, memory::Purpose::kTileQueue, line.burst * burst_bytes_, burst_bytes_,
                     burst_bytes_);
}

void WriteCombiner::touch(std::uint64_t burst, bool change, bool fetch) {
  const auto found = where_.find(burst);
  if (found != where_.end()) {
    recent_.splice(recent_.begin(), recent_, found->second);
    recent_.front().changed = recent_.front().changed || change;
    return;
  }
  if (recent_.size() == lines_) {
    evict(recent_.back());
    where_.erase(recent_.back().burst);
    recent_.pop_back();
  }
  if (fetch)
    ledger_.read_at(memory::Unit::kBinner, memory::Purpose::kTileQueue, burst * burst_bytes_, burst_bytes_,
                    burst_bytes_);
  recent_.push_front({burst, change});
  where_[burst] = recent_.begin();
}

void WriteCombiner::write(std::uint64_t address, std::uint64_t bytes) {
  for (std::uint64_t b = address / burst_bytes_; b <= (address + bytes - 1) / burst_bytes_; ++b) touch(b, true, false);
}

void WriteCombiner::read(std::uint64_t address, std::uint64_t bytes) {
  for (std::uint64_t b = address / burst_bytes_; b <= (address + bytes - 1) / burst_bytes_; ++b) touch(b, false, true);
}

void WriteCombiner::flush() {
  for (const Line& line : recent_) evict(line);
  recent_.clear();
  where_.clear();
}

}  // namespace tessera::binner

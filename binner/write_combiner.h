#pragma once

#include <cstdint>
#include <list>
#include <unordered_map>

#include "memory/ledger.h"

namespace tessera::binner {

// On-chip lines of one burst each between the binner and memory; the least recently used line is evicted. Neighbouring
// writes meet in a line and leave as one burst; a line that is written again after its eviction leaves again. Reading a
// line that is not on chip fetches its burst.
//
// Contract: every burst that leaves or enters is in the ledger when it does, under binner / tile_queue.
class WriteCombiner {
 public:
  WriteCombiner(std::uint64_t lines, std::uint64_t burst_bytes, memory::Ledger& ledger)
      : lines_(lines), burst_bytes_(burst_bytes), ledger_(ledger) {}

  void write(std::uint64_t address, std::uint64_t bytes);
  void read(std::uint64_t address, std::uint64_t bytes);

  // Writes every changed line back; the lines are empty afterwards.
  void flush();

 private:
  struct Line {
    std::uint64_t burst;  // address / burst_bytes
    bool changed;
  };
  void touch(std::uint64_t burst, bool change, bool fetch);
  void evict(const Line& line);

  std::uint64_t lines_, burst_bytes_;
  memory::Ledger& ledger_;
  std::list<Line> recent_;  // most recently used first
  std::unordered_map<std::uint64_t, std::list<Line>::iterator> where_;
};

}  // namespace tessera::binner

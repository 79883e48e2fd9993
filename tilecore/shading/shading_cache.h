#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "tilecore/shading/shading_cells.h"

namespace tessera::tilecore {

// On-chip memory of a tile core that keeps shaded cells; fully associative, LRU. The owning shader keeps the cells'
// colours and numbers them: a tile's cells are shaded together, after all are known.
//
// Invariants (cited by the tests):
//   SHC1  A number from find() was inserted under the same name since empty(); so results never depend on the capacity.
//   SHC2  The `capacity` names found or inserted last are there.
class ShadingCache {
 public:
  // An entry as the machine would hold it: patch, part and cell (12 bytes), colour and alpha as half floats (8), age
  // (4).
  static constexpr std::uint64_t kBytesPerEntry = 24;

  // Forgets everything. The host's memory grows with the inserted cells, up to the capacity.
  void empty(std::size_t capacity);

  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;

  // The cell's number, or kNone.
  std::uint32_t find(const ShadingCell& cell);
  // `cell` must not be there.
  void insert(const ShadingCell& cell, std::uint32_t number);

  std::size_t size() const { return entries_.size(); }

 private:
  struct Entry {
    ShadingCell cell;
    std::uint32_t next_in_bucket, newer, older;
    std::uint32_t number;
  };
  std::uint32_t& bucket(const ShadingCell& cell);
  void grow();
  void unlink(std::uint32_t e);
  void make_newest(std::uint32_t e);

  std::size_t capacity_ = 1;
  std::vector<Entry> entries_;
  std::vector<std::uint32_t> buckets_;  // a power of two of them; first entry of each
  std::uint32_t newest_ = kNone, oldest_ = kNone;
};

}  // namespace tessera::tilecore

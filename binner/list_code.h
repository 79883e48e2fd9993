#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "binner/time_interval.h"

namespace tessera::binner {

// An entry of a tile's list: which record of the sub-patch table, and the times at which the sub-patch may touch the
// tile. A table of binner/README.md, which a test reads, gives the bytes of an entry:
//
//   byte 0   bit 0: times follow; bits 1..6: lowest bits of the distance; bit 7: a further byte of the distance follows
//   then     7 bits of the distance each, lowest first, bit 7: another follows
//   then     with bit 0: first and last code of the times
//
// The distance is the record's number minus the number of the previous entry's record, or plus 1 in the first entry. It
// is never 0, so no entry begins with a byte 0. The times [0, 255] are left out.
struct CodedEntry {
  std::uint32_t record = 0;
  TimeInterval times;
  bool operator==(const CodedEntry&) const = default;
};

// Appends the bytes of an entry. `before`: one more than the record of the previous entry, or 0; record >= before.
void encode_entry(const CodedEntry& entry, std::uint32_t before, std::vector<std::uint8_t>& out);

// Reads the entry at `at` and moves `at` behind it. The bytes must come from encode_entry().
CodedEntry decode_entry(std::span<const std::uint8_t> bytes, std::uint32_t before, std::size_t& at);

}  // namespace tessera::binner

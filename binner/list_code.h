#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "binner/time_interval.h"

namespace tessera::binner {

// What a tile's list says of a sub-patch: which record of the sub-patch table, and when it may touch the tile. The bytes
// of an entry are a table of binner/README.md, which a test reads:
//
//   byte 0   bit 0: times follow; bits 1..6: lowest bits of the distance; bit 7: a further byte of the distance follows
//   then     7 bits of the distance each, lowest first, bit 7: another follows
//   then     with bit 0: first and last code of the times
//
// The distance is the record's number less that of the entry before in the list, or plus 1 in the first entry: never 0,
// so that no entry begins with a byte 0. Times that are [0, 255] are left out.
struct CodedEntry {
  std::uint32_t record = 0;
  TimeInterval times;
  bool operator==(const CodedEntry&) const = default;
};

// Appends the bytes of an entry. `before`: one more than the record of the entry before, or 0; record >= before.
void encode_entry(const CodedEntry& entry, std::uint32_t before, std::vector<std::uint8_t>& out);

// Reads an entry at `at`, which then is behind it. Only of what encode_entry() wrote.
CodedEntry decode_entry(std::span<const std::uint8_t> bytes, std::uint32_t before, std::size_t& at);

}  // namespace tessera::binner

#include "binner/queue_entry.h"

#include <bit>

#include "base/check.h"

namespace tessera::binner {
namespace {

void put16(std::uint8_t* at, std::uint16_t value) {
  at[0] = static_cast<std::uint8_t>(value & 0xFF);
  at[1] = static_cast<std::uint8_t>(value >> 8);
}
std::uint16_t get16(const std::uint8_t* at) { return static_cast<std::uint16_t>(at[0] | (at[1] << 8)); }
void put32(std::uint8_t* at, std::uint32_t value) {
  put16(at, static_cast<std::uint16_t>(value & 0xFFFF));
  put16(at + 2, static_cast<std::uint16_t>(value >> 16));
}
std::uint32_t get32(const std::uint8_t* at) { return get16(at) | (std::uint32_t{get16(at + 2)} << 16); }

// The 64 bits of the short form, from the lowest on.
struct ShortField {
  int at, width;

  std::uint64_t most() const { return (std::uint64_t{1} << width) - 1; }
  std::uint64_t of(std::uint64_t word) const { return word >> at & most(); }
  std::uint64_t put(std::uint64_t value) const { return value << at; }
};
constexpr ShortField kPatch{0, 28}, kDepth{28, 16}, kLists{44, 8}, kSegment{52, 5}, kFlags{57, 6}, kShort{63, 1};
constexpr int kDepthBitsLeftOut = 15;
constexpr std::size_t kListsAt = 14;

std::uint64_t get64(const std::uint8_t* at) { return get32(at) | (std::uint64_t{get32(at + 4)} << 32); }
void put64(std::uint8_t* at, std::uint64_t value) {
  put32(at, static_cast<std::uint32_t>(value & 0xFFFFFFFF));
  put32(at + 4, static_cast<std::uint32_t>(value >> 32));
}

bool fits_short(const QueueEntry& e) {
  return e.whole && e.base_patch <= kPatch.most() && e.lists <= kLists.most() && e.segment <= kSegment.most() &&
         e.flags <= kFlags.most();
}

}  // namespace

PackedRecord pack_record(const QueueEntry& e) {
  PackedRecord out;
  const auto depth = std::bit_cast<std::uint32_t>(e.near_depth > 0 ? e.near_depth : 0.0f);
  if (fits_short(e)) {
    out.size = kSlotBytes;
    put64(&out.bytes[0], kPatch.put(e.base_patch) | kDepth.put(depth >> kDepthBitsLeftOut) | kLists.put(e.lists) |
                             kSegment.put(e.segment) | kFlags.put(e.flags) | kShort.put(1));
    return out;
  }
  TESSERA_CHECK(e.range.i0 < 128 && e.range.i1 < 128 && e.range.j0 < 128 && e.range.j1 < 128,
                "a cell range fits 7 bits");
  out.size = kRecordBytes;
  put32(&out.bytes[0], e.base_patch);
  put32(&out.bytes[4], std::uint32_t{e.range.i0} | std::uint32_t{e.range.j0} << 7 | std::uint32_t{e.range.i1} << 14 |
                           std::uint32_t{e.range.j1} << 21);
  put32(&out.bytes[8], depth);
  out.bytes[12] = e.flags;
  out.bytes[13] = e.segment;
  put16(&out.bytes[kListsAt], e.lists);
  return out;
}

QueueEntry unpack_record(std::span<const std::uint8_t> bytes) {
  QueueEntry e;
  const std::uint64_t word = get64(&bytes[0]);
  if (kShort.of(word) != 0) {
    e.whole = true;
    e.base_patch = static_cast<std::uint32_t>(kPatch.of(word));
    e.near_depth = std::bit_cast<float>(static_cast<std::uint32_t>(kDepth.of(word)) << kDepthBitsLeftOut);
    e.lists = static_cast<std::uint16_t>(kLists.of(word));
    e.segment = static_cast<std::uint8_t>(kSegment.of(word));
    e.flags = static_cast<std::uint8_t>(kFlags.of(word));
    return e;
  }
  e.base_patch = get32(&bytes[0]);
  const std::uint32_t range = get32(&bytes[4]);
  e.range = {static_cast<std::uint8_t>(range & 127), static_cast<std::uint8_t>(range >> 7 & 127),
             static_cast<std::uint8_t>(range >> 14 & 127), static_cast<std::uint8_t>(range >> 21 & 127)};
  e.near_depth = std::bit_cast<float>(get32(&bytes[8]));
  e.flags = bytes[12];
  e.segment = bytes[13];
  e.lists = get16(&bytes[kListsAt]);
  return e;
}

void lower_lists(std::span<std::uint8_t> record, std::uint16_t lists) {
  const std::uint64_t word = get64(&record[0]);
  if (kShort.of(word) == 0) return put16(&record[kListsAt], lists);
  TESSERA_CHECK(lists <= kLists.of(word), "fewer lists fit where more did");
  put64(&record[0], (word & ~kLists.put(kLists.most())) | kLists.put(lists));
}

}  // namespace tessera::binner

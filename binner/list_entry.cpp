#include "binner/list_entry.h"

#include <algorithm>
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

std::uint64_t get64(const std::uint8_t* at) { return get32(at) | (std::uint64_t{get32(at + 4)} << 32); }
void put64(std::uint8_t* at, std::uint64_t value) {
  put32(at, static_cast<std::uint32_t>(value & 0xFFFFFFFF));
  put32(at + 4, static_cast<std::uint32_t>(value >> 32));
}

// A bit field of a word: its lowest bit and its width.
struct Field {
  int at, width;

  std::uint64_t most() const { return (std::uint64_t{1} << width) - 1; }
  std::uint8_t byte_of(std::uint64_t word) const { return static_cast<std::uint8_t>(of(word)); }
  std::uint64_t of(std::uint64_t word) const { return word >> at & most(); }
  std::uint64_t put(std::uint64_t value) const { return value << at; }
};
constexpr int kDepthBitsLeftOut = 15;
constexpr Field kLateSegment{0, 12};           // of near_depth: the segment when the segment field is too small
constexpr std::uint64_t kSegmentInDepth = 31;  // value of the segment field then

// The only word of the short form.
namespace whole {
constexpr Field kPatch{0, 24}, kDepth{24, 16}, kLists{40, 4}, kFlags{44, 5}, kColumn{49, 4}, kRow{53, 4},
    kMoreColumns{57, 3}, kMoreRows{60, 3}, kForm{63, 1};
}  // namespace whole

// The two words of the long form.
namespace part {
constexpr Field kPatch{0, 32}, kI0{32, 7}, kJ0{39, 7}, kI1{46, 7}, kJ1{53, 7}, kMoreRows{60, 3};
constexpr Field kDepth{0, 32}, kFlags{32, 5}, kColumn{37, 4}, kRow{41, 4}, kMoreColumns{45, 3}, kSegment{48, 5},
    kWide{53, 1}, kLists{54, 10};
}  // namespace part

bool fits_short(const ListEntry& e) {
  return e.whole && e.base_patch <= whole::kPatch.most() && e.lists <= whole::kLists.most() && e.segment == 0 &&
         !e.blocks.wide;
}

std::uint64_t pack_short(const ListEntry& e, std::uint32_t depth) {
  using namespace whole;
  return kPatch.put(e.base_patch) | kDepth.put(depth >> kDepthBitsLeftOut) | kLists.put(e.lists) | kFlags.put(e.flags) |
         kColumn.put(e.blocks.column) | kRow.put(e.blocks.row) | kMoreColumns.put(e.blocks.more_columns) |
         kMoreRows.put(e.blocks.more_rows) | kForm.put(1);
}

ListEntry unpack_short(std::uint64_t word) {
  using namespace whole;
  ListEntry e;
  e.whole = true;
  e.base_patch = static_cast<std::uint32_t>(kPatch.of(word));
  e.near_depth = std::bit_cast<float>(static_cast<std::uint32_t>(kDepth.of(word)) << kDepthBitsLeftOut);
  e.lists = static_cast<std::uint16_t>(kLists.of(word));
  e.flags = kFlags.byte_of(word);
  e.blocks = {kColumn.byte_of(word), kRow.byte_of(word), kMoreColumns.byte_of(word), kMoreRows.byte_of(word), false};
  return e;
}

}  // namespace

PackedRecord pack_record(const ListEntry& e) {
  TESSERA_CHECK(e.range.i0 < 128 && e.range.i1 < 128 && e.range.j0 < 128 && e.range.j1 < 128,
                "a cell range fits 7 bits");
  TESSERA_CHECK(e.flags <= part::kFlags.most() && e.segment <= kLateSegment.most(),
                "flags fit 5 bits, a segment of motion 12");
  const BlockRange& blocks = e.blocks;
  TESSERA_CHECK(blocks.column < BlockRange::kPeriod && blocks.row < BlockRange::kPeriod &&
                    blocks.more_columns <= BlockRange::kAny && blocks.more_rows <= BlockRange::kAny,
                "a range of blocks fits 4 and 3 bits");
  PackedRecord out;
  const auto depth = std::bit_cast<std::uint32_t>(e.near_depth > 0 ? e.near_depth : 0.0f);
  if (fits_short(e)) {
    out.size = kSlotBytes;
    put64(&out.bytes[0], pack_short(e, depth));
    return out;
  }
  using namespace part;
  out.size = kRecordBytes;
  const bool late = e.segment >= kSegmentInDepth;
  const std::uint64_t stored = late ? (depth & ~kLateSegment.most()) | kLateSegment.put(e.segment) : depth;
  put64(&out.bytes[0], kPatch.put(e.base_patch) | kI0.put(e.range.i0) | kJ0.put(e.range.j0) | kI1.put(e.range.i1) |
                           kJ1.put(e.range.j1) | kMoreRows.put(blocks.more_rows));
  put64(&out.bytes[kSlotBytes], kDepth.put(stored) | kFlags.put(e.flags) | kColumn.put(blocks.column) |
                                    kRow.put(blocks.row) | kMoreColumns.put(blocks.more_columns) |
                                    kSegment.put(late ? kSegmentInDepth : e.segment) | kWide.put(blocks.wide ? 1 : 0) |
                                    kLists.put(std::min(e.lists, kManyLists)));
  return out;
}

ListEntry unpack_record(std::span<const std::uint8_t> bytes) {
  const std::uint64_t first = get64(&bytes[0]);
  if (whole::kForm.of(first) != 0) return unpack_short(first);
  using namespace part;
  const std::uint64_t second = get64(&bytes[kSlotBytes]);
  ListEntry e;
  e.base_patch = static_cast<std::uint32_t>(kPatch.of(first));
  e.range = {kI0.byte_of(first), kJ0.byte_of(first), kI1.byte_of(first), kJ1.byte_of(first)};
  const bool late = kSegment.of(second) == kSegmentInDepth;
  const std::uint64_t depth = kDepth.of(second);
  e.near_depth = std::bit_cast<float>(static_cast<std::uint32_t>(late ? depth & ~kLateSegment.most() : depth));
  e.flags = kFlags.byte_of(second);
  e.segment = static_cast<std::uint16_t>(late ? kLateSegment.of(depth) : kSegment.of(second));
  e.blocks = {kColumn.byte_of(second), kRow.byte_of(second), kMoreColumns.byte_of(second), kMoreRows.byte_of(first),
              kWide.of(second) != 0};
  e.lists = static_cast<std::uint16_t>(kLists.of(second));
  return e;
}

void lower_lists(std::span<std::uint8_t> record, std::uint16_t lists) {
  const bool is_whole = whole::kForm.of(get64(&record[0])) != 0;
  std::uint8_t* at = &record[is_whole ? 0 : kSlotBytes];
  const Field field = is_whole ? whole::kLists : part::kLists;
  const std::uint64_t word = get64(at);
  const std::uint64_t fewer = std::min(lists, kManyLists);
  TESSERA_CHECK(fewer <= field.of(word), "fewer lists fit where more did");
  put64(at, (word & ~field.put(field.most())) | field.put(fewer));
}

}  // namespace tessera::binner

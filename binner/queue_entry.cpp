#include "binner/queue_entry.h"

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

}  // namespace

std::array<std::uint8_t, 2> pack_lists(const QueueEntry& e, std::uint64_t lists) {
  TESSERA_CHECK(e.segment < 32, "a segment of motion fits 5 bits");
  std::array<std::uint8_t, 2> bytes{};
  put16(bytes.data(), static_cast<std::uint16_t>(e.segment | (e.blocks.wide ? 32 : 0) |
                                                 static_cast<int>(std::min<std::uint64_t>(lists, kManyLists)) << 6));
  return bytes;
}

RecordBytes pack_record(const QueueEntry& e, std::uint64_t lists) {
  TESSERA_CHECK(e.range.i0 < 128 && e.range.i1 < 128 && e.range.j0 < 128 && e.range.j1 < 128,
                "a cell range fits 7 bits");
  TESSERA_CHECK(e.flags < 64, "flags fit 6 bits");
  const BlockRange& blocks = e.blocks;
  TESSERA_CHECK(blocks.column < BlockRange::kPeriod && blocks.row < BlockRange::kPeriod &&
                    blocks.more_columns <= BlockRange::kAny && blocks.more_rows <= BlockRange::kAny,
                "a range of blocks fits 4 and 3 bits");
  RecordBytes bytes{};
  put32(&bytes[0], e.base_patch);
  put32(&bytes[4], std::uint32_t{e.range.i0} | std::uint32_t{e.range.j0} << 7 | std::uint32_t{e.range.i1} << 14 |
                       std::uint32_t{e.range.j1} << 21 | std::uint32_t{blocks.column} << 28);
  put32(&bytes[8], std::bit_cast<std::uint32_t>(e.near_depth > 0 ? e.near_depth : 0.0f));
  put16(&bytes[12],
        static_cast<std::uint16_t>(e.flags | blocks.row << 6 | blocks.more_columns << 10 | blocks.more_rows << 13));
  const auto count = pack_lists(e, lists);
  std::copy(count.begin(), count.end(), &bytes[kRecordListsAt]);
  return bytes;
}

QueueEntry unpack_record(std::span<const std::uint8_t, kRecordBytes> bytes) {
  QueueEntry e;
  e.base_patch = get32(&bytes[0]);
  const std::uint32_t range = get32(&bytes[4]), flags = get16(&bytes[12]);
  e.range = {static_cast<std::uint8_t>(range & 127), static_cast<std::uint8_t>(range >> 7 & 127),
             static_cast<std::uint8_t>(range >> 14 & 127), static_cast<std::uint8_t>(range >> 21 & 127)};
  e.near_depth = std::bit_cast<float>(get32(&bytes[8]));
  e.flags = static_cast<std::uint8_t>(flags & 63);
  e.blocks = {static_cast<std::uint8_t>(range >> 28), static_cast<std::uint8_t>(flags >> 6 & 15),
              static_cast<std::uint8_t>(flags >> 10 & 7), static_cast<std::uint8_t>(flags >> 13),
              (bytes[kRecordListsAt] & 32) != 0};
  e.segment = static_cast<std::uint8_t>(bytes[kRecordListsAt] & 31);
  return e;
}

std::uint16_t lists_of_record(std::span<const std::uint8_t, kRecordBytes> bytes) {
  return static_cast<std::uint16_t>(get16(&bytes[kRecordListsAt]) >> 6);
}

}  // namespace tessera::binner

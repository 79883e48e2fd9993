#include "binner/queue_entry.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "base/check.h"

namespace tessera::binner {
namespace {

// The upper half of a non-negative float is ordered like the float; dropping the lower half rounds towards zero.
std::uint16_t half_down(float depth) {
  return static_cast<std::uint16_t>(std::bit_cast<std::uint32_t>(depth > 0 ? depth : 0.0f) >> 16);
}

std::uint16_t half_up(float depth) {
  const std::uint32_t bits = std::bit_cast<std::uint32_t>(depth > 0 ? depth : 0.0f);
  constexpr std::uint32_t kInfinity = 0x7F80;
  const std::uint32_t up = (bits + 0xFFFF) >> 16;
  return static_cast<std::uint16_t>(up < kInfinity ? up : kInfinity);
}

float from_half(std::uint16_t half) { return std::bit_cast<float>(std::uint32_t{half} << 16); }

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

std::array<std::uint8_t, kQueueEntryBytes> pack(const QueueEntry& e) {
  TESSERA_CHECK(e.range.i0 < 128 && e.range.i1 < 128 && e.range.j0 < 128 && e.range.j1 < 128,
                "a cell range fits 7 bits");
  std::array<std::uint8_t, kQueueEntryBytes> bytes{};
  put32(&bytes[0], e.base_patch);
  put32(&bytes[4], std::uint32_t{e.range.i0} | std::uint32_t{e.range.j0} << 7 | std::uint32_t{e.range.i1} << 14 |
                       std::uint32_t{e.range.j1} << 21);
  put16(&bytes[8], half_down(e.near_depth));
  put16(&bytes[10], half_up(e.far_depth));
  bytes[12] = e.t0;
  bytes[13] = e.t1;
  bytes[14] = e.flags;
  bytes[15] = e.segment;
  return bytes;
}

QueueEntry unpack(std::span<const std::uint8_t, kQueueEntryBytes> bytes) {
  QueueEntry e;
  e.base_patch = get32(&bytes[0]);
  const std::uint32_t range = get32(&bytes[4]);
  e.range = {static_cast<std::uint8_t>(range & 127), static_cast<std::uint8_t>(range >> 7 & 127),
             static_cast<std::uint8_t>(range >> 14 & 127), static_cast<std::uint8_t>(range >> 21 & 127)};
  e.near_depth = from_half(get16(&bytes[8]));
  e.far_depth = from_half(get16(&bytes[10]));
  e.t0 = bytes[12];
  e.t1 = bytes[13];
  e.flags = bytes[14];
  e.segment = bytes[15];
  return e;
}

}  // namespace tessera::binner

#include "binner/list_code.h"

#include "base/check.h"

namespace tessera::binner {
namespace {

constexpr std::uint32_t kTimesFollow = 1, kFirstBits = 6, kMoreBits = 7, kMore = 128;
constexpr TimeInterval kAllTimes{0, 255};

}  // namespace

void encode_entry(const CodedEntry& entry, std::uint32_t before, std::vector<std::uint8_t>& out) {
  TESSERA_CHECK(entry.record >= before && entry.record < ~0u, "records of a list rise");
  const bool times = entry.times != kAllTimes;
  std::uint32_t distance = entry.record + 1 - before, low = distance & ((1u << kFirstBits) - 1);
  distance >>= kFirstBits;
  out.push_back(
      static_cast<std::uint8_t>((times ? kTimesFollow : 0) | low << 1 | (distance > 0 ? kMore : std::uint32_t{0})));
  while (distance > 0) {
    low = distance & ((1u << kMoreBits) - 1);
    distance >>= kMoreBits;
    out.push_back(static_cast<std::uint8_t>(low | (distance > 0 ? kMore : std::uint32_t{0})));
  }
  if (!times) return;
  TESSERA_CHECK(entry.times.first >= 0 && entry.times.first <= entry.times.last && entry.times.last < 256,
                "times of an entry are codes of the shutter");
  out.push_back(static_cast<std::uint8_t>(entry.times.first));
  out.push_back(static_cast<std::uint8_t>(entry.times.last));
}

CodedEntry decode_entry(std::span<const std::uint8_t> bytes, std::uint32_t before, std::size_t& at) {
  std::uint32_t byte = bytes[at++];
  const bool times = (byte & kTimesFollow) != 0;
  std::uint32_t distance = byte >> 1 & ((1u << kFirstBits) - 1);
  for (std::uint32_t shift = kFirstBits; (byte & kMore) != 0; shift += kMoreBits) {
    byte = bytes[at++];
    distance |= (byte & ~kMore) << shift;
  }
  CodedEntry entry{before + distance - 1, kAllTimes};
  if (times) {
    entry.times = {bytes[at], bytes[at + 1]};
    at += 2;
  }
  return entry;
}

}  // namespace tessera::binner

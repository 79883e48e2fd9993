#pragma once

#include <bitset>
#include <cstdint>
#include <span>
#include <vector>

#include "baselines/strip_code.h"
#include "baselines/tile_reference.h"

namespace tessera::test {

// Decoders written from the descriptions of the formats alone, bit by bit.

inline std::vector<baselines::BlockTriangle> decode_strip_bits(std::span<const std::uint8_t> bytes, std::size_t count) {
  std::size_t at = 0;
  const auto bit = [&] {
    const unsigned b = at / 8 < bytes.size() ? (bytes[at / 8] >> (at % 8)) & 1u : 0u;
    ++at;
    return b;
  };
  const auto number = [&](int bits) {
    unsigned value = 0;
    for (int k = 0; k < bits; ++k) value += bit() << k;
    return value;
  };
  unsigned next = 0;
  const auto vertex = [&] {
    if (bit() != 0) return static_cast<std::uint8_t>(next++);
    const unsigned d = number(6);
    return static_cast<std::uint8_t>(next - (d + 1));
  };
  std::vector<baselines::BlockTriangle> out;
  while (out.size() < count) {
    const unsigned code = number(2);
    if (code == 3) {
      const std::uint8_t a = vertex(), b = vertex(), c = vertex();
      out.push_back({a, b, c});
    } else {
      const baselines::BlockTriangle p = out.back();
      const std::uint8_t from = p[(code + 1) % 3], to = p[code];
      out.push_back({from, to, vertex()});
    }
  }
  return out;
}

struct DecodedReference {
  std::uint64_t address = 0;
  std::bitset<baselines::kBlockTriangles> triangles;
  std::size_t bytes = 0;  // that it takes
};

// The reference at the beginning of `bytes`; `count_at(address)` says how many triangles its block has.
template <class CountAt>
DecodedReference decode_reference_with(std::span<const std::uint8_t> bytes, std::uint64_t before,
                                       const CountAt& count_at) {
  DecodedReference r;
  std::uint64_t scale = baselines::kBlockAlignment;
  r.address = before;
  for (;;) {
    const std::uint8_t b = bytes[r.bytes++];
    r.address += (b % 128) * scale;
    scale *= 128;
    if (b < 128) break;
  }
  const std::size_t count = count_at(r.address);
  const unsigned head = bytes[r.bytes++], form = head / 64, n = head % 64 + 1;
  if (form == 0)
    for (std::size_t t = 0; t < count; ++t) r.triangles[t] = true;
  if (form == 1) {
    for (std::size_t t = 0; t < count; ++t) r.triangles[t] = (bytes[r.bytes + t / 8] & (1u << t % 8)) != 0;
    r.bytes += (count + 7) / 8;
  }
  std::size_t t = 0;
  for (unsigned k = 0; k < n && form == 2; ++k) {
    t += bytes[r.bytes++];
    r.triangles[t++] = true;
  }
  for (unsigned k = 0; k < n && form == 3; ++k) {
    t += bytes[r.bytes++];
    for (unsigned left = bytes[r.bytes++]; left > 0; --left) r.triangles[t++] = true;
  }
  return r;
}

inline DecodedReference decode_reference_bytes(std::span<const std::uint8_t> bytes, std::size_t count,
                                               std::uint64_t before) {
  return decode_reference_with(bytes, before, [count](std::uint64_t) { return count; });
}

}  // namespace tessera::test

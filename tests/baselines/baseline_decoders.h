#pragma once

#include <bitset>

#include "baselines/block_code.h"
#include "baselines/tile_reference.h"
#include "tests/support/tests.h"

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

// The grids of indices of a block.
inline std::vector<baselines::BlockTriangle> decode_grid_bytes(std::span<const std::uint8_t> bytes, std::size_t count) {
  std::vector<baselines::BlockTriangle> out;
  std::size_t at = 0, next = 0;
  while (out.size() < count) {
    const int columns = bytes[at] % 8 + 1, rows = bytes[at] / 8 % 8 + 1;
    const bool missing = bytes[at++] / 64 != 0;
    std::vector<std::array<int, 3>> triangles;  // grid vertices
    for (int j = 0; j < rows; ++j)
      for (int i = 0; i < columns; ++i)
        for (int k = 0; k < 2; ++k) {
          const int t = 2 * (j * columns + i) + k;
          if (missing && (bytes[at + static_cast<std::size_t>(t / 8)] >> t % 8) % 2 == 0) continue;
          const int a = j * (columns + 1) + i, b = a + 1, d = a + columns + 1, c = d + 1;
          triangles.push_back(k == 0 ? std::array{a, c, d} : std::array{a, b, c});
        }
    if (missing) at += static_cast<std::size_t>((2 * columns * rows + 7) / 8);
    std::set<int> used;
    for (const auto& t : triangles) used.insert(t.begin(), t.end());
    for (const auto& t : triangles) {
      baselines::BlockTriangle numbers{};
      for (std::size_t k = 0; k < 3; ++k)
        numbers[k] =
            static_cast<std::uint8_t>(next + static_cast<std::size_t>(std::distance(used.begin(), used.find(t[k]))));
      out.push_back(numbers);
    }
    next += used.size();
  }
  return out;
}

// A number in groups of 7 bits.
inline std::uint64_t decode_number(std::span<const std::uint8_t> bytes, std::size_t& at) {
  std::uint64_t value = 0, scale = 1;
  while (true) {
    const std::uint8_t b = bytes[at++];
    value += b % 128 * scale;
    scale *= 128;
    if (b < 128) return value;
  }
}
// Places of the vertices of a block; without a value the vertices are the block's own.
inline std::vector<std::optional<baselines::VertexPlace>> decode_place_bits(std::span<const std::uint8_t> bytes,
                                                                            std::size_t count, std::uint64_t address,
                                                                            std::size_t& bytes_taken) {
  std::size_t at = 0;
  const std::uint64_t blocks = decode_number(bytes, at);
  std::vector<std::uint64_t> middles;
  for (std::uint64_t b = 0; b < blocks; ++b)
    middles.push_back((b == 0 ? address : middles.back()) - 4 * decode_number(bytes, at));
  std::size_t bit = at * 8, choice = 0;
  while (std::uint64_t{1} << choice < blocks) ++choice;
  const auto number = [&](std::size_t bits) {
    unsigned value = 0;
    for (std::size_t b = 0; b < bits; ++b, ++bit) value += (bytes[bit / 8] >> bit % 8 & 1u) << b;
    return value;
  };
  std::vector<std::optional<baselines::VertexPlace>> out(count);
  for (auto& place : out) {
    if (number(1) == 1) continue;
    const std::uint64_t middle = middles[number(choice)];
    place = baselines::VertexPlace{middle, static_cast<std::uint8_t>(number(6))};
  }
  bytes_taken = (bit + 7) / 8;
  return out;
}

inline std::int64_t decode_signed(std::span<const std::uint8_t> bytes, std::size_t& at) {
  const std::uint64_t code = decode_number(bytes, at);
  return code % 2 == 0 ? static_cast<std::int64_t>(code / 2) : -static_cast<std::int64_t>(code / 2) - 1;
}

struct DecodedReference {
  std::uint64_t address = 0;
  std::bitset<baselines::kBlockTriangles> triangles;
  std::size_t bytes = 0;  // of its code
};

// A set of triangles out of `count`, at the beginning of `bytes`; `taken`: bytes.
inline std::bitset<baselines::kBlockTriangles> decode_triangle_set(std::span<const std::uint8_t> bytes,
                                                                   std::size_t count, std::size_t& taken) {
  struct {
    std::bitset<baselines::kBlockTriangles> triangles;
    std::size_t bytes = 0;
  } r;
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
  taken = r.bytes;
  return r.triangles;
}

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
  std::size_t taken = 0;
  r.triangles = decode_triangle_set(bytes.subspan(r.bytes), count, taken);
  r.bytes += taken;
  return r;
}

inline DecodedReference decode_reference_bytes(std::span<const std::uint8_t> bytes, std::size_t count,
                                               std::uint64_t before) {
  return decode_reference_with(bytes, before, [count](std::uint64_t) { return count; });
}

}  // namespace tessera::test

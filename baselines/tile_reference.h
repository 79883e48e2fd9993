#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <span>
#include <vector>

#include "base/bit_stream.h"
#include "baselines/block_code.h"

namespace tessera::baselines {

// A tile's reference to a block: the block's address, and its triangles that touch the tile.
//
//   address in units of kBlockAlignment, less the address of the tile's reference before: 7 bits a byte, lowest first, the
//     top bit set on all but the last
//   a byte: bits 0..5 n, bits 6..7 the form of the set, whichever takes the fewest bytes
//     0  all triangles: no bytes
//     1  a mask: one bit per triangle of the block, in whole bytes
//     2  a list: n+1 bytes, each the distance from the number before, less one
//     3  runs: n+1 pairs of bytes: triangles left out, triangles taken
struct TileReference {
  std::uint64_t address = 0;
  std::bitset<kBlockTriangles> triangles;
};

inline constexpr std::uint64_t kBlockAlignment = 16;

// Appends the byte and the form of a set of triangles, at least one, out of `count`.
void encode_triangles(const std::bitset<kBlockTriangles>& triangles, std::size_t count, std::vector<std::uint8_t>& out);

// Reads such a set at `at`, and moves `at` behind it.
inline std::bitset<kBlockTriangles> decode_triangles(std::span<const std::uint8_t> bytes, std::size_t count,
                                                     std::size_t& at) {
  const std::size_t n = (bytes[at] & 63u) + std::size_t{1};
  const unsigned form = bytes[at++] >> 6;
  std::bitset<kBlockTriangles> triangles;
  std::size_t triangle = 0;
  if (form == 0) {
    for (; triangle < count; ++triangle) triangles.set(triangle);
  } else if (form == 1) {
    for (; triangle < count; ++triangle)
      triangles.set(triangle, (bytes[at + triangle / 8] >> (triangle % 8) & 1u) != 0);
    at += (count + 7) / 8;
  } else if (form == 2) {
    for (std::size_t k = 0; k < n; ++k) {
      triangle += bytes[at++];
      triangles.set(triangle++);
    }
  } else {
    for (std::size_t k = 0; k < n; ++k) {
      triangle += bytes[at++];
      for (std::size_t run = bytes[at++]; run > 0; --run) triangles.set(triangle++);
    }
  }
  return triangles;
}

// Appends the bytes of a reference to a block of `count` triangles. `before`: address of the tile's previous
// reference, 0 for the first; references of a tile come in rising addresses. At least one triangle must be set.
void encode_reference(const TileReference& reference, std::size_t count, std::uint64_t before,
                      std::vector<std::uint8_t>& out);

// Reads a tile's list. `triangles_at(address)` gives the number of triangles of the block there.
template <class TrianglesAt>
std::vector<TileReference> decode_references(std::span<const std::uint8_t> bytes, const TrianglesAt& triangles_at) {
  std::vector<TileReference> references;
  std::uint64_t address = 0;
  for (std::size_t at = 0; at < bytes.size();) {
    address += get_number(bytes, at) * kBlockAlignment;
    const TileReference reference{address, decode_triangles(bytes, triangles_at(address), at)};
    references.push_back(reference);
  }
  return references;
}

}  // namespace tessera::baselines

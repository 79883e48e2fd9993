#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace tessera::baselines {

// Indices of a block of triangles, delta-coded as a generalised strip. Vertices are numbered by their first use.
//
// Bits from the lowest of each byte on. Per triangle a 2-bit code: 0, 1, 2: it has edge (p[k], p[k+1]) of the triangle
// p before, the other way round, and one further vertex; 3: three vertices follow. Per vertex one bit: 1 is the next
// number that was not used yet; 0 is followed by 6 bits, d: it is the d+1-th number below that one.
//
// A triangle that shares an edge costs 3 bits with a new vertex and 9 with an old one.
inline constexpr std::size_t kBlockVertices = 64, kBlockTriangles = 126;

using BlockTriangle = std::array<std::uint8_t, 3>;

std::vector<std::uint8_t> encode_strip(std::span<const BlockTriangle> triangles);

// The triangles again, in order; corners may be rotated, which keeps the winding.
std::vector<BlockTriangle> decode_strip(std::span<const std::uint8_t> bytes, std::size_t count);

// Indices of a block that consists of rectangles of grids, which takes less than a strip unless so much
// is culled that few triangles are left.
//
// Per rectangle a byte: bits 0..2 cells along u less one, 3..5 cells along v less one, 6 whether triangles are missing.
// If so, a mask of whole bytes: bits 2k and 2k+1 say whether triangles (a, c, d) and (a, b, c) of cell k are there; cells
// go row by row along u, their corners are a (i, j), b (i+1, j), c (i+1, j+1), d (i, j+1). Vertices are numbered row by
// row, unused ones left out, on from those of the rectangle before.
inline constexpr int kGridCells = 7;  // along a side: 8x8 vertices, 98 triangles

struct GridRectangle {
  std::uint8_t columns = 1, rows = 1;
  std::bitset<std::size_t{2} * kGridCells * kGridCells> triangles;
};

std::vector<std::uint8_t> encode_grids(std::span<const GridRectangle> rectangles);

// `count` triangles, in order.
std::vector<BlockTriangle> decode_grids(std::span<const std::uint8_t> bytes, std::size_t count);

// Positions of a block's vertices, snapped and delta-coded without loss: x and y in units of 1/256 pixel, depth as the
// bits of its float; of moving vertices, further what each of the three gains from the first motion key to the second.
//
// Per component, of 3 or 6: a byte (bits 0..5 width, 6 the mode) and 4 bytes of base. Then the vertices, bit by bit
// without a gap: of each component `width` bits. Mode 0: what the component exceeds the base by, the least of the
// block. Mode 1: what it exceeds that of the vertex before by (of the first: the base), in zigzag. The mode is the one
// that takes fewer bits. All sums are modulo 2^32.
using PositionWords = std::array<std::uint32_t, 6>;
inline constexpr std::size_t kStillWords = 3, kMovingWords = 6;
inline constexpr std::uint64_t kRawPositionBytes = 12;  // x, y, depth as floats, at each key

// Six numbers: x, y, depth at both keys. Nothing when one is not on the grid, as with vertices that are not projected:
// such blocks keep floats.
std::optional<PositionWords> position_words(const std::array<float, 6>& position, std::size_t words);
std::array<float, 6> position_of(const PositionWords& words, std::size_t count);

std::vector<std::uint8_t> encode_positions(std::span<const PositionWords> vertices, std::size_t words);
std::vector<PositionWords> decode_positions(std::span<const std::uint8_t> bytes, std::size_t count, std::size_t words);

// Bytes that a block's positions take, from their first bytes.
std::size_t position_bytes(std::span<const std::uint8_t> bytes, std::size_t count, std::size_t words);

}  // namespace tessera::baselines

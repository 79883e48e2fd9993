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

// Where the vertices of a block lie when a draw keeps each vertex once: behind the block that uses it first.
//
// A block's own vertices lie about its middle, an address that is a multiple of 4: the position of place p ends at
// `middle - p * position_bytes`, its attributes begin at `middle + p * attribute_bytes`. So a middle and a place lead to
// both arrays, however many vertices the block has.
struct VertexPlace {
  std::uint64_t middle = 0;
  std::uint8_t place = 0;
  bool operator==(const VertexPlace&) const = default;
};

// Places of the vertices of a block, some of which lie behind earlier ones:
//   number (7 bits a byte): b earlier blocks, at least one; b numbers: how far the middle of each lies before this block,
//     in units of 4 bytes, rising, each less the one before
//   bits from the lowest of each byte on, for each vertex in the order of its number: 1: the next of the block's own;
//     0: followed by as many bits as b - 1 takes, which earlier block, and 6 bits, the place there
// `address`: of this block. No place: the block's own.
std::vector<std::uint8_t> encode_places(std::span<const std::optional<VertexPlace>> vertices, std::uint64_t address);

// `count` places; `bytes_taken`: by them.
std::vector<std::optional<VertexPlace>> decode_places(std::span<const std::uint8_t> bytes, std::size_t count,
                                                      std::uint64_t address, std::size_t& bytes_taken);

}  // namespace tessera::baselines

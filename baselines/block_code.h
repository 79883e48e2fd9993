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
// Bits are stored from the lowest of each byte on. Each triangle begins with a code of 2 bits. 0, 1, 2: it shares edge
// (p[k], p[k+1]) of the triangle p before, in the other direction, and has one further vertex. 3: three vertices follow.
// Each vertex is one bit: 1 is the next unused number; 0 is followed by 6 bits, d, and is the d+1-th number below it.
//
// A triangle that shares an edge costs 3 bits with a new vertex and 9 with an old one.
inline constexpr std::size_t kBlockVertices = 64, kBlockTriangles = 126;

using BlockTriangle = std::array<std::uint8_t, 3>;

std::vector<std::uint8_t> encode_strip(std::span<const BlockTriangle> triangles);

// Decodes the triangles in order; corners may be rotated, which keeps the winding.
std::vector<BlockTriangle> decode_strip(std::span<const std::uint8_t> bytes, std::size_t count);

// Indices of a block of grid rectangles. They take less space than a strip unless culling has left few triangles.
//
// Each rectangle has a byte: bits 0..2 cells along u less one, 3..5 cells along v less one, 6 whether triangles are
// missing. If so, a mask of whole bytes follows: bits 2k and 2k+1 say whether triangles (a, c, d) and (a, b, c) of
// cell k are present. Cells go row by row along u; their corners are a (i, j), b (i+1, j), c (i+1, j+1), d (i, j+1).
// Vertices are numbered row by row without the unused ones; numbers continue from one rectangle to the next.
inline constexpr int kGridCells = 7;  // along a side: 8x8 vertices, 98 triangles

struct GridRectangle {
  std::uint8_t columns = 1, rows = 1;
  std::bitset<std::size_t{2} * kGridCells * kGridCells> triangles;
};

std::vector<std::uint8_t> encode_grids(std::span<const GridRectangle> rectangles);

// Decodes `count` triangles, in order.
std::vector<BlockTriangle> decode_grids(std::span<const std::uint8_t> bytes, std::size_t count);

// Place of a vertex in memory when a draw stores each vertex once: after the block that uses it first.
//
// A block's own vertices lie on both sides of its middle, an address that is a multiple of 4: the position of place p
// ends at `middle - p * position_bytes`, its attributes begin at `middle + p * attribute_bytes`. So a middle and a
// place give the address in both arrays, for any number of vertices.
struct VertexPlace {
  std::uint64_t middle = 0;
  std::uint8_t place = 0;
  bool operator==(const VertexPlace&) const = default;
};

// Encodes the places of the vertices of a block, some of which lie with earlier blocks:
//   number (7 bits a byte): b earlier blocks, at least one; b numbers: distance of each middle before this block, in units
//     of 4 bytes, rising, each less the one before
//   bits from the lowest of each byte on, for each vertex in the order of its number: 1: the next of the block's own;
//     0: followed by the index of an earlier block, in the bits that b - 1 needs, and 6 bits, the place there
// `address`: address of this block. A vertex without a place belongs to the block itself.
std::vector<std::uint8_t> encode_places(std::span<const std::optional<VertexPlace>> vertices, std::uint64_t address);

// Decodes `count` places; `bytes_taken` returns their length.
std::vector<std::optional<VertexPlace>> decode_places(std::span<const std::uint8_t> bytes, std::size_t count,
                                                      std::uint64_t address, std::size_t& bytes_taken);

}  // namespace tessera::baselines

#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "scene/clusters.h"
#include "scene/geometry_settings.h"
#include "scene/position_lattice.h"

namespace tessera::scene {

// Encoded positions and triangles of one base patch, as the emulated memory holds them after the header of its record.
// The header has the numbers of vertices and of cells, or with dgf of blocks. quantised and meshlet are streams of
// bits, the lowest bit of each byte first; the last byte is filled up:
//
//   8 bits       exponent of the lattice's step
//   3 x 26 bits  anchor: a lattice point, two's complement
//   3 x 5 bits   meshlet: widths of the deltas along x, y, z; with quantised all have geometry.bits
//   vertices     three deltas to the anchor each
//   cells        quantised: four corners of 8 bits each; meshlet: as below
//
// quantised: the anchor is the lattice's origin. meshlet: the least corner of the record's box, and deltas have as many bits
// as the box needs; vertices are numbered as their cells come to them. A cell of a meshlet:
//
//   1 bit        whether it is a single triangle, with 3 corners, else 4
//   4 bits       which of the last 15 edges of cells before it shares, the newest first; 15: none
//   2 bits       with an edge: the corner at which the cell's edge begins, which runs against the edge before
//   corners      the others, each from there on: 1 bit, whether it is the next vertex that no cell had; else its number in
//                as few bits as hold those so far
//
// After a cell its edges from corner to corner, but for the shared one, become the newest, the last of them first.
//
// dgf: blocks of 128 bytes (scene/dgf_block.h), and behind them, as blocks that share a vertex both have it, a stream of bits
// with the cluster's vertices by the blocks', block after block: 1 bit, whether it is the next vertex that no block had; else
// its number in as few bits as hold those so far. A triangle and the next of its block make one cell where they share an edge
// and the first is not the second of another.
//
// Invariants (cited by the tests):
//   GR1  decode_record(encode_record(...)) gives the same lattice points and cells, in the order that encode_record() says;
//        with dgf not the cells but their triangles, each with its winding.
//   GR2  A vertex decodes to the same bits from each record of a lattice, whatever the encoding.
//   GR3  read_record() reads any bytes.
inline constexpr int kExponentBits = 8, kAnchorBits = 26, kWidthBits = 5;

struct EncodedRecord {
  std::vector<std::uint8_t> bytes;
  // The record's vertices by their place in the record; 0, 1, 2, ... unless cells are coded.
  std::vector<std::uint8_t> order;
  // The number in the header: cells, or blocks of dgf.
  std::size_t parts = 0;
  // Elements that a decoder outputs: vertices, counted in each block that has them, and coded cells or triangles.
  std::size_t elements = 0;
};
// `settings` are not raw. `points` are places of `lattice`, at most 64, and with dgf at most 2^kDgfPlaceBits from the
// origin. The corners of cells are below the number of points; cells make at most 124 triangles. With dgf each point is
// a corner of a triangle.
EncodedRecord encode_record(const GeometrySettings& settings, const PositionLattice& lattice,
                            std::span<const LatticePoint> points, std::span<const ClusterCell> cells);

struct DecodedRecord {
  std::vector<Vec3> positions;
  std::vector<ClusterCell> cells;
};
// Reads any bytes as a record of so many vertices and parts. Returns finite positions, at least one, and cells whose
// corners exist; or nothing.
std::optional<DecodedRecord> read_record(const GeometrySettings& settings, std::span<const std::uint8_t> bytes,
                                         std::size_t vertices, std::size_t parts);
// The same for bytes that encode_record() made.
DecodedRecord decode_record(const GeometrySettings& settings, std::span<const std::uint8_t> bytes, std::size_t vertices,
                            std::size_t parts);

}  // namespace tessera::scene

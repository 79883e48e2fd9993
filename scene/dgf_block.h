#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "scene/dgf_strip.h"
#include "scene/position_lattice.h"

namespace tessera::scene {

// Blocks of AMD's Dense Geometry Format, version 1 (chapter "Compressed triangle data" of the Vulkan specification,
// VK_AMDX_dense_geometry_format), without geometry palettes, opacity micromaps and user data. A block is 128 bytes; bits
// count from the lowest of each byte:
//
//   32 bits       8: 6; 2: bits of a reused index less 3; 6: vertices less 1; 6: triangles less 1; 10: 0
//   32 bits       8: exponent of the lattice's step plus 127, 1 to 254; 24: anchor along x, two's complement
//   32 bits       4, 4: widths of offsets along x and y, less 1; 24: anchor along y
//   32 bits       4: width along z, less 1; 4: 0; 24: anchor along z
//   32 bits       29: number of the first triangle; 3: 0
//   vertices      three offsets to the anchor each, filled up to a multiple of 4 bits; at most 96 bytes, filled up
//   reused        the indices that are no first use, in order; at most 24 bytes
//   free          0
//   first uses    one bit for each index but the first three, from high bits to low ones
//   controls      two bits for each triangle but the first, from the end of the block to low bits
//
// The specification ends at an exponent of 232; grids of meshes larger than 2^121 have more.
//
// Triangles form a strip. RESTART (0) states three indices; the other three controls state one. EDGE1 (1) and EDGE2 (2)
// continue at the second and third edge of the previous triangle. BACKTRACK (3), after one of those two, continues at
// the edge of the triangle before the previous one that was not taken. A first use is the next vertex.
inline constexpr std::size_t kDgfBlockBytes = 128, kDgfMaxVertices = 64;

// The size of a block, counted by its parts.
struct DgfBlockSize {
  std::size_t triangles, vertices;
  std::size_t vertex_bits;  // bits of one vertex, a multiple of 4
  std::size_t reused;       // indices that are no first use
  std::uint32_t reused_width;

  bool fits() const;
};

struct DgfBlock {
  std::array<std::uint8_t, kDgfBlockBytes> bytes;
  std::vector<std::uint8_t> vertices;   // by vertex of the block: its place among the given points
  std::vector<std::uint8_t> triangles;  // in the block's order: number among the given triangles
};

// Whether one block can hold all of these points: they differ by less than 2^16 steps along each axis.
bool fits_dgf(std::span<const LatticePoint> points);

// Encodes the triangles `some` of a cluster, 1 to 64 and each once, as the first strip of them that fits into a block.
// Returns nothing where none fits. `points` are places of `lattice`, at most 2^kDgfPlaceBits from the origin, by the
// triangles' corners. `first_triangle` is below 2^29.
//
// Invariants (cited by the tests):
//   DGF1  decode_dgf_block() gives the same lattice points and triangles, each with its winding, in the order that
//         encode_dgf_block() says.
//   DGF2  decode_dgf_block() reads 128 bytes of any content: it gives triangles whose vertices exist, or nothing.
//   DGF3  Three vertices of a lattice always fit.
std::optional<DgfBlock> encode_dgf_block(const PositionLattice& lattice, std::span<const LatticePoint> points,
                                         const TriangleAdjacency& triangles, std::span<const std::uint8_t> some,
                                         std::uint32_t first_triangle);

struct DecodedDgfBlock {
  std::vector<Vec3> positions;
  std::vector<LocalTriangle> triangles;
  std::uint32_t first_triangle = 0;
};
// `bytes` are kDgfBlockBytes bytes with any content. Returns nothing where they are no such block.
std::optional<DecodedDgfBlock> decode_dgf_block(std::span<const std::uint8_t> bytes);

// Returns blocks that hold each of `triangles`, at most kMaxClusterTriangles, once: the fewest blocks among several
// greedy partitions. Throws nothing.
std::vector<DgfBlock> encode_dgf_blocks(const PositionLattice& lattice, std::span<const LatticePoint> points,
                                        std::span<const LocalTriangle> triangles);

}  // namespace tessera::scene

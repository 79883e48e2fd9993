#pragma once

#include <array>
#include <cstdint>
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

}  // namespace tessera::baselines

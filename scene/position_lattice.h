#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/vec.h"
#include "scene/capture.h"
#include "scene/geometry_settings.h"

namespace tessera::scene {

// A point of a lattice, in steps from the object's origin.
using LatticePoint = std::array<std::int32_t, 3>;

// The grid that positions of an object are kept on: all multiples of a power of two, the same along all axes.
//
// Invariants (cited by the tests):
//   LAT1  point() is exact: place(point(k)) is k for every k that place() returns.
//   LAT2  place() lies at most half a step from the position along each axis; a step where half of one more would be
//         infinite.
//   LAT3  Positions within the box that the lattice was made for differ by less than 2^bits steps along each axis.
//   LAT4  Equal positions have equal places.
struct PositionLattice {
  // The step is 2^exponent.
  int exponent = 0;
  LatticePoint origin{};  // the place of the box's least corner

  // Nearest place, ties to even. |k| <= 2^24.
  LatticePoint place(const Vec3& position) const;
  Vec3 point(const LatticePoint& place) const;
};

// Places are at most 2^kPlaceBits from the origin, as fine as floats are there; of blocks of DGF, whose anchors have 24 bits
// with the sign, half as many.
inline constexpr int kPlaceBits = 24, kDgfPlaceBits = 23;

// The finest lattice for a box whose corners are finite, on which its positions take `bits` bits, 8 to 16, along each axis;
// not finer than 2^-126, nor than that its places are at most 2^place_bits, with 1 to kPlaceBits of them.
PositionLattice make_lattice(const Vec3& low, const Vec3& high, int bits, int place_bits = kPlaceBits);

// Whether the memory may hold encoded positions of a primitive: its vertices are the capture's own at all times.
bool rests_always(const Primitive& primitive);

// The lattice of each mesh, by number; of meshes without resting primitives nothing sensible. A mesh has one lattice for
// all its primitives, so that its seams stay closed. Meshes that hold a vertex in the same place of nodes with the same
// transform, when the capture rests, share theirs.
std::vector<PositionLattice> mesh_lattices(const Capture& capture, const GeometrySettings& settings);

}  // namespace tessera::scene

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

// The grid on which the positions of an object are kept: all multiples of a power of two, the same along all axes.
//
// Invariants (cited by the tests):
//   LAT1  point() is exact: place(point(k)) is k for every k that place() returns.
//   LAT2  place() lies at most half a step from the position along each axis, or at most one step where the nearer
//         place would have an infinite coordinate.
//   LAT3  Positions within the box for which the lattice was made differ by less than 2^bits steps along each axis.
//   LAT4  Equal positions have equal places.
struct PositionLattice {
  // The step is 2^exponent.
  int exponent = 0;
  LatticePoint origin{};  // the place of the box's least corner

  // Nearest place, ties to even. |k| <= 2^24.
  LatticePoint place(const Vec3& position) const;
  Vec3 point(const LatticePoint& place) const;
};

// Places are at most 2^kPlaceBits steps from the origin, where floats still resolve a step. Blocks of DGF, whose
// anchors have 24 bits with the sign, reach half as far.
inline constexpr int kPlaceBits = 24, kDgfPlaceBits = 23;

// The finest lattice on which positions in a box with finite corners need at most `bits` bits, 8 to 16, along each
// axis. Its step is at least 2^-126, and its places are at most 2^place_bits from the origin, with place_bits from 1 to
// kPlaceBits.
PositionLattice make_lattice(const Vec3& low, const Vec3& high, int bits, int place_bits = kPlaceBits);

// Whether the memory may hold encoded positions of a primitive: its vertices are the capture's own at all times.
bool rests_always(const Primitive& primitive);

// The lattice of each mesh, by number; the entry of a mesh without resting primitives is unspecified. A mesh has one
// lattice for all its primitives, so that its seams stay closed. Meshes share a lattice if, in the rest pose of the
// capture, nodes with the same transform draw them and they have a vertex in the same place.
std::vector<PositionLattice> mesh_lattices(const Capture& capture, const GeometrySettings& settings);

}  // namespace tessera::scene

#pragma once

#include <cstdint>
#include <vector>

#include "base/vec.h"
#include "scene/geometry_settings.h"

namespace tessera::scene {

struct Assembly;

// What the emulated memory holds in place of a primitive's positions and cells, and what they decode to. Empty: floats, as
// in the capture.
struct HeldGeometry {
  std::vector<Vec3> positions;                 // decoded, by the primitive's vertex
  std::vector<std::uint32_t> record_bytes;     // of each patch or cluster, behind the header
  std::vector<std::uint16_t> record_elements;  // what a decoder gives of each: vertices, and coded cells or triangles

  bool raw() const { return positions.empty(); }
};

// Encodes the geometry of an assembly whose memory holds floats, and puts what it decodes to in its place: positions,
// cells, bounds, groups and neighbours. Surfaces whose vertices may move, points, lines and procedures stay as they are.
// Throws BudgetError where decoded positions need more memory than the capture left.
//
// Invariants (cited by the tests):
//   HG1  Positions that were equal stay equal, in all primitives of a mesh and in all records.
//   HG2  A position moves by at most half a step of its mesh's lattice along each axis.
//   HG3  Clusters keep their vertices and cells, the cells in their order and with their corners; with dgf they keep their
//        triangles, which lie in the order of blocks and make other cells. Instances share records.
void hold_geometry(const GeometrySettings& settings, Assembly& assembly);

}  // namespace tessera::scene

#pragma once

#include <cstdint>
#include <vector>

#include "base/vec.h"
#include "scene/geometry_settings.h"

namespace tessera::scene {

struct Assembly;

// Encoded positions and cells of a primitive in the emulated memory, and their decoded values. Empty where the memory
// holds floats, as in the capture.
struct HeldGeometry {
  std::vector<Vec3> positions;              // decoded, by the primitive's vertex
  std::vector<std::uint32_t> record_bytes;  // per patch or cluster: bytes after the header
  std::vector<std::uint16_t>
      record_elements;  // per record: elements that a decoder outputs: vertices, and coded cells or triangles

  bool raw() const { return positions.empty(); }
};

// Encodes the geometry of an assembly whose memory holds floats, and replaces positions, cells, bounds, groups and
// neighbours by the decoded ones. Surfaces whose vertices may move, points, lines and procedures stay as they are.
// Throws BudgetError where decoded positions need more memory than the capture left.
//
// Invariants (cited by the tests):
//   HG1  Positions that were equal stay equal, in all primitives of a mesh and in all records.
//   HG2  A position moves by at most half a step of its mesh's lattice along each axis.
//   HG3  Clusters keep their vertices and cells, the cells in their order and with their corners; with dgf they keep their
//        triangles, which lie in the order of blocks and make other cells. Instances share records.
void hold_geometry(const GeometrySettings& settings, Assembly& assembly);

}  // namespace tessera::scene

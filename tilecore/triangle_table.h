#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "tilecore/tessellation/micro_mesh.h"

namespace tessera::tilecore {

// The samples of a tile name triangles by a number in the tile. The sub-patches that they see are numbered, and a sample
// keeps the number of its sub-patch and of the triangle in it. The tile memory holds a record for each such sub-patch.
// For what is seen elsewhere than at rest (moving, or through a lens) it also holds the corners of leaves at shutter open,
// from which the place of a sample follows by its weights. The table survives partial renders with the samples.
//
// Invariants (cited by the tests):
//   TT1  A sub-patch has a record, and one of its leaves corners, exactly if a sample kept a triangle of it.
class TriangleTable {
 public:
  static constexpr std::uint64_t kRecordBytes = 16;  // base patch, segment, range of cells, where its corners are
  static constexpr std::uint64_t kCornerBytes = 8;   // a corner's place on screen at shutter open

  void clear() { bytes_ = 0; }
  // Samples kept a triangle of the sub-patch in hand, by its number in the base patch. Entries of a tile have no cell in
  // common, so that no triangle is of two sub-patches.
  void see(std::uint32_t triangle) {
    if (triangle >= seen_.size()) seen_.resize(std::size_t{triangle} + 1);
    if (seen_[triangle] != 0) return;
    seen_[triangle] = 1;
    triangles_.push_back(triangle);
  }
  // The sub-patch in hand is done. `moves`: it is seen elsewhere than at rest. Returns the bytes written for it.
  std::uint64_t end_sub_patch(const MicroMesh& mesh, bool moves);

  // Triangles of the sub-patch in hand that samples kept, each once.
  std::span<const std::uint32_t> seen() const { return triangles_; }

  // Bytes of the tile memory that it takes.
  std::uint64_t bytes() const { return bytes_; }

 private:
  bool sees_leaf(const MicroMesh& mesh, std::size_t leaf) const;
  // Corners of a leaf, each once.
  std::uint64_t corners_of(const MicroMesh& mesh, std::size_t leaf);

  std::uint64_t bytes_ = 0;
  std::vector<std::uint8_t> seen_;             // by triangle of the sub-patch in hand
  std::vector<std::uint32_t> triangles_;       // those, each once
  std::vector<std::uint32_t> leaf_of_corner_;  // the leaf that a corner was counted for last, by number in the mesh
  std::uint32_t leaves_ = 0;                   // counted
};

}  // namespace tessera::tilecore

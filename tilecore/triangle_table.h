#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "tilecore/tessellation/micro_mesh.h"

namespace tessera::tilecore {

// The samples of a tile name triangles by a number in the tile: the number of a sub-patch that the tile sees, and of
// the triangle in it. The tile memory holds a record for each such sub-patch. For a sub-patch that moves or is seen
// through a lens it also holds the corners of leaves at shutter open, from which the weights give a sample's place. The
// table survives partial renders with the samples.
//
// Invariants (cited by the tests):
//   TT1  A sub-patch has a record, and one of its leaves corners, exactly if a sample kept a triangle of it.
class TriangleTable {
 public:
  static constexpr std::uint64_t kRecordBytes = 16;  // base patch, segment, range of cells, address of its corners
  static constexpr std::uint64_t kCornerBytes = 8;   // a corner's place on screen at shutter open

  void clear() { bytes_ = 0; }
  // Notes that samples kept a triangle of the current sub-patch, by its number in the base patch. Entries of a tile
  // have no cell in common, so no triangle belongs to two sub-patches.
  void see(std::uint32_t triangle) {
    if (triangle >= seen_.size()) seen_.resize(std::size_t{triangle} + 1);
    if (seen_[triangle] != 0) return;
    seen_[triangle] = 1;
    triangles_.push_back(triangle);
  }
  // Ends the current sub-patch. `moves`: it moves or is seen through a lens. Returns the bytes written for it.
  std::uint64_t end_sub_patch(const MicroMesh& mesh, bool moves);

  // Triangles of the current sub-patch that samples kept, each once.
  std::span<const std::uint32_t> seen() const { return triangles_; }

  // Bytes of the tile memory that the table takes.
  std::uint64_t bytes() const { return bytes_; }

 private:
  bool sees_leaf(const MicroMesh& mesh, std::size_t leaf) const;
  // Number of corners of a leaf, each counted once.
  std::uint64_t corners_of(const MicroMesh& mesh, std::size_t leaf);

  std::uint64_t bytes_ = 0;
  std::vector<std::uint8_t> seen_;             // by triangle of the current sub-patch
  std::vector<std::uint32_t> triangles_;       // the seen triangles, each once
  std::vector<std::uint32_t> leaf_of_corner_;  // by corner: number of the leaf that counted it last
  std::uint32_t leaves_ = 0;                   // number of counted leaves
};

}  // namespace tessera::tilecore

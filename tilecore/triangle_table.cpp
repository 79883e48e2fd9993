#include "tilecore/triangle_table.h"

#include <algorithm>
#include <utility>

namespace tessera::tilecore {

bool TriangleTable::sees_leaf(const MicroMesh& mesh, std::size_t leaf) const {
  const std::size_t first = leaf * kLeafCells;
  for (std::size_t cell = first; cell < first + mesh.leaves[leaf].cell_count; ++cell)
    for (std::size_t half = 0; half < 2; ++half)
      if (const std::size_t t = mesh.triangle[cell] + half;
          t < seen_.size() && seen_[t] != 0 && (half == 0 || mesh.corner[2][cell] != mesh.corner[3][cell]))
        return true;
  return false;
}

std::uint64_t TriangleTable::corners_of(const MicroMesh& mesh, std::size_t leaf) {
  if (leaf_of_corner_.size() < mesh.x0.size()) leaf_of_corner_.resize(mesh.x0.size());
  if (++leaves_ == 0) std::fill(leaf_of_corner_.begin(), leaf_of_corner_.end(), 0), ++leaves_;
  std::uint64_t count = 0;
  const std::size_t first = leaf * kLeafCells;
  for (std::size_t cell = first; cell < first + mesh.leaves[leaf].cell_count; ++cell)
    for (const auto& corner : mesh.corner)
      if (std::exchange(leaf_of_corner_[static_cast<std::size_t>(corner[cell])], leaves_) != leaves_) ++count;
  return count;
}

std::uint64_t TriangleTable::end_sub_patch(const MicroMesh& mesh, bool moves) {
  if (triangles_.empty()) return 0;
  std::uint64_t written = kRecordBytes;
  if (moves)
    for (std::size_t leaf = 0; leaf < mesh.leaves.size(); ++leaf)
      if (sees_leaf(mesh, leaf)) written += kCornerBytes * corners_of(mesh, leaf);
  for (const std::uint32_t triangle : triangles_) seen_[triangle] = 0;
  triangles_.clear();
  bytes_ += written;
  return written;
}

}  // namespace tessera::tilecore

#include "tilecore/tessellation/micro_mesh.h"

namespace tessera::tilecore {

void MicroMesh::resize_vertices(std::size_t count, bool moving) {
  vertex_count = count;
  for (auto* v : {&x0, &y0, &z0}) v->resize(count);
  if (moving)
    for (auto* v : {&x1, &y1, &z1}) v->resize(count);
  projected.resize(count);
}

void MicroMesh::clear_cells() {
  for (auto& c : corner) c.clear();
  triangle.clear();
  used.clear();
  leaves.clear();
  clipped_cells.clear();
  triangle_count = 0;
}

void MicroMesh::begin_leaf(const Grid& grid) {
  leaves.push_back(Leaf{});
  leaves.back().grid = grid;
  const std::size_t slots = leaves.size() * kLeafCells;
  for (auto& c : corner) c.resize(slots, 0);
  triangle.resize(slots, 0);
}

void MicroMesh::add_cell(const std::array<std::int32_t, 4>& corners, std::uint32_t first_triangle) {
  const std::size_t slot = (leaves.size() - 1) * kLeafCells + leaves.back().cell_count++;
  for (std::size_t k = 0; k < 4; ++k) corner[k][slot] = corners[k];
  triangle[slot] = first_triangle;
}

std::size_t MicroMesh::memory_bytes() const {
  std::size_t bytes = sizeof(MicroMesh);
  for (const auto* v : {&x0, &y0, &z0, &x1, &y1, &z1, &box_x_low, &box_x_high, &box_y_low, &box_y_high})
    bytes += v->capacity() * sizeof(float);
  for (const auto& c : corner) bytes += c.capacity() * sizeof(std::int32_t);
  return bytes + triangle.capacity() * sizeof(std::uint32_t) + projected.capacity() + used.capacity() +
         leaves.capacity() * sizeof(Leaf) + clipped_cells.capacity() * sizeof(std::uint32_t);
}

}  // namespace tessera::tilecore

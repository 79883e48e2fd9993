#pragma once

#include <array>
#include <cstdint>

#include "tilecore/tessellation/micro_mesh.h"

namespace tessera::test {

// All triangles of a mesh: visit(corners, Tessera's number).
template <class Visit>
void for_each_triangle(const tilecore::MicroMesh& mesh, const Visit& visit) {
  using Triangle = std::array<std::int32_t, 3>;
  for (std::size_t c = 0; c < mesh.used.size(); ++c) {
    if (!mesh.used[c]) continue;
    visit(Triangle{mesh.corner[0][c], mesh.corner[1][c], mesh.corner[2][c]}, mesh.triangle[c]);
    if (mesh.corner[2][c] != mesh.corner[3][c])
      visit(Triangle{mesh.corner[0][c], mesh.corner[2][c], mesh.corner[3][c]}, mesh.triangle[c] + 1);
  }
}

}  // namespace tessera::test

#pragma once

#include <cstdint>
#include <vector>

#include "scene/capture.h"

namespace tessera::scene {

// Numbers the distinct points among the vertices, 0, 1, ... in order of first appearance; one number per vertex. Two
// vertices are one point when all data that affects their motion is equal bit by bit (0 and -0 are one): position,
// joints of non-zero weight, weights, and the positions of every morph target. Points with equal numbers move together
// forever; texture coordinates, normals and colours may differ.
std::vector<std::uint32_t> weld_points(const Vertices& vertices);

}  // namespace tessera::scene

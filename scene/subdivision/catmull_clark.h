#pragma once

#include <string>

#include "scene/capture.h"
#include "scene/limits.h"
#include "scene/subdivision/control_cage.h"

namespace tessera::scene::subdivision {

// Turns a Catmull-Clark control mesh into bicubic Bezier patches: refines the cage rules.levels times (OpenSubdiv) and
// gives every face of the last level a patch (limit_masks.h says which, and what is exact).
//
// `cage` is a primitive of triangles. The result has its material and the same number of morph targets. Positions and
// their morph differences are weighted sums of the cage's; influences are blended with the same weights, the eight
// largest kept and renormalised; texture coordinates and colours are bilinear within each face of the cage. Normals and
// tangents are dropped: a patch has its own.
//
// Memory is charged to `budget` before it is taken, naming `what`. Throws CageError, LimitError.
Primitive convert(const Primitive& cage, const CageRules& rules, MemoryBudget& budget, const std::string& what);

}  // namespace tessera::scene::subdivision

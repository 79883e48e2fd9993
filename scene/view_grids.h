#pragma once

#include "scene/frame_geometry.h"

namespace tessera::scene {

// Gives the patches of a view of a scene the grids that the scene's own camera asks for, so that what both see is the same
// triangles. Patches that the camera does not see have no more cells than either view asks for. Whether an edge is seen
// is said by its curve alone, so patches that meet in it still have the same vertices there. Procedures that the scene
// samples keep the view's grids.
void keep_grids(const FrameGeometry& scene, FrameGeometry& view);

}  // namespace tessera::scene

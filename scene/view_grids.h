#pragma once

#include "scene/frame_geometry.h"

namespace tessera::scene {

// Gives the patches in a view of a scene the grids that the scene's own camera chose, so that both views draw the same
// triangles. A patch that the camera does not see has no more cells than the finer of both views' grids. Whether an
// edge is seen depends on its curve alone, so patches that meet in it still have the same vertices there. Procedures
// that the scene samples keep the view's grids.
void keep_grids(const FrameGeometry& scene, FrameGeometry& view);

}  // namespace tessera::scene

#pragma once

#include <array>

#include "base/vec.h"
#include "frontend/bounds/oriented_box.h"
#include "scene/cluster_bounds.h"
#include "scene/frame_geometry.h"

namespace tessera::frontend {

// The tight box of a cluster at rest, in its own frame, and its axis-aligned box.
MovingBox resting_box(const scene::ClusterBound& bound);
MovingBox aligned_box(const scene::ClusterBound& bound);

// Proves that no triangle of a cluster can face the camera, at any time, from any lens point and for any rounding of
// its vertices. `corners`: the corners of a box that holds its vertices. The drawable must be single-sided and not
// deform.
//
// A matrix that moves a triangle moves the cross product of its edges by the matrix of cofactors. As vertices move
// linearly in camera space, the cross product at time t is moved by (1 - t)^2 K0 + 2 t (1 - t) Km + t^2 K1: the
// cofactors at both keys and a mixed term. That lies in the hull of the three, and the vertices lie in the hull of the
// corners, so the cone is tested under three matrices at every corner. As in BackFaceTest the triangles must face away
// from the whole lens, steeply enough that neither rounding nor the sub-pixel grid can turn one over. The bound's sizes
// give the least triangle, which decides here.
bool cluster_faces_away(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable,
                        const scene::ClusterBound& bound, const MovingCorners& corners);

}  // namespace tessera::frontend

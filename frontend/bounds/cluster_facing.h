#pragma once

#include <array>

#include "base/vec.h"
#include "frontend/bounds/oriented_box.h"
#include "scene/cluster_bounds.h"
#include "scene/frame_geometry.h"

namespace tessera::frontend {

// The box of a cluster that rests, in its own frame, and the aligned one.
MovingBox resting_box(const scene::ClusterBound& bound);
MovingBox aligned_box(const scene::ClusterBound& bound);

// Proves that no triangle of a cluster can face the camera, whatever the time, the lens point and the rounding of its
// vertices. `corners`: of a box that holds its vertices; the drawable is single-sided and does not deform.
//
// A triangle that a matrix moves has the cross product of its edges moved by the matrix of cofactors, and at time t, as
// its vertices move linearly in camera space, by (1 - t)^2 K0 + 2 t (1 - t) Km + t^2 K1: the cofactors at both keys and
// what they have in common. That lies in the hull of the three, and the vertices in the hull of the corners, so that the
// cone is looked at under three matrices at every corner. As in BackFaceTest the triangles must face away from the whole
// lens and steeply enough that neither rounding nor the sub-pixel grid can turn one over: here the least of them all, by
// what the bound says of their sizes.
bool cluster_faces_away(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable,
                        const scene::ClusterBound& bound, const MovingCorners& corners);

}  // namespace tessera::frontend

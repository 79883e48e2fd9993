#pragma once

#include <array>

#include "scene/capture.h"
#include "scene/pose.h"
#include "scene/view.h"

namespace tessera::scene {

// Points and lines: primitives whose vertices are moved apart in the plane of the image, so that a point is a square of
// one pixel and a line a strip one pixel wide, as glTF 2.0 section 3.7.2.1 asks. From there on they are triangles.
//
// Invariants (cited by the tests):
//   WI1  A vertex keeps its depth and w; only its pixel position moves, by half a pixel across the line.
//   WI2  Both ends of a segment move the same way in the image, also where one of them lies behind the camera.

// Transform from the space of a drawable's posed vertices to world space. The posed vertices of a wire have the world's
// axes with the camera in the origin, where floats resolve a pixel wherever the camera is; for other drawables it is
// object_to_world().
DMat4 vertices_to_world(const Capture& capture, int node, std::size_t instance, const Primitive& primitive,
                        const Pose& pose, const View& view);

// Moves the wire's vertices, deformed or (where `deformed` is empty) the primitive's own, to that space and spreads
// them apart. Normals and tangents are moved as well.
void spread_wires(const Primitive& primitive, const DMat4& to_world, const View& view, const Projection& projection,
                  Deformed& deformed);

}  // namespace tessera::scene

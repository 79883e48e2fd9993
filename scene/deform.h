#pragma once

#include <vector>

#include "scene/capture.h"
#include "scene/pose.h"

namespace tessera::scene {

// Vertices after morph targets and skinning. A vector stays empty when the pose does not change that attribute; the
// primitive's own values hold then.
struct Deformed {
  std::vector<Vec3> positions, normals;
  std::vector<Vec4> tangents;
};

// True when the pose can change the primitive's vertices at all.
bool is_deforming(const Capture& capture, int node, const Primitive& primitive);

// Applies the morph weights of `node`, then its skin. Skinned vertices come out in world space.
void deform(const Capture& capture, int node, const Primitive& primitive, const Pose& pose, Deformed& out);

// From the space of the (deformed) vertices to world: the node's own transform after that of the instance, where it has
// any, or nothing for a skinned mesh, which has none.
DMat4 object_to_world(const Capture& capture, int node, std::size_t instance, const Primitive& primitive,
                      const Pose& pose);

}  // namespace tessera::scene

#pragma once

#include <vector>

#include "scene/capture.h"

namespace tessera::scene {

// The scene graph at one moment.
struct Pose {
  std::vector<DMat4> world;                 // per node: node space to world
  std::vector<bool> in_scene;               // per node: reachable from the scene's roots
  std::vector<bool> visible;                // per node: neither it nor any ancestor is hidden
  std::vector<std::vector<float>> weights;  // per node: current morph weights
};

// Poses the capture at `time` seconds: plays Capture::played_animations, each clamped to its own keys, and multiplies
// the transforms down the graph (in double precision, so that far-away scenes do not jitter).
Pose pose_at(const Capture& capture, double time);

// Transform from an instance's own space to its node's space.
DMat4 instance_to_node(const InstanceTransform& instance);

// Value of a channel at `time`: `components` numbers. Step, linear (rotations: shortest-way slerp) and cubic spline as
// glTF 2.0 appendix C defines them. Exposed for tests.
std::vector<double> evaluate_channel(const AnimationChannel& channel, double time);

// Vertices after morph targets and skinning. A vector stays empty when the pose does not change that attribute; the
// primitive's own values hold then.
struct Deformed {
  std::vector<Vec3> positions, normals;
  std::vector<Vec4> tangents;
};

// True when the pose can change the primitive's vertices at all.
bool is_deforming(const Capture& capture, int node, const Primitive& primitive);

// Applies the morph weights of `node`, then its skin. Skinned vertices come out along the axes of world space, counted
// from an origin near them (object_to_world()), so that their precision does not depend on the place of the joints;
// turn_normals() turns their normals.
void deform(const Capture& capture, int node, const Primitive& primitive, const Pose& pose, Deformed& out);

// Matrix for the normals of a surface that `linear` transforms: the inverse transpose, times the cube root of
// |determinant|, so that an even scale leaves lengths as they are. For a singular matrix it is the cofactors, which
// have the limit's direction; the identity where those are zero, too.
DMat3 turn_normals(const DMat3& linear);

// Transform from the space of the (deformed) vertices to world space: first the instance's transform, if any, then the
// node's own. A skinned mesh ignores both: its transform is a translation to the origin from which its vertices are
// counted.
DMat4 object_to_world(const Capture& capture, int node, std::size_t instance, const Primitive& primitive,
                      const Pose& pose);

// Determinant of the node's global transform, the instance's transform included. Where it is negative, triangles wind
// the other way, skinned or not (glTF 2.0 section 3.7.4).
double winding_determinant(const Capture& capture, int node, std::size_t instance, const Pose& pose);

}  // namespace tessera::scene

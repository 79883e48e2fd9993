#pragma once

#include <vector>

#include "scene/capture.h"

namespace tessera::scene {

// The scene graph at one moment.
struct Pose {
  std::vector<DMat4> world;                 // per node: node space to world
  std::vector<bool> in_scene;               // per node: reachable from the scene's roots
  std::vector<bool> visible;                // per node: neither it nor what is above it is hidden
  std::vector<std::vector<float>> weights;  // per node: morph weights that are in force
};

// Poses the capture at `time` seconds: plays Capture::played_animations, each clamped to its own keys, and multiplies
// the transforms down the graph (in double precision, so that far-away scenes do not jitter).
Pose pose_at(const Capture& capture, double time);

// An instance's own space to its node's.
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

// Applies the morph weights of `node`, then its skin. Skinned vertices come out in world space, but from an origin near
// them (object_to_world()), so that they are as precise wherever the joints are; their normals by turn_normals().
void deform(const Capture& capture, int node, const Primitive& primitive, const Pose& pose, Deformed& out);

// Takes normals where `linear` takes a surface: its inverse transpose, times the cube root of |determinant|, so that an
// even scale leaves lengths as they are. Where it is singular: the cofactors, which are the limit's direction; the
// identity where those are zero, too.
DMat3 turn_normals(const DMat3& linear);

// From the space of the (deformed) vertices to world: the node's own transform after that of the instance, where it has
// any; for a skinned mesh, which has none, a translation to the origin that its vertices are counted from.
DMat4 object_to_world(const Capture& capture, int node, std::size_t instance, const Primitive& primitive,
                      const Pose& pose);

// Determinant of the node's global transform, that of the instance included: where it is negative, triangles wind the
// other way, skinned or not (glTF 2.0 section 3.7.4).
double winding_determinant(const Capture& capture, int node, std::size_t instance, const Pose& pose);

}  // namespace tessera::scene

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

}  // namespace tessera::scene

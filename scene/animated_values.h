#pragma once

#include <span>
#include <vector>

#include "scene/capture.h"

namespace tessera::scene {

// Values that KHR_animation_pointer moves, besides those of nodes (pose.h). Played as pose_at() plays; a frame takes
// them where its shutter opens. A value that the property cannot have becomes the nearest one that it can.
//
// Invariants (cited by the tests):
//   AV1  What no played channel moves comes back as it was.
//   AV2  Animated values stay in the ranges that the reader asks of a file's own.

// One that a played channel gives to a material of the capture.
struct MaterialValue {
  int material;
  double value;
  bool operator==(const MaterialValue&) const = default;
};

// Materials of a capture, whose numbers are given: `source[i]` is the number of materials[i], or kNone.
void animate_materials(const Capture& capture, double time, std::span<const int> source,
                       std::vector<Material>& materials);

// `base`: the camera as the file, or a setting, has it; its lens stays.
Camera animate_camera(const Capture& capture, double time, int camera, Camera base);

// As Capture::lights.
std::vector<shaders::Light> animate_lights(const Capture& capture, double time);

// All values of materials that played channels move, for telling frames apart.
std::vector<MaterialValue> animated_material_values(const Capture& capture, double time);

}  // namespace tessera::scene

#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "scene/capture.h"

namespace tessera::scene {

// Values that KHR_animation_pointer moves, besides the values of nodes (pose.h). They are played as pose_at() plays; a
// frame takes them at the time at which its shutter opens. A value that the property cannot have is replaced by the
// nearest allowed value.
//
// Invariants (cited by the tests):
//   AV1  A value that no played channel moves is returned unchanged.
//   AV2  Animated values stay in the ranges that the reader demands of values in the file.

// A value that a played channel gives to a material of the capture.
struct MaterialValue {
  int material;
  double value;
  bool operator==(const MaterialValue&) const = default;
};

// Animates materials of a capture: `source[i]` is the capture's number of materials[i], or kNone.
void animate_materials(const Capture& capture, double time, std::span<const int> source,
                       std::vector<Material>& materials);

// `base` is the camera of the file or of a setting; its lens stays.
Camera animate_camera(const Capture& capture, double time, int camera, Camera base);

// The lights in the order of Capture::lights.
std::vector<shaders::Light> animate_lights(const Capture& capture, double time);

// All values of materials that played channels move; equal values mean equal materials in two frames.
std::vector<MaterialValue> animated_material_values(const Capture& capture, double time);

// Procedures whose parameters are animated, at the motion keys of a frame. A point of such a surface moves along a
// straight line from its place with the numbers of shutter open to its place with the numbers of shutter close.
//
// Invariants (cited by the tests):
//   AP1  Numbers that no played channel moves are the file's own; animated numbers stay in their parameter's range.
//   AP2  Procedures without such channels are the capture's own objects.
struct PosedProcedures {
  // In the order of Capture::procedures if any procedure is animated, else empty; null for procedures that are not
  // animated. Both keys share one object where their numbers are equal.
  std::vector<std::array<std::shared_ptr<const Procedure>, 2>> keys;
  std::vector<double> values;  // of all channels; equal values mean equal procedures in two frames

  const Procedure& at(const Capture& capture, std::size_t procedure, std::size_t key) const {
    const bool posed = procedure < keys.size() && keys[procedure][key] != nullptr;
    return posed ? *keys[procedure][key] : capture.procedures[procedure];
  }
};

// Nodes whose procedure has numbers that a played channel moves, in order.
std::vector<int> animated_procedures(const Capture& capture);

// Poses the procedures at both ends of a part of the shutter.
PosedProcedures pose_procedures(const Capture& capture, double open, double close);

// Whether two states of one procedure have equal numbers of the shape, or of texture and shading.
bool same_shape(const Procedure& a, const Procedure& b);
bool same_look(const Procedure& a, const Procedure& b);

}  // namespace tessera::scene

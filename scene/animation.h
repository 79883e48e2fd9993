#pragma once

#include <array>
#include <memory>
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

// Procedures whose parameters are animated, at the motion keys of a frame. A point of such a surface moves along a
// straight line from where the numbers of shutter open put it to where those of shutter close do.
//
// Invariants (cited by the tests):
//   AP1  Numbers that no played channel moves are the file's own; those that are moved stay in their parameter's range.
//   AP2  Procedures without such channels are the capture's own objects.
struct PosedProcedures {
  // As Capture::procedures where one is animated, else empty; null where this one is not. Both are one object where
  // their numbers are the same.
  std::vector<std::array<std::shared_ptr<const Procedure>, 2>> keys;
  std::vector<double> values;  // of all channels, for telling frames apart

  const Procedure& at(const Capture& capture, std::size_t procedure, std::size_t key) const {
    const bool posed = procedure < keys.size() && keys[procedure][key] != nullptr;
    return posed ? *keys[procedure][key] : capture.procedures[procedure];
  }
};

// Nodes whose procedure a played channel moves numbers of, in order.
std::vector<int> animated_procedures(const Capture& capture);

// At both ends of a part of the shutter.
PosedProcedures pose_procedures(const Capture& capture, double open, double close);

// Whether two states of one procedure have the same shape, and the same numbers of texture and shading.
bool same_shape(const Procedure& a, const Procedure& b);
bool same_look(const Procedure& a, const Procedure& b);

}  // namespace tessera::scene

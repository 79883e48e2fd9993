#pragma once

#include <array>
#include <memory>
#include <vector>

#include "scene/capture.h"

namespace tessera::scene {

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

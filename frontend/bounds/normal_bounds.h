#pragma once

#include <array>
#include <optional>

#include "frontend/bounds/patch_net.h"

namespace tessera::frontend {

// Directions of the unit normal of a part of a patch, in a frame whose z is near the normal: a cone about z, and the
// largest deviation of single-precision evaluation from it.
struct NormalCone {
  double sine = 1, cosine = 0;  // of the half angle
  double error = 0;             // of each component, as the machine's floats evaluate the normal
};

// Components of the normal along the frame's axes.
struct NormalRange {
  std::array<double, 3> low{-1, -1, -1}, high{1, 1, 1};
};
// The full range when there is no cone.
NormalRange normal_range(const std::optional<NormalCone>& cone);

// Accuracy of the domain shader on the current patch.
struct DerivativeError {
  double absolute;          // of a float derivative by the base patch's parameter, in units of the control points
  double scale_u, scale_v;  // extent of the part in the base patch's parameters
};
// For a base net: 256 roundings of its largest coordinate (the shader does fewer than 128 operations on values no
// larger than three times that).
double derivative_rounding(const PatchNet& net);

// Cones about the tangents' axes, and the bounds that follow for the cross product of any vector of one cone with any
// of the other.
struct TangentCones {
  double sine_u, sine_v;  // half angles, widened
  double sine_between;    // of the axes
  double cosine_between;  // magnitude
  double min_sine;        // least sine of the angle between two tangents
  double min_length_u, min_length_v, max_length2_u,
      max_length2_v;  // of the derivatives by the part's parameters, a third; squared
};

// TPATCH (Munkberg et al. 2010), made conservative. Published, the cosine between the tangents enters the cone's angle
// with its sign, which is too narrow once they open beyond 90 degrees; here its magnitude does, and the cones may
// overlap neither each other nor each other's mirror image: alpha_u + alpha_v < min(beta, pi - beta).
// Returns nullopt if that fails, or if a control vector is zero or turns away from its axis.
std::optional<TangentCones> tangent_cones(const NetMeasure& measure, const CornerFrame& frame);
// Sine of the half angle of the cone that holds every cross product; values of 1 and more mean that there is no cone.
double tpatch_sine(const TangentCones& cones);
std::optional<NormalCone> tpatch_cone(const TangentCones& cones, const DerivativeError& error);

// NPATCH: the cone of the control vectors of the normal's own Bezier patch. Never wider than `tpatch`, which holds for
// every pair of tangents, while NPATCH takes only pairs at one point.
std::optional<NormalCone> npatch_cone(const PatchNet& net, const NetMeasure& measure, const CornerFrame& frame,
                                      const std::optional<NormalCone>& tpatch, const DerivativeError& error);

// Normals along one edge of a patch: all cross products of the edge's three control vectors with the four of the
// derivative across it (in the order that gives the patch's normal), against axis z. For edges whose vertices another
// patch evaluates.
std::optional<NormalCone> edge_cone(const std::array<DVec3, 3>& along, const std::array<DVec3, 4>& across,
                                    bool across_first, const DVec3& z, double absolute_error, double scale);

}  // namespace tessera::frontend

#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "frontend/bounds/patch_net.h"

namespace tessera::frontend {

// Boxes of several parts of one base patch at once, one part in each lane: the shared data is computed or loaded once,
// and the chains of roots and quotients of the parts run side by side.
inline constexpr std::size_t kSiblings = 4;
using SiblingLanes = std::array<double, kSiblings>;

struct SiblingParameters {
  SiblingLanes u0, v0, u1, v1;
};
struct SiblingOffsets {
  SiblingLanes low, high;
};

// Bound on the normals along which the interior is displaced: none, their cone from the tangents, or also the cone from
// their own net.
enum class NormalsBy { kNothing, kTangents, kNormals };

// An edge whose vertices another patch evaluates; the lanes whose `touched` is not zero take part.
struct SiblingEdge {
  std::array<const std::array<DVec3, 4>*, 2> points, across;  // [key]
  double turned;    // 1 where edge x across is the patch's normal, -1 where across x edge is
  double rounding;  // of a float derivative of the owner's
  SiblingLanes first, last;
  SiblingOffsets offsets;
  SiblingLanes touched;
};
struct SiblingCorner {
  std::array<DVec3, 2> at;  // [key]
  SiblingLanes touched;
};

// Lanes of parts: `whole` chooses the frames, `inner` is the part that the patch's own heights displace.
struct SiblingParts {
  std::span<const PatchNet> keys;
  bool oriented, all_inner;
  NormalsBy normals;
  double rounding;  // of a float derivative
  SiblingParameters whole, inner;
  SiblingOffsets offsets;
  std::span<const SiblingEdge> edges;
  std::span<const SiblingCorner> corners;
};

struct SiblingBoxes {
  std::array<std::array<SiblingLanes, 3>, 3> axes;       // [axis][coordinate]
  std::array<std::array<SiblingLanes, 3>, 2> low, high;  // [key][axis]
};

// Gives the bits of restrict_net(), corner_frame(), measure_net(), tpatch_cone(), npatch_cone() and edge_cone() for one
// part after another, for finite parts. Raises neither the invalid nor the divide-by-zero flag.
void bound_siblings(const SiblingParts& parts, SiblingBoxes& boxes);

}  // namespace tessera::frontend

#pragma once

#include <array>
#include <span>

#include "base/vec.h"
#include "scene/tessellation_pattern.h"

namespace tessera::frontend {

// Double-precision cosines are off by a few 2^-53; this much is added to every squared sine and sine.
inline constexpr double kConeSlack = 1e-13;
// Tangents closer than this to parallel are left to the fallback: the domain shader's own test for irregular points
// (an angle of 1e-5, in floats) then never triggers inside a part that has a cone.
inline constexpr double kLeastSine = 0x1p-10;
// A cone counts as missing if floats cannot place its normals better than this.
inline constexpr double kLargestNormalError = 0x1p-6;
// Squared lengths below this count as zero; squares of floats' differences are far above it.
inline constexpr double kTinyLength2 = 1e-290;
// Tangents with a smaller sine between them span no plane.
inline constexpr double kLeastFrameSine = 1e-6;

// Control points of one bicubic patch at one key, one array per coordinate; index 4*j + i, i along u. Bounds compute in
// double precision: its rounding is far below the margin that they keep for the machine's own floats.
struct PatchNet {
  alignas(64) std::array<std::array<double, 16>, 3> c;

  DVec3 point(std::size_t k) const { return {c[0][k], c[1][k], c[2][k]}; }
};

PatchNet make_net(std::span<const Vec3, 16> points);

// An orthonormal frame; z is the patch's normal at its middle, more or less.
using Frame = std::array<DVec3, 3>;

// Tangent directions of a net: unit T along u and B along v from its corners, and the frame that they span (Munkberg et
// al. 2010): x along T, z along T x B. If the corners span no plane `regular` is false and the axes are the world's.
struct CornerFrame {
  Frame axes{DVec3(1, 0, 0), DVec3(0, 1, 0), DVec3(0, 0, 1)};
  DVec3 tangent_u{1, 0, 0}, tangent_v{0, 1, 0};
  double sine_between = 1;  // of the tangents' angle
  bool regular = false;
};
CornerFrame corner_frame(std::span<const PatchNet> keys);

// Extent of all control points along each axis.
struct Extents {
  std::array<double, 3> low, high;
};

// The control vectors of a tangent against the cone's axis: a(i,j) = c(i+1,j) - c(i,j) along u, likewise along v.
struct TangentSpread {
  double min_dot;      // of the vectors with the axis; <= 0 when one is zero or turns away
  double min_cosine2;  // squared cosine of the widest; meaningless when min_dot <= 0
  double max_length2;
};

struct NetMeasure {
  Extents extents;
  TangentSpread u, v;
};

// Control vectors of the normal's own Bezier patch of degree (5, 5), up to positive factors, against axis z.
struct NormalSpread {
  double min_dot;      // smallest v . z of the control vectors, factors included
  double min_cosine2;  // meaningless when min_dot <= 0
};

// Control points of the part [u0, u1] x [v0, v1]: blossoms of the base net, so that no rounding builds up from split to
// split. The four corners, edges and everything between reproduce the base patch.
PatchNet restrict_net(const PatchNet& net, const scene::ParameterRange& range);

NetMeasure measure_net(const PatchNet& net, const Frame& axes, const DVec3& tangent_u, const DVec3& tangent_v);
Extents measure_extents(const PatchNet& net, const Frame& axes);
NormalSpread measure_normals(const PatchNet& net, const DVec3& z);

// The part [a, b] of a cubic, or of anything with four cubic control values: rows of weights on them.
std::array<std::array<double, 4>, 4> cubic_restriction(double a, double b);
std::array<DVec3, 4> restrict_cubic(const std::array<DVec3, 4>& points,
                                    const std::array<std::array<double, 4>, 4>& rows);

// An edge (numbered as in PatchNeighbours): its control points, and a third of the derivative across it, which points
// along v or u on whichever side the patch lies.
std::array<DVec3, 4> edge_points(const PatchNet& net, std::size_t edge);
std::array<DVec3, 4> edge_across(const PatchNet& net, std::size_t edge);

}  // namespace tessera::frontend

#include "frontend/bounds/normal_bounds.h"

#include <algorithm>
#include <cmath>

#include "frontend/bounds/patch_net.h"

namespace tessera::frontend {
namespace {

double widened_sine(double cosine2) { return std::sqrt(std::max(0.0, 1 - cosine2) + kConeSlack); }

// Error of each component of a float normal whose derivatives are at least this long and open by at least this sine:
// the derivatives' errors turn the normal by their relative sizes over the sine; scaling, cross product and
// normalisation round a few more times.
double normal_error(double absolute, double length_u, double length_v, double sine) {
  return (absolute * (length_u + length_v) + 32 * 0x1p-24 * length_u * length_v) / (length_u * length_v * sine);
}

std::optional<NormalCone> checked(double sine, double error) {
  // Negated: NaN is no cone.
  if (!(sine < 1 && error < kLargestNormalError)) return std::nullopt;
  return NormalCone{sine, std::sqrt(1 - sine * sine) * (1 - kConeSlack), error};
}

}  // namespace

NormalRange normal_range(const std::optional<NormalCone>& cone) {
  if (!cone) return {};
  const double side = cone->sine + cone->error;
  return {{-side, -side, cone->cosine - cone->error}, {side, side, 1 + cone->error}};
}

double derivative_rounding(const PatchNet& net) {
  double largest = 0;
  for (const auto& coordinate : net.c)
    for (const double x : coordinate) largest = std::max(largest, std::abs(x));
  return 256 * 0x1p-24 * std::sqrt(3.0) * largest;
}

std::optional<TangentCones> tangent_cones(const NetMeasure& m, const CornerFrame& frame) {
  if (!frame.regular || !(m.u.min_dot > 0 && m.v.min_dot > 0)) return std::nullopt;
  TangentCones out{};
  out.sine_u = widened_sine(m.u.min_cosine2);
  out.sine_v = widened_sine(m.v.min_cosine2);
  out.cosine_between = std::abs(glm::dot(frame.tangent_u, frame.tangent_v));
  out.sine_between = frame.sine_between;
  // sin(beta' - (alpha_u + alpha_v)) with beta' = min(beta, pi - beta) <= 90 degrees and both alphas below 90.
  const double cosine_u = std::sqrt(std::max(0.0, m.u.min_cosine2 - kConeSlack)),
               cosine_v = std::sqrt(std::max(0.0, m.v.min_cosine2 - kConeSlack));
  const double sine_sum = out.sine_u * cosine_v + cosine_u * out.sine_v,
               cosine_sum = cosine_u * cosine_v - out.sine_u * out.sine_v;
  out.min_sine = out.sine_between * cosine_sum - out.cosine_between * sine_sum - kConeSlack;
  if (!(out.min_sine > kLeastSine)) return std::nullopt;
  out.min_length_u = m.u.min_dot * (1 - kConeSlack);
  out.min_length_v = m.v.min_dot * (1 - kConeSlack);
  out.max_length2_u = m.u.max_length2 * (1 + kConeSlack);
  out.max_length2_v = m.v.max_length2 * (1 + kConeSlack);
  return out;
}

double tpatch_sine(const TangentCones& c) {
  const double sum = c.sine_u * c.sine_u + 2 * c.sine_u * c.sine_v * c.cosine_between + c.sine_v * c.sine_v;
  return std::sqrt(sum) / c.sine_between * (1 + kConeSlack);
}

std::optional<NormalCone> tpatch_cone(const TangentCones& c, const DerivativeError& error) {
  return checked(tpatch_sine(c), normal_error(error.absolute, 3 * c.min_length_u / error.scale_u,
                                              3 * c.min_length_v / error.scale_v, c.min_sine));
}

std::optional<NormalCone> npatch_cone(const PatchNet& net, const NetMeasure& measure, const CornerFrame& frame,
                                      const std::optional<NormalCone>& tpatch, const DerivativeError& error) {
  if (!frame.regular) return tpatch;
  const NormalSpread spread = measure_normals(net, frame.axes[2]);
  if (!(spread.min_dot > 0)) return tpatch;
  // |dp/du x dp/dv| is at least min_dot, so both factors and the sine between them have least values.
  const double max_u = std::sqrt(measure.u.max_length2), max_v = std::sqrt(measure.v.max_length2);
  const double least_sine = spread.min_dot / (max_u * max_v);
  if (!(least_sine > kLeastSine)) return tpatch;
  const double length_u = spread.min_dot / max_v, length_v = spread.min_dot / max_u;
  const auto cone = checked(widened_sine(spread.min_cosine2), normal_error(error.absolute, 3 * length_u / error.scale_u,
                                                                           3 * length_v / error.scale_v, least_sine));
  if (!cone || !tpatch) return cone ? cone : tpatch;
  return NormalCone{std::min(cone->sine, tpatch->sine), std::max(cone->cosine, tpatch->cosine),
                    std::min(cone->error, tpatch->error)};
}

std::optional<NormalCone> edge_cone(const std::array<DVec3, 3>& along, const std::array<DVec3, 4>& across,
                                    bool across_first, const DVec3& z, double absolute_error, double scale) {
  double min_dot = 1e300, min_cosine2 = 1, max_along2 = 0, max_across2 = 0;
  for (const DVec3& a : along) max_along2 = std::max(max_along2, glm::dot(a, a));
  for (const DVec3& b : across) max_across2 = std::max(max_across2, glm::dot(b, b));
  for (const DVec3& a : along)
    for (const DVec3& b : across) {
      const DVec3 n = across_first ? glm::cross(b, a) : glm::cross(a, b);
      const double dot = glm::dot(n, z), length2 = glm::dot(n, n);
      min_dot = std::min(min_dot, dot);
      if (length2 > 0) min_cosine2 = std::min(min_cosine2, dot * dot / length2);
    }
  if (!(min_dot > 0)) return std::nullopt;
  const double max_along = std::sqrt(max_along2), max_across = std::sqrt(max_across2),
               least_sine = min_dot / (max_along * max_across);
  if (!(least_sine > kLeastSine)) return std::nullopt;
  return checked(widened_sine(min_cosine2),
                 normal_error(absolute_error, 3 * min_dot / max_across / scale, 3 * min_dot / max_along, least_sine));
}

}  // namespace tessera::frontend

#include "reference/bezier_extent.h"

#include <algorithm>
#include <cmath>

namespace tessera::reference {
namespace {

constexpr double kRounding = 0x1p-46;  // as SampleRegion's
constexpr double kParameter =
    0x1p-20;  // fraction of the net's range: the neighbour that owns an edge has rounded its parameters

using Weights = std::array<std::array<double, 4>, 4>;

// Weights of a cubic's control points in the control points of its part from a to b.
Weights part_weights(double a, double b) {
  Weights out;
  for (std::size_t k = 0; k < 4; ++k) {
    const std::array<double, 3> t = {k > 0 ? b : a, k > 1 ? b : a, k > 2 ? b : a};
    std::array<double, 4> w = {1, 0, 0, 0};
    for (std::size_t n = 0; n < 3; ++n)
      for (std::size_t i = n + 2; i-- > 0;) w[i] = w[i] * (1 - t[n]) + (i > 0 ? w[i - 1] * t[n] : 0.0);
    out[k] = w;
  }
  return out;
}

}  // namespace

BezierExtent::BezierExtent(const SampleRegion& region, const std::array<Points, 2>& points,
                           const std::array<DMat4, 2>& to_space, double reach) {
  for (std::size_t key = 0; key < 2; ++key) {
    const SampleRegion::Axes axes = region.axes(to_space[key]);
    for (std::size_t a = 0; a < SampleRegion::kAxes; ++a) {
      Net& net = nets_[key][a];
      const DVec4& axis = axes[a];
      double largest = 0;
      for (std::size_t k = 0; k < 16; ++k) {
        const DVec4 terms = axis * DVec4(points[key][k], 1.0);
        net.value[k] = terms.x + terms.y + terms.z + terms.w;
        largest = std::max({largest, std::abs(terms.x), std::abs(terms.y), std::abs(terms.z), std::abs(terms.w)});
      }
      const auto [low, high] = std::minmax_element(net.value.begin(), net.value.end());
      net.slack = largest * kRounding + (*high - *low) * kParameter + reach * glm::length(DVec3(axis));
    }
  }
}

SampleRegion::Extent BezierExtent::over(const scene::ParameterRange& range) const {
  const Weights u = part_weights(static_cast<double>(range.u0), static_cast<double>(range.u1)),
                v = part_weights(static_cast<double>(range.v0), static_cast<double>(range.v1));
  SampleRegion::Extent extent;
  for (const auto& nets : nets_)
    for (std::size_t a = 0; a < SampleRegion::kAxes; ++a) {
      const std::array<double, 16>& c = nets[a].value;
      for (std::size_t j = 0; j < 4; ++j) {
        std::array<double, 4> row;
        for (std::size_t i = 0; i < 4; ++i)
          row[i] = v[j][0] * c[i] + v[j][1] * c[4 + i] + v[j][2] * c[8 + i] + v[j][3] * c[12 + i];
        for (std::size_t i = 0; i < 4; ++i) {
          const double at = u[i][0] * row[0] + u[i][1] * row[1] + u[i][2] * row[2] + u[i][3] * row[3];
          extent.add(a, at - nets[a].slack, at + nets[a].slack);
        }
      }
    }
  return extent;
}

}  // namespace tessera::reference

#pragma once

#include "tests/support/tests.h"
#include "tests/tilecore/visibility/method_mesh.h"

namespace tessera::tilecore {

// The oracle of the hard cases: corners, inside test and depth by their definitions in double precision, without a word
// of the kernels.

struct ExactCorner {
  double x, y, z;  // relative to the sample; depth
  double error;    // pixels by which single precision may be off: 16 u of the summands
};

inline ExactCorner exact_corner(const MethodMesh& m, std::size_t v, std::size_t s) {
  const MicroMesh& mesh = m.mesh;
  const bool motion = m.effects.motion, lens = m.effects.lens;
  const double t = motion ? static_cast<double>(m.samples.t(s)) : 0.0, z0 = static_cast<double>(mesh.z0[v]),
               z1 = motion ? static_cast<double>(mesh.z1[v]) : z0;
  const double z = (1 - t) * z0 + t * z1, rate = m.settings.orthographic ? t : t * z1 / z,
               focus = static_cast<double>(m.settings.inverse_focus);
  const double factor = m.settings.orthographic ? 1 - z * focus : 1 / z - focus, largest = std::max(z0, z1);
  const double factor_size =
      m.settings.orthographic ? 1 + largest * focus : largest / (z * z) + focus;  // size of the terms of the difference
  double error = 0;
  const auto at = [&](float open, float close, float sample, double point) {
    const double x0 = static_cast<double>(open), way = motion ? static_cast<double>(close) - x0 : 0.0;
    error = std::max(error, std::abs(x0 - static_cast<double>(sample)) + std::abs(way) * (largest / z) +
                                std::abs(point) * factor_size);
    return x0 + rate * way - static_cast<double>(sample) - point * factor;
  };
  const double x = at(mesh.x0[v], mesh.x1[v], m.samples.x[s], lens ? static_cast<double>(m.samples.lens_u[s]) : 0.0);
  const double y = at(mesh.y0[v], mesh.y1[v], m.samples.y[s], lens ? static_cast<double>(m.samples.lens_v[s]) : 0.0);
  return {x, y, z, 0x1p-20 * error};
}

// Place of a sample with respect to a triangle.
struct ExactHit {
  enum Answer { kOutside, kInside, kTooCloseToSay } answer = kOutside;
  double z = 0, z_error = 0;
  bool positive = false;
};

inline ExactHit exact_hit(const MethodMesh& m, const std::array<ExactCorner, 3>& p) {
  std::array<double, 3> e;  // edge functions, opposite to each corner
  double sharpest = 1e300;
  int above = 0, below = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const ExactCorner &a = p[(k + 1) % 3], &b = p[(k + 2) % 3];
    e[k] = a.x * b.y - a.y * b.x;
    // Rounding of the corners, and of the two products.
    const double error = (a.error * (std::abs(b.x) + std::abs(b.y)) + b.error * (std::abs(a.x) + std::abs(a.y))) +
                         0x1p-23 * (std::abs(a.x * b.y) + std::abs(a.y * b.x)) + a.error * b.error;
    above += e[k] > error ? 1 : 0;
    below += e[k] < -error ? 1 : 0;
    sharpest = std::min(sharpest, std::abs(e[k]) / std::max(error, 1e-300));
  }
  ExactHit hit;
  if (above > 0 && below > 0) return hit;
  hit.answer = above == 3 || below == 3 ? ExactHit::kInside : ExactHit::kTooCloseToSay;
  hit.positive = above == 3;
  const double area = e[0] + e[1] + e[2];
  if (m.settings.orthographic)
    hit.z = (e[0] * p[0].z + e[1] * p[1].z + e[2] * p[2].z) / area;
  else
    hit.z = area / (e[0] / p[0].z + e[1] / p[1].z + e[2] / p[2].z);
  const double near = std::min({p[0].z, p[1].z, p[2].z}), far = std::max({p[0].z, p[1].z, p[2].z});
  hit.z_error = (far - near) * std::min(1.0, 4 * far / near / sharpest) + 0x1p-20 * far;
  return hit;
}

struct Comparison {
  int hits = 0;       // that both find
  int wrong = 0;      // found or missed against the oracle, or at another depth
  int too_close = 0;  // pairs of a sample and a triangle that single precision may decide either way
};

// Hits against the oracle, every sample against every triangle; depth range and facing included.
inline Comparison compare_with_exact(const MethodMesh& m, const std::set<HitSet::Key>& found) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, double> depth;
  for (const HitSet::Key& key : found)
    depth[{std::get<0>(key), std::get<1>(key)}] = static_cast<double>(std::get<2>(key));
  const HitLimits& limits = m.settings.limits;
  const double near = static_cast<double>(limits.near), far = static_cast<double>(limits.far);
  Comparison result;
  m.for_each_cell([&](std::size_t cell) {
    for (std::uint32_t s = 0; s < m.samples.count; ++s) {
      std::array<ExactCorner, 4> c;
      for (std::size_t k = 0; k < 4; ++k) c[k] = exact_corner(m, static_cast<std::size_t>(m.mesh.corner[k][cell]), s);
      const bool two = m.mesh.corner[2][cell] != m.mesh.corner[3][cell];
      for (std::uint32_t half = 0; half < (two ? 2u : 1u); ++half) {
        ExactHit exact = exact_hit(m, {c[0], c[1 + half], c[2 + half]});
        if (exact.answer == ExactHit::kInside && !(exact.positive ? limits.keep_positive : limits.keep_negative))
          exact.answer = ExactHit::kOutside;
        if (exact.answer == ExactHit::kInside && (exact.z < near - exact.z_error || exact.z > far + exact.z_error))
          exact.answer = ExactHit::kOutside;
        if (exact.answer == ExactHit::kInside && (exact.z < near + exact.z_error || exact.z > far - exact.z_error))
          exact.answer = ExactHit::kTooCloseToSay;
        const auto hit = depth.find({s, m.mesh.triangle[cell] + half});
        if (exact.answer == ExactHit::kTooCloseToSay) {
          ++result.too_close;
        } else if ((exact.answer == ExactHit::kInside) != (hit != depth.end())) {
          ++result.wrong;
        } else if (hit != depth.end()) {
          ++result.hits;
          result.wrong += std::abs(hit->second - exact.z) > exact.z_error ? 1 : 0;
        }
      }
    }
  });
  return result;
}

}  // namespace tessera::tilecore

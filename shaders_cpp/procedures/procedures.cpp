#include "shaders_cpp/procedures/procedures.h"

#include <algorithm>
#include <cmath>

#include "shaders_cpp/procedures/declarations.h"

namespace tessera::shaders {
namespace {

template <class Real>
PlaneNoise<Real> noise_at(Real x, Real y) {
  const Real column = std::floor(x), row = std::floor(y);
  // Far outside, where the lattice has no numbers, noise is flat.
  if (!(std::abs(column) < Real(1e9) && std::abs(row) < Real(1e9))) return {Real(0), Real(0), Real(0)};
  const auto i = static_cast<std::int32_t>(column), j = static_cast<std::int32_t>(row);
  Real gx[4], gy[4];
  for (int k = 0; k < 4; ++k) {
    const LatticeGradient g = lattice_gradient(i + (k & 1), j + (k >> 1));
    gx[k] = static_cast<Real>(g.x);
    gy[k] = static_cast<Real>(g.y);
  }
  return noise_in_cell<Real>(x - column, y - row, gx, gy);
}

template <class Real>
PlaneNoise<Real> image_at(const float* values, int width, int height, Real u, Real v) {
  const Real su = static_cast<Real>(width - 1), sv = static_cast<Real>(height - 1);
  const Real x = std::min(std::max(u * su, Real(0)), su), y = std::min(std::max(v * sv, Real(0)), sv);
  const Real column = std::min(std::floor(x), su - Real(1)), row = std::min(std::floor(y), sv - Real(1)),
             fx = x - column, fy = y - row;
  // A NaN coordinate stays NaN, and must not access memory.
  const auto index = [](Real a) { return a == a ? static_cast<std::ptrdiff_t>(a) : 0; };
  const float* at = values + index(row) * width + index(column);
  const auto c00 = static_cast<Real>(at[0]), c10 = static_cast<Real>(at[1]), c01 = static_cast<Real>(at[width]),
             c11 = static_cast<Real>(at[width + 1]);
  const Real gx = Real(1) - fx, gy = Real(1) - fy;
  // Weights are exactly 0 and 1 at the grid's points, so equal values there stay equal.
  return {(c00 * gx + c10 * fx) * gy + (c01 * gx + c11 * fx) * fy, ((c10 - c00) * gy + (c11 - c01) * fy) * su,
          ((c01 - c00) * gx + (c11 - c10) * fx) * sv};
}

}  // namespace

void real_sincos_turns(double turns, double& sine, double& cosine) {
  const double angle = (turns - std::floor(turns)) * 6.283185307179586;
  sine = std::sin(angle);
  cosine = std::cos(angle);
}

PlaneNoise<float> plane_noise_with_slopes(float x, float y) { return noise_at(x, y); }
PlaneNoise<double> plane_noise_with_slopes(double x, double y) { return noise_at(x, y); }
PlaneNoise<float> image_value_with_slopes(const float* values, int width, int height, float u, float v) {
  return image_at(values, width, height, u, v);
}
PlaneNoise<double> image_value_with_slopes(const float* values, int width, int height, double u, double v) {
  return image_at(values, width, height, u, v);
}

float space_noise(float x, float y, float z) {
  const float fx = std::floor(x), fy = std::floor(y), fz = std::floor(z);
  if (!(std::abs(fx) < 1e9f && std::abs(fy) < 1e9f && std::abs(fz) < 1e9f)) return 0.0f;
  const auto i = static_cast<std::int32_t>(fx), j = static_cast<std::int32_t>(fy), k = static_cast<std::int32_t>(fz);
  const float tx = smooth_step(x - fx), ty = smooth_step(y - fy), tz = smooth_step(z - fz);
  float corner[8];
  for (int c = 0; c < 8; ++c) corner[c] = lattice_value(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2));
  return mix_corners(corner, tx, ty, tz);
}

namespace {

template <class Stage>
StageDeclaration declare_shape() {
  return {Stage::kName, Stage::kMeaning, Stage::kParameters, Stage::kPatchesU, Stage::kPatchesV,
          requires {Stage::kKinks;
}
};  // namespace
}  // namespace tessera::shaders
template <class Stage>
StageDeclaration declare() {
  return {Stage::kName, Stage::kMeaning, Stage::kParameters};
}

}  // namespace

std::span<const StageDeclaration> shape_declarations() {
#define TESSERA_DECLARE(name) declare_shape<name>(),
  static const StageDeclaration kStages[] = {TESSERA_SHAPES(TESSERA_DECLARE)};
#undef TESSERA_DECLARE
  return kStages;
}

std::span<const StageDeclaration> texture_declarations() {
#define TESSERA_DECLARE(name) declare<name>(),
  static const StageDeclaration kStages[] = {TESSERA_TEXTURES(TESSERA_DECLARE)};
  return kStages;
}

std::span<const StageDeclaration> shading_declarations() {
  static const StageDeclaration kStages[] = {TESSERA_SHADING(TESSERA_DECLARE)};
#undef TESSERA_DECLARE
  return kStages;
}

}  // namespace tessera::shaders

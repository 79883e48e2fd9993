// Makes shaders_cpp/studio.cpp: tessera_environment_lobes | clang-format > shaders_cpp/studio.cpp. It convolves the parts of
// the built-in environment with GGX lobes by integration and fits the forms of shaders_cpp/studio.h to them by least squares.
#include "shaders_cpp/studio.h"

#include <cstddef>
#include <cstdio>
#include <numbers>
#include <vector>

namespace tessera::shaders {
namespace {

constexpr std::size_t kAngles = 61, kRings = 2048, kSlices = 64;
constexpr double kLeastSharpness =
    2.5;  // below this a parabola fits wider lobes as well; rows that share it mix exactly

double cosine(std::size_t angle) { return std::cos(std::numbers::pi * static_cast<double>(angle) / (kAngles - 1)); }

// Directions of the lobe around the mirror direction: cosines and weights.
struct Lobe {
  std::vector<double> cosines, weights;

  // `diffuse`: the lobe of a Lambert surface instead.
  Lobe(double roughness, bool diffuse) {
    const double alpha = std::max(roughness * roughness, 1e-3);
    double sum = 0;
    for (std::size_t i = 0; i < kRings; ++i) {
      // Half vectors are distributed as the microfacets' projected area.
      const double u = (static_cast<double>(i) + 0.5) / kRings;
      const double half2 = (1 - u) / (1 + (alpha * alpha - 1) * u), to_light = 2 * half2 - 1;
      cosines.push_back(to_light);
      // Shadowing (Smith, height-correlated) of the light, over the density of its direction; a surface seen head-on has no masking.
      const double l = std::max(to_light, 0.0);
      weights.push_back(2 * l / (l + std::sqrt(l * l * (1 - alpha * alpha) + alpha * alpha)));
      if (diffuse) cosines.back() = std::sqrt(1 - u), weights.back() = 1;
      sum += weights.back();
    }
    for (double& w : weights) w /= sum;
  }

  // Mean of a function of the cosine to an axis, for a lobe at cosine c to it.
  template <class Function>
  double convolve(double c, const Function& function) const {
    double sum = 0;
    const double s = std::sqrt(1 - c * c);
    for (std::size_t i = 0; i < kRings; ++i) {
      if (weights[i] == 0) continue;
      double ring = 0;
      const double along = c * cosines[i], across = s * std::sqrt(std::max(1 - cosines[i] * cosines[i], 0.0));
      for (std::size_t k = 0; k < kSlices; ++k)
        ring += function(along + across * std::cos(std::numbers::pi * (static_cast<double>(k) + 0.5) / kSlices));
      sum += weights[i] * ring / kSlices;
    }
    return sum;
  }
};

using Columns = std::vector<std::array<double, kAngles>>;
using Row = std::array<double, kAngles>;

// Weights of the columns that come closest to `target`, with a weight for each angle; `error` returns the remaining squared error.
std::vector<double> fit(const Columns& columns, const Row& target, const Row& weight, double& error) {
  const std::size_t n = columns.size();
  std::vector<std::vector<double>> a(n, std::vector<double>(n + 1, 0.0));
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = 0; k < kAngles; ++k) {
      for (std::size_t j = 0; j < n; ++j) a[i][j] += weight[k] * columns[i][k] * columns[j][k];
      a[i][n] += weight[k] * columns[i][k] * target[k];
    }
  for (std::size_t i = 0; i < n; ++i) {  // Gauss; the matrix is positive definite
    a[i][i] += 1e-12;
    for (std::size_t j = i + 1; j < n; ++j)
      for (std::size_t k = n + 1; k-- > i;) a[j][k] -= a[j][i] / a[i][i] * a[i][k];
  }
  std::vector<double> x(n);
  for (std::size_t i = n; i-- > 0;) {
    double rest = a[i][n];
    for (std::size_t j = i + 1; j < n; ++j) rest -= a[i][j] * x[j];
    x[i] = rest / a[i][i];
  }
  error = 0;
  for (std::size_t k = 0; k < kAngles; ++k) {
    double e = -target[k];
    for (std::size_t i = 0; i < n; ++i) e += x[i] * columns[i][k];
    error += weight[k] * e * e;
  }
  return x;
}

template <class Function>
Row tabulate(const Function& function) {
  Row row;
  for (std::size_t k = 0; k < kAngles; ++k) row[k] = function(cosine(k));
  return row;
}

LobeFit fit_box(const Lobe& lobe, double sharpness, bool mirror, bool broad) {
  if (mirror) return {static_cast<float>(0.5 * sharpness), 1, 0, 0, 0, 0};
  const Row target =
      tabulate([&](double c) { return lobe.convolve(c, [&](double d) { return std::exp(sharpness * (d - 1)); }); });
  // Weighted by the solid angle, with some weight for the very middle.
  const Row weight = tabulate([](double c) { return std::sqrt(1 - c * c) + 0.05; });
  LobeFit best{};
  double least = 0;
  const int steps = broad ? 0 : 200;
  for (int i = 0; i <= steps; ++i) {
    const double b = kLeastSharpness + (0.5 * sharpness - kLeastSharpness) * i / std::max(steps, 1);
    double error;
    const std::vector<double> x =
        fit({tabulate([&](double c) { return std::exp(2 * b * (c - 1)); }),
             tabulate([&](double c) { return std::exp(b * (c - 1)); }), tabulate([](double) { return 1.0; }),
             tabulate([](double c) { return c; }), tabulate([](double c) { return c * c; })},
            target, weight, error);
    if (i > 0 && error >= least) continue;
    least = error;
    best = {static_cast<float>(b),    static_cast<float>(x[0]), static_cast<float>(x[1]),
            static_cast<float>(x[2]), static_cast<float>(x[3]), static_cast<float>(x[4])};
  }
  return best;
}

EnvironmentLobes fit_lobes(double roughness, bool diffuse) {
  const Lobe lobe(roughness, diffuse);
  EnvironmentLobes out{};
  if (roughness == 0) {
    out.horizon[0] = 1;
  } else {
    Columns columns;
    for (const float width : kHorizonWidths)
      columns.push_back(tabulate([&](double y) { return ceiling_share(y, static_cast<double>(width)) - 0.5; }));
    columns.push_back(tabulate([](double y) { return y; }));
    const Row target = tabulate([&](double y) {
      return lobe.convolve(y, [](double d) { return ceiling_share(d, static_cast<double>(kHorizon)); }) - 0.5;
    });
    double error;
    const std::vector<double> x = fit(columns, target, tabulate([](double) { return 1.0; }), error);
    for (std::size_t k = 0; k < 4; ++k) out.horizon[k] = static_cast<float>(x[k]);
    out.slope = static_cast<float>(x[4]);
  }
  for (std::size_t k = 0; k < 3; ++k)
    out.box[k] = fit_box(lobe, static_cast<double>(kSoftBoxes[k].sharpness), roughness == 0, roughness > 0.6);
  return out;
}

}  // namespace
}  // namespace tessera::shaders

int main() {
  using namespace tessera::shaders;
  std::printf(
      "// Made by bench/shaders_cpp/environment_lobes.cpp.\n#include \"shaders_cpp/studio.h\"\n\nnamespace "
      "tessera::shaders {\n\nconst std::array<EnvironmentLobes, 18> kEnvironmentLobes = {{\n");
  for (int i = 0; i <= 17; ++i) {
    const EnvironmentLobes lobes = fit_lobes(std::min(i, 16) / 16.0, i == 17);
    const auto number = [](float v) { std::printf("%.5ff", static_cast<double>(v) + 0.0); };
    std::printf("    {{");
    for (std::size_t k = 0; k < 4; ++k) number(lobes.horizon[k]), std::printf(k < 3 ? ", " : "}, ");
    number(lobes.slope);
    std::printf(",\n     {{");
    for (std::size_t k = 0; k < 3; ++k) {
      const LobeFit& box = lobes.box[k];
      std::printf("{");
      const std::array<float, 6> all = {box.sharpness, box.narrow, box.broad, box.constant, box.linear, box.quadratic};
      for (std::size_t n = 0; n < 6; ++n) number(all[n]), std::printf(n < 5 ? ", " : "}");
      std::printf(k < 2 ? ",\n       " : "}}},\n");
    }
  }
  std::printf("}};\n\n}  // namespace tessera::shaders\n");
  return 0;
}

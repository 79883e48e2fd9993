#include "tilecore/visibility/method_choice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace tessera::tilecore {
namespace {

// [measured] Rays that 4x4 pixels cast for a sample that is over the mesh, and what a triangle test is worth in box
// tests: between what the method table's toys and turning, approaching and crossing meshes take.
constexpr double kRaysPerSample = 1.6, kTriangle = 2;

// Whole numbers at or below; std::floor() is a call where the target has no instruction for it.
double floor_of(float x) {
  if (!(std::abs(x) < 1e9f)) return std::floor(static_cast<double>(x));
  const auto whole = static_cast<std::int32_t>(x);
  return static_cast<double>(static_cast<float>(whole) > x ? whole - 1 : whole);
}

struct Box {
  float x0 = std::numeric_limits<float>::infinity(), y0 = x0, x1 = -x0, y1 = -x0;

  void add(float x, float y) {
    x0 = std::min(x0, x), x1 = std::max(x1, x);
    y0 = std::min(y0, y), y1 = std::max(y1, y);
  }
  void add(const Box& o) {
    x0 = std::min(x0, o.x0), x1 = std::max(x1, o.x1);
    y0 = std::min(y0, o.y0), y1 = std::max(y1, o.y1);
  }
  // Of the whole pixels that it touches.
  double pixels() const {
    return x0 > x1 ? 0.0 : (floor_of(x1) - floor_of(x0) + 1) * (floor_of(y1) - floor_of(y0) + 1);
  }
  double area() const {
    return x0 > x1 ? 0.0
                   : (static_cast<double>(x1) - static_cast<double>(x0)) *
                         (static_cast<double>(y1) - static_cast<double>(y0));
  }
};

double area(float x_low, float x_high, float y_low, float y_high) {
  return x_low > x_high ? 0.0
                        : (static_cast<double>(x_high) - static_cast<double>(x_low)) *
                              (static_cast<double>(y_high) - static_cast<double>(y_low));
}

}  // namespace

TestCosts test_costs(const MicroMesh& mesh, RayEffects effects) {
  const bool moving = effects.motion;
  TestCosts costs;
  std::array<Box, 2> whole;
  double cells = 0, on_screen = 0;
  for (std::size_t l = 0; l < mesh.leaves.size(); ++l) {
    const MicroMesh::Leaf& leaf = mesh.leaves[l];
    double in_leaf = 0;
    for (std::size_t k = 0; k < leaf.cell_count; ++k) {
      if ((leaf.cells >> k & 1) == 0) continue;
      const std::size_t cell = l * kLeafCells + k;
      in_leaf += 1;
      costs.by_class += 2 * kTriangle *
                        area(mesh.box_x_low[cell], mesh.box_x_high[cell], mesh.box_y_low[cell], mesh.box_y_high[cell]);
      Box open, close;
      for (const auto& corner : mesh.corner) {
        const auto v = static_cast<std::size_t>(corner[cell]);
        open.add(mesh.x0[v], mesh.y0[v]);
        if (moving) close.add(mesh.x1[v], mesh.y1[v]);
      }
      if (!moving) close = open;
      whole[0].add(open), whole[1].add(close);
      on_screen += 0.5 * (open.area() + close.area());
      open.add(close);
      costs.brute += 2 * kTriangle * open.pixels();
    }
    costs.by_class += in_leaf * area(leaf.x_low, leaf.x_high, leaf.y_low, leaf.y_high);
    cells += in_leaf;
  }
  const double levels = std::log2(std::max(cells, 1.0));
  costs.by_ray =
      kRaysPerSample * 0.5 * (whole[0].area() + whole[1].area()) * (1 + 2 * levels) + 2 * kTriangle * on_screen;
  return costs;
}

VisibilityMethodSettings settled(VisibilityMethodSettings method, const MicroMesh& mesh, RayEffects effects) {
  return method.chooses() ? settled(method, test_costs(mesh, effects), effects) : method;
}

VisibilityMethodSettings settled(VisibilityMethodSettings method, const TestCosts& costs, RayEffects effects) {
  if (!method.chooses()) return method;
  method.traversal = Traversal::kClass;
  if (costs.by_ray < costs.by_class) method.traversal = Traversal::kRay;
  if (!effects.lens && costs.brute < std::min(costs.by_class, costs.by_ray)) method.method = VisibilityMethod::kBrute;
  return method;
}

}  // namespace tessera::tilecore

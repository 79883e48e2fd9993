#include "tilecore/visibility/method_choice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace tessera::tilecore {
namespace {

// [measured] Number of rays that 4x4 pixels cast for each sample over the mesh, and the cost of a triangle test in box
// tests: between the values for the method table's toys and for turning, approaching and crossing meshes.
constexpr double kRaysPerSample = 1.6, kTriangle = 2;
// [measured] Cost of building a box in box tests, and the number of nodes that the frustum of 4x4 pixels meets for each
// cell that crosses them: between meshes that turn in place and meshes that fly across many tiles.
constexpr double kBuilt = 2, kFrustumTests = 2;

// Rounds down; std::floor() is a call if the target has no instruction for it.
double whole_below(float x) {
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
  // Area of all pixels that the box touches.
  double pixels() const {
    return x0 > x1 ? 0.0 : (whole_below(x1) - whole_below(x0) + 1) * (whole_below(y1) - whole_below(y0) + 1);
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

// Rectangles of 4x4 pixels that a box touches on its straight way between two places.
double swept_bundles(const Box& open, const Box& close) {
  constexpr double kSide = 4;
  const auto mean = [](float a, float b, float c, float d) {
    return 0.5 * (static_cast<double>(b) - static_cast<double>(a) + static_cast<double>(d) - static_cast<double>(c));
  };
  const auto way = [](float a, float b, float c, float d) {
    return 0.5 *
           std::abs(static_cast<double>(c) + static_cast<double>(d) - static_cast<double>(a) - static_cast<double>(b));
  };
  const double w = mean(open.x0, open.x1, close.x0, close.x1) + kSide,
               h = mean(open.y0, open.y1, close.y0, close.y1) + kSide;
  return (w * h + way(open.x0, open.x1, close.x0, close.x1) * h + way(open.y0, open.y1, close.y0, close.y1) * w) /
         (kSide * kSide);
}

}  // namespace

TestCosts test_costs(const MicroMesh& mesh, RayEffects effects) {
  const bool moving = effects.motion;
  TestCosts costs;
  std::array<Box, 2> whole;
  double on_screen = 0;
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
      costs.bundles += swept_bundles(open, close);
      if (effects.lens) continue;
      open.add(close);
      costs.brute += 2 * kTriangle * open.pixels();
    }
    costs.by_class += in_leaf * area(leaf.x_low, leaf.x_high, leaf.y_low, leaf.y_high);
    costs.cells += in_leaf;
    if (effects.lens && in_leaf > 0)
      costs.lens_factor = std::max(costs.lens_factor, std::abs(static_cast<double>(leaf.lens_factor)));
  }
  costs.leaves = static_cast<double>(mesh.leaves.size());
  const auto extent = [&](float Box::*low, float Box::*high) {
    return costs.cells == 0 ? 0.0
                            : 0.5 * (static_cast<double>(whole[0].*high) - static_cast<double>(whole[0].*low) +
                                     static_cast<double>(whole[1].*high) - static_cast<double>(whole[1].*low));
  };
  const auto way = [&](float Box::*low, float Box::*high) {
    return costs.cells == 0 ? 0.0
                            : 0.5 * std::abs(static_cast<double>(whole[1].*high) + static_cast<double>(whole[1].*low) -
                                             static_cast<double>(whole[0].*high) - static_cast<double>(whole[0].*low));
  };
  costs.width = extent(&Box::x0, &Box::x1), costs.height = extent(&Box::y0, &Box::y1);
  costs.way_x = way(&Box::x0, &Box::x1), costs.way_y = way(&Box::y0, &Box::y1);
  const double levels = std::log2(std::max(costs.cells, 1.0));
  costs.ray_visits = kRaysPerSample * (1 + 2 * levels);
  costs.by_ray = costs.ray_visits * 0.5 * (whole[0].area() + whole[1].area()) + 2 * kTriangle * on_screen;
  return costs;
}

// Number of tiles: the area that a box sweeps, widened by a tile, over the area of a tile.
double TestCosts::tiles(double lens_scale) const {
  const double reach = 2 * lens_factor * lens_scale, w = width + reach + kChoiceTile, h = height + reach + kChoiceTile;
  return (w * h + way_x * h + way_y * w) / (kChoiceTile * kChoiceTile);
}

VisibilityMethodSettings settled(VisibilityMethodSettings method, const TestCosts& costs, RayEffects effects,
                                 const ChoiceScale& scale) {
  if (!method.chooses()) return method;
  const double tiles = costs.tiles(scale.lens_scale), samples = scale.samples_per_pixel;
  const double by_class = samples * costs.by_class + tiles * kBuilt * (costs.cells + costs.leaves),
               reach = 2 * costs.lens_factor * scale.lens_scale,
               out_of_focus = (costs.width + reach) * (costs.height + reach) - costs.width * costs.height,
               by_ray = samples * (costs.by_ray + costs.ray_visits * out_of_focus) + tiles * kBuilt * 2 * costs.cells +
                        kFrustumTests * costs.bundles,
               brute = samples * costs.brute + tiles * kBuilt * costs.cells;
  method.traversal = Traversal::kClass;
  if (by_ray < by_class) method.traversal = Traversal::kRay;
  if (!effects.lens && brute < std::min(by_class, by_ray)) method.method = VisibilityMethod::kBrute;
  return method;
}

}  // namespace tessera::tilecore

#include "frontend/split_cost.h"

#include <algorithm>
#include <cmath>

namespace tessera::frontend {
namespace {

constexpr std::size_t kWay = 3, kGrowX = 4, kGrowY = 5;

// Where a corner is on screen; behind the camera as far as it goes.
DVec2 on_screen(const DVec4& corner) {
  const double w = std::max(corner.w, 1e-9);
  return {corner.x / w, corner.y / w};
}

// Part of [low, high] that lies in [0, size].
double part_in_frame(float low, float high, int size) {
  const float from = std::max(low, 0.0f), to = std::min(high, static_cast<float>(size));
  return to > from ? static_cast<double>(to - from) : 0.0;
}

}  // namespace

double ScreenShape::width() const {
  double sum = 0;
  for (const DVec2& side : sides) sum += std::abs(side.x);
  return sum;
}

double ScreenShape::height() const {
  double sum = 0;
  for (const DVec2& side : sides) sum += std::abs(side.y);
  return sum;
}

double ScreenShape::area() const {
  double sum = 0;
  for (std::size_t i = 0; i < kSides; ++i)
    for (std::size_t j = i + 1; j < kSides; ++j) sum += std::abs(sides[i].x * sides[j].y - sides[i].y * sides[j].x);
  return sum;
}

ScreenShape ScreenShape::half(std::size_t side) const {
  ScreenShape shape = *this;
  shape.sides[side] *= 0.5;
  return shape;
}

ScreenShape screen_shape(const MovingCorners& corners, const ScreenBounds& bounds, int frame_width, int frame_height) {
  ScreenShape shape;
  const double width = part_in_frame(bounds.x0, bounds.x1, frame_width),
               height = part_in_frame(bounds.y0, bounds.y1, frame_height);
  const auto finite = [](const DVec4& c) { return std::isfinite(c.x) && std::isfinite(c.y) && std::isfinite(c.w); };
  if (!std::all_of(corners.begin(), corners.end(), finite) || !std::isfinite(bounds.grow)) {
    shape.sides[kGrowX] = {width, 0};
    shape.sides[kGrowY] = {0, height};
    return shape;
  }
  // A side of the box is the mean of its eight edges, at both keys; bit 8 of a corner is the key.
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const DVec2 share = on_screen(corners[k]) / 8.0;
    for (std::size_t axis = 0; axis <= kWay; ++axis) shape.sides[axis] += (k >> axis & 1) != 0 ? share : -share;
  }
  shape.sides[kGrowX] = {2 * static_cast<double>(bounds.grow), 0};
  shape.sides[kGrowY] = {0, 2 * static_cast<double>(bounds.grow)};
  const double all_x = shape.width(), all_y = shape.height();
  const DVec2 scale(all_x > 0 ? width / all_x : 0, all_y > 0 ? height / all_y : 0);
  for (DVec2& side : shape.sides) side *= scale;
  return shape;
}

double SplitCost::expected_bins(const ScreenShape& shape) const {
  const double w = shape.width() / prices_.bin_width, h = shape.height() / prices_.bin_height,
               area = prices_.rectangles ? w * h : shape.area() / (prices_.bin_width * prices_.bin_height);
  return area + w + h + 1;
}

CostEstimate SplitCost::cost(const ScreenShape& shape, double cells, bool moving) const {
  CostEstimate estimate;
  estimate.entries = expected_bins(shape);
  // Written once, read once.
  const double entry_bytes = prices_.entry_bytes + (moving ? prices_.entry_time_bytes : 0);
  estimate.list_bytes = 2 * (estimate.entries * entry_bytes + prices_.record_bytes);
  estimate.boxes = estimate.entries * cells * prices_.boxes_per_cell;
  estimate.cycles =
      estimate.list_bytes * prices_.byte + estimate.entries * prices_.entry + estimate.boxes * prices_.box;
  return estimate;
}

double SplitCost::gain(const ScreenShape& shape, double cells, bool moving, std::size_t side,
                       double bound_bytes) const {
  return cost(shape, cells, moving).cycles - 2 * cost(shape.half(side), cells / 2, moving).cycles -
         2 * (prices_.bound + bound_bytes * prices_.byte);
}

}  // namespace tessera::frontend

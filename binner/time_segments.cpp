#include "binner/time_segments.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "binner/coverage.h"

namespace tessera::binner {
namespace {

// Largest sign * X (or Y) over all pairs of corners. X <= s for all of them exactly when the largest xh - s w at key 0
// and the largest at key 1, weighted by time, are not above zero together; so raise s to the pair that violates it most
// until none does (Dinkelbach 1967). s grows with every step, and there are finitely many pairs.
double farthest(const frontend::MovingCorners& corners, int axis, double t, double sign) {
  double s = -std::numeric_limits<double>::infinity();
  std::size_t i = 0, j = 0;
  for (;;) {
    const DVec4 p = corners[i] * (1 - t) + corners[8 + j] * t;
    const double reached = sign * p[axis] / p.w;
    if (!(reached > s)) return s;
    s = reached;
    double best_i = -std::numeric_limits<double>::infinity(), best_j = best_i;
    for (std::size_t k = 0; k < 8; ++k) {
      const double at_open = sign * corners[k][axis] - s * corners[k].w,
                   at_close = sign * corners[8 + k][axis] - s * corners[8 + k].w;
      if (at_open > best_i) best_i = at_open, i = k;
      if (at_close > best_j) best_j = at_close, j = k;
    }
  }
}

// Bound on the error of farthest(): its differences round at the size of the largest of them, and the smallest w
// converts it to pixels. A dozen roundings are far below 2^-44.
double rounding_slack(const frontend::MovingCorners& corners) {
  double size = 0, w_low = std::numeric_limits<double>::infinity(), w_high = 0;
  for (const DVec4& p : corners) {
    size = std::max({size, std::abs(p.x / p.w), std::abs(p.y / p.w)});
    w_low = std::min(w_low, p.w);
    w_high = std::max(w_high, p.w);
  }
  return size * (w_high / w_low) * 0x1p-44;
}

// Rectangle of both boxes, widened by `grow`; one more float outwards covers the conversion.
frontend::ScreenBounds bounds_of(const ScreenBox& a, const ScreenBox& b, double grow) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const auto down = [&](double v) { return std::nextafter(static_cast<float>(v - grow), -kInfinity); };
  const auto up = [&](double v) { return std::nextafter(static_cast<float>(v + grow), kInfinity); };
  frontend::ScreenBounds bounds{};
  bounds.x0 = down(std::min(a.x0, b.x0));
  bounds.y0 = down(std::min(a.y0, b.y0));
  bounds.x1 = up(std::max(a.x1, b.x1));
  bounds.y1 = up(std::max(a.y1, b.y1));
  return bounds;
}

}  // namespace

ScreenBox screen_box_at(const frontend::MovingCorners& corners, double t) {
  return {-farthest(corners, 0, t, -1), -farthest(corners, 1, t, -1), farthest(corners, 0, t, 1),
          farthest(corners, 1, t, 1)};
}

int TimeSegments::chosen_count(const MovingBody& body, const TileGrid& grid) {
  if (!has_hull(body)) return 1;
  const ScreenBox a = screen_box_at(body.corners, 0), b = screen_box_at(body.corners, 1);
  const double blur = 0.5 * std::max(std::abs(a.x0 + a.x1 - b.x0 - b.x1), std::abs(a.y0 + a.y1 - b.y0 - b.y1));
  const double tile = std::max(grid.tile_width(), grid.tile_height());
  const double size = std::max({tile, a.x1 - a.x0, a.y1 - a.y0, b.x1 - b.x0, b.y1 - b.y0});
  return static_cast<int>(std::clamp(std::ceil(blur / size), 1.0, static_cast<double>(kMax)));
}

TimeSegments::TimeSegments(const MovingBody& body, const TileGrid& grid, int count) {
  const int wanted = count == 0 ? chosen_count(body, grid) : count;
  if (wanted == 1 || !has_hull(body)) {
    segments_[0] = {TimeInterval{}, grid.covered(body.bounds)};
    return;
  }
  count_ = wanted;
  const double grow = static_cast<double>(body.bounds.grow) + rounding_slack(body.corners);
  ScreenBox open = screen_box_at(body.corners, 0);
  for (int k = 0; k < count_; ++k) {
    const int begin = 256 * k / count_, end = 256 * (k + 1) / count_;
    const ScreenBox close = screen_box_at(body.corners, end / 256.0);
    // Points of the box at `begin` move straight to points of the box at `end`: in between they project into the hull.
    const IntRect tiles = grid.covered(bounds_of(open, close, grow));
    segments_[static_cast<std::size_t>(k)] = {{begin, end - 1}, tiles};
    open = close;
  }
}

TimeInterval TimeSegments::times(int column, int row) const {
  TimeInterval all = kNoTime;
  for (int k = 0; k < count_; ++k) {
    const Segment& segment = segments_[static_cast<std::size_t>(k)];
    if (segment.tiles.contains(column, row)) all = all.hull(segment.codes);
  }
  return all;
}

}  // namespace tessera::binner

#include "baselines/triangle_setup.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera::baselines {

// Three vertices at key 0, and, if they move, at key 1.
struct TriangleSetup::Corners {
  std::array<double, 6> x{}, y{}, z{}, coc{};
  std::size_t count = 3;
  double grow = 0;  // TS1, plus the rounding of the tile core
  double coc_spread = 0;
};

namespace {

// Tests the hull of `count` points against a rectangle: an edge of the hull separates them or not. The rectangle's
// own sides were tested before.
bool hull_touches(const std::array<double, 6>& x, const std::array<double, 6>& y, std::size_t count, double x0,
                  double y0, double x1, double y1) {
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t j = 0; j < count; ++j) {
      // Outward normal of an edge from i to j that has all points on its inner side.
      const double nx = y[j] - y[i], ny = x[i] - x[j];
      if (i == j || (nx == 0 && ny == 0)) continue;
      const double offset = nx * x[i] + ny * y[i];
      bool outermost = true;
      for (std::size_t k = 0; k < count && outermost; ++k) outermost = nx * x[k] + ny * y[k] <= offset;
      if (outermost && nx * (nx > 0 ? x0 : x1) + ny * (ny > 0 ? y0 : y1) > offset) return false;
    }
  return true;
}

}  // namespace

void count(TriangleFate fate, BaselineCounters& counters) {
  switch (fate) {
    case TriangleFate::kKept:
      ++counters.primitives;
      break;
    case TriangleFate::kZeroArea:
      ++counters.culled_zero_area;
      break;
    case TriangleFate::kBackface:
      ++counters.culled_backface;
      break;
    case TriangleFate::kFrustum:
      ++counters.culled_frustum;
      break;
  }
}

// 1/z runs linearly with the vertex's progress on screen, so its extremes are at the keys.
double TriangleSetup::circle_of_confusion(double z) const {
  return projection_.lens_scale *
         (projection_.orthographic ? 1 - z * projection_.inverse_focus : 1 / z - projection_.inverse_focus);
}

TriangleSetup::Corners TriangleSetup::corners_of(const TessellatedPatch& patch,
                                                 const std::array<std::uint32_t, 3>& vertex) const {
  Corners c;
  c.count = patch.moving ? 6 : 3;
  for (std::size_t k = 0; k < c.count; ++k) {
    const std::uint32_t v = vertex[k % 3];
    const bool open = k < 3;
    c.x[k] = static_cast<double>(open ? patch.x0[v] : patch.x1[v]);
    c.y[k] = static_cast<double>(open ? patch.y0[v] : patch.y1[v]);
    c.z[k] = static_cast<double>(open ? patch.z0[v] : patch.z1[v]);
    if (projection_.lens_scale == 0) continue;
    c.coc[k] = circle_of_confusion(c.z[k]);
    c.grow = std::max(c.grow, std::abs(c.coc[k]));
  }
  const auto [low, high] = std::minmax_element(c.coc.begin(), c.coc.begin() + static_cast<std::ptrdiff_t>(c.count));
  c.coc_spread = *high - *low;
  if (patch.moving || projection_.lens_scale != 0) c.grow += 0x1p-9;
  return c;
}

int TriangleSetup::facing(const Corners& c) const {
  int sign = 0;
  for (std::size_t keys = 0; keys < (c.count == 6 ? 8u : 1u); ++keys) {
    const std::size_t a = (keys & 1) * 3, b = 1 + (keys >> 1 & 1) * 3, d = 2 + (keys >> 2 & 1) * 3;
    const double ex = c.x[b] - c.x[a], ey = c.y[b] - c.y[a], fx = c.x[d] - c.x[a], fy = c.y[d] - c.y[a];
    const double area = ex * fy - ey * fx;
    double change = c.coc_spread * (std::hypot(ex, ey) + std::hypot(fx, fy));
    if (c.count == 6 || c.coc_spread > 0) change += 0x1p-9 * (std::hypot(ex, ey) + std::hypot(fx, fy) + 1);
    const int here = area > change ? 1 : area < -change ? -1 : 0;
    if (here == 0) return area == 0 && change == 0 ? 0 : 2;
    if (keys > 0 && here != sign) return 2;
    sign = here;
  }
  return sign;
}

// Tiles at the border extend beyond the drawn region.
bool TriangleSetup::outside_region(const frontend::ScreenBounds& bounds) const {
  const IntRect& region = grid_.region();
  return bounds.x1 < static_cast<float>(region.x0) || bounds.y1 < static_cast<float>(region.y0) ||
         bounds.x0 > static_cast<float>(region.x1) || bounds.y0 > static_cast<float>(region.y1);
}

void TriangleSetup::cover(const Corners& c, std::vector<binner::TileIndex>& tiles) const {
  const auto last = static_cast<std::ptrdiff_t>(c.count);
  const auto [x_low, x_high] = std::minmax_element(c.x.begin(), c.x.begin() + last);
  const auto [y_low, y_high] = std::minmax_element(c.y.begin(), c.y.begin() + last);
  frontend::ScreenBounds bounds{};
  bounds.x0 = static_cast<float>(*x_low - c.grow);
  bounds.y0 = static_cast<float>(*y_low - c.grow);
  bounds.x1 = static_cast<float>(*x_high + c.grow);
  bounds.y1 = static_cast<float>(*y_high + c.grow);
  if (outside_region(bounds)) return;
  const IntRect rect = grid_.covered(bounds), &region = grid_.region();
  const bool one = rect.width() * rect.height() == 1;
  for (int row = rect.y0; row < rect.y1; ++row)
    for (int column = rect.x0; column < rect.x1; ++column)
      if (one || hull_touches(c.x, c.y, c.count, std::max(grid_.column_edge(column), region.x0) - c.grow,
                              std::max(grid_.row_edge(row), region.y0) - c.grow,
                              std::min(grid_.column_edge(column + 1), region.x1) + c.grow,
                              std::min(grid_.row_edge(row + 1), region.y1) + c.grow))
        add(column, row, tiles);
}

bool TriangleSetup::covers_clipped(const TessellatedPatch& patch, const std::array<std::uint32_t, 3>& vertex,
                                   std::vector<binner::TileIndex>& tiles) const {
  std::vector<DVec4> points;
  for (std::size_t k = 0; k < (patch.moving ? 6u : 3u); ++k) {
    const std::uint32_t v = vertex[k % 3];
    const double x = static_cast<double>(k < 3 ? patch.x0[v] : patch.x1[v]),
                 y = static_cast<double>(k < 3 ? patch.y0[v] : patch.y1[v]);
    const double z = static_cast<double>(k < 3 ? patch.z0[v] : patch.z1[v]), w = projection_.orthographic ? 1.0 : z;
    const double scale = patch.projected[v] != 0 ? w : 1.0;
    points.emplace_back(x * scale, y * scale, z, w);
  }
  frontend::RoundingMargin margin;
  margin.pixels = 0x1p-6;
  const auto bounds = frontend::screen_bounds(points, projection_, margin);
  if (!bounds || outside_region(*bounds)) return false;
  const IntRect rect = grid_.covered(*bounds);
  for (int row = rect.y0; row < rect.y1; ++row)
    for (int column = rect.x0; column < rect.x1; ++column) add(column, row, tiles);
  return !rect.empty();
}

std::optional<frontend::ScreenBounds> TriangleSetup::extent(const TessellatedPatch& patch,
                                                            std::span<const std::uint32_t> vertices) const {
  frontend::ScreenBounds out{};
  double x0 = std::numeric_limits<double>::infinity(), y0 = x0, near_z = x0, x1 = -x0, y1 = -x0, grow = 0;
  for (const std::uint32_t v : vertices) {
    if (patch.projected[v] == 0) return std::nullopt;
    for (const bool open : {true, false}) {
      if (!open && !patch.moving) continue;
      const auto x = static_cast<double>(open ? patch.x0[v] : patch.x1[v]),
                 y = static_cast<double>(open ? patch.y0[v] : patch.y1[v]),
                 z = static_cast<double>(open ? patch.z0[v] : patch.z1[v]);
      x0 = std::min(x0, x), x1 = std::max(x1, x), y0 = std::min(y0, y), y1 = std::max(y1, y);
      near_z = std::min(near_z, z);
      if (projection_.lens_scale != 0) grow = std::max(grow, std::abs(circle_of_confusion(z)));
    }
  }
  if (patch.moving || projection_.lens_scale != 0) grow += 0x1p-9;
  out.x0 = static_cast<float>(x0 - grow), out.y0 = static_cast<float>(y0 - grow);
  out.x1 = static_cast<float>(x1 + grow), out.y1 = static_cast<float>(y1 + grow);
  out.near_z = static_cast<float>(near_z);
  return out;
}

TriangleList TriangleSetup::run(const TessellatedPatch& patch, BaselineCounters& counters) const {
  TriangleList list;
  std::size_t group = 0;
  for (std::size_t t = 0; t < patch.triangles.size(); ++t) {
    for (; group < patch.group_ends.size() && patch.group_ends[group] == t; ++group)
      list.group_ends.push_back(static_cast<std::uint32_t>(list.triangles.size()));
    const std::array<std::uint32_t, 3>& v = patch.triangles[t];
    const std::size_t first = list.tiles.size();
    if (patch.projected[v[0]] != 0 && patch.projected[v[1]] != 0 && patch.projected[v[2]] != 0) {
      const Corners corners = corners_of(patch, v);
      const int side = facing(corners);
      if (side == 0) {
        list.fates.push_back(TriangleFate::kZeroArea);
        continue;
      }
      if ((side == 1 && !patch.keep_positive) || (side == -1 && !patch.keep_negative)) {
        list.fates.push_back(TriangleFate::kBackface);
        continue;
      }
      const bool beyond =
          projection_.far > 0 &&
          *std::min_element(corners.z.begin(), corners.z.begin() + static_cast<std::ptrdiff_t>(corners.count)) >
              projection_.far;
      if (!beyond) cover(corners, list.tiles);
    } else {
      covers_clipped(patch, v, list.tiles);
    }
    if (list.tiles.size() == first) {
      list.fates.push_back(TriangleFate::kFrustum);
      continue;
    }
    list.fates.push_back(TriangleFate::kKept);
    list.triangles.push_back({v, static_cast<std::uint32_t>(t), static_cast<std::uint32_t>(list.tiles.size())});
  }
  list.group_ends.push_back(static_cast<std::uint32_t>(list.triangles.size()));
  for (const TriangleFate fate : list.fates) count(fate, counters);
  counters.tile_overlaps += list.tiles.size();
  return list;
}

}  // namespace tessera::baselines

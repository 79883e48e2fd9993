#include "tilecore/visibility/bounding_polygons.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera::tilecore {
namespace {

constexpr int kMaxSegments = 64;       // [assumed]
constexpr double kSmallestPart = 2.0;  // pixels: below that a piece costs more than the samples it saves [assumed]

// First pixel of [begin, end] that is not wholly below `low`; the one after the last that is not wholly above `high`.
int first_pixel(double low, int begin, int end) {
  return low > begin ? (low < end ? static_cast<int>(std::floor(low)) : end) : begin;
}
int end_pixel(double high, int begin, int end) {
  return high >= begin ? (high < end ? static_cast<int>(std::floor(high)) + 1 : end) : begin;
}

TimeRange first_and_last(const PrimitiveBound::Times& times) {
  if (times.low > times.high) return {1, 0};
  return {std::max(0, static_cast<int>(std::floor(times.low * 256)) - 1),
          std::min(255, static_cast<int>(std::floor(times.high * 256)) + 1)};
}

}  // namespace

bool is_projected(const MicroMesh& mesh, std::size_t cell) {
  return (mesh.leaves[cell / kLeafCells].cells >> (cell % kLeafCells) & 1) != 0;
}

void PrimitiveBound::add_cell(std::size_t cell) {
  for (std::size_t k = 0; k < 4; ++k) {
    if (k == 3 && mesh_.corner[3][cell] == mesh_.corner[2][cell]) break;
    const auto v = static_cast<std::size_t>(mesh_.corner[k][cell]);
    Vertex vertex{{static_cast<double>(mesh_.x0[v]), static_cast<double>(mesh_.y0[v])},
                  {0, 0},
                  static_cast<double>(mesh_.z0[v]),
                  static_cast<double>(mesh_.z0[v])};
    if (moving_) {
      vertex.way = {static_cast<double>(mesh_.x1[v]) - vertex.open[0],
                    static_cast<double>(mesh_.y1[v]) - vertex.open[1]};
      vertex.z1 = static_cast<double>(mesh_.z1[v]);
    }
    vertices_.push_back(vertex);
  }
}

double PrimitiveBound::rate(const Vertex& v, double t) const {
  return orthographic_ ? t : t * v.z1 / ((1 - t) * v.z0 + t * v.z1);
}
double PrimitiveBound::rate_time(const Vertex& v, double rate) const {
  return orthographic_ ? rate : rate * v.z0 / ((1 - rate) * v.z1 + rate * v.z0);
}
double PrimitiveBound::lens_factor(double z) const {
  return std::abs(orthographic_ ? 1 - z * inverse_focus_ : 1 / z - inverse_focus_);
}

double PrimitiveBound::reach(const Vertex& v, double t0, double t1) const {
  const auto at = [&](double t) { return lens_factor((1 - t) * v.z0 + t * v.z1); };
  return radius_ == 0 ? 0 : radius_ * std::max(at(t0), at(t1));
}

double PrimitiveBound::margin(const Vertex& v, double t0, double t1, double width) const {
  const auto depth = [&](double t) { return (1 - t) * v.z0 + t * v.z1; };
  const double largest = std::max(std::abs(v.z0), std::abs(v.z1)),
               way = std::max(std::abs(v.way[0]), std::abs(v.way[1]));
  if (orthographic_) return kRoundingMargin * (width + way + radius_ * (largest * inverse_focus_ + 1));
  const double least = std::min(depth(t0), depth(t1));
  double sum = width + way * (largest / least);
  if (radius_ != 0) sum += radius_ * (largest / (least * least) + 1 / least + inverse_focus_);
  return kRoundingMargin * sum;
}

PrimitiveBound::Box PrimitiveBound::over(double t0, double t1) const {
  constexpr double kEndless = std::numeric_limits<double>::infinity();
  Box box{kEndless, kEndless, -kEndless, -kEndless};
  for (const Vertex& v : vertices_) {
    const double lens = reach(v, t0, t1);
    for (const double at : {rate(v, t0), rate(v, t1)}) {
      const double x = v.open[0] + at * v.way[0], y = v.open[1] + at * v.way[1];
      box = {std::min(box.x0, x - lens), std::min(box.y0, y - lens), std::max(box.x1, x + lens),
             std::max(box.y1, y + lens)};
    }
  }
  const double width = std::max(box.x1 - box.x0, box.y1 - box.y0);
  double pad = 0;
  for (const Vertex& v : vertices_) pad = std::max(pad, margin(v, t0, t1, width));
  return {box.x0 - pad, box.y0 - pad, box.x1 + pad, box.y1 + pad};
}

IntRect PrimitiveBound::pixels(double t0, double t1, const IntRect& within) const {
  const Box box = over(t0, t1);
  return {first_pixel(box.x0, within.x0, within.x1), first_pixel(box.y0, within.y0, within.y1),
          end_pixel(box.x1, within.x0, within.x1), end_pixel(box.y1, within.y0, within.y1)};
}

void PrimitiveBound::keep_side(std::size_t axis, double sign, double side, double width, Times& times) const {
  Times inside{1, 0};
  for (const Vertex& v : vertices_) {
    // Below the side while open + rate * way <= limit, both times sign.
    const double limit = sign * side + reach(v, 0, 1) + margin(v, 0, 1, width), open = sign * v.open[axis],
                 way = sign * v.way[axis];
    Times one{0, 1};
    if (open > limit && open + way > limit) continue;
    if (open > limit || open + way > limit) {
      const double crossing = rate_time(v, (limit - open) / way);
      if (open > limit)
        one.low = crossing;
      else
        one.high = crossing;
    }
    inside = {std::min(inside.low, one.low), std::max(inside.high, one.high)};
  }
  times = {std::max(times.low, inside.low), std::min(times.high, inside.high)};
}

PrimitiveBound::Times PrimitiveBound::times_over(const IntRect& pixels) const {
  const Box box = over(0, 1);
  const double width = std::max(box.x1 - box.x0, box.y1 - box.y0);
  Times times;
  keep_side(0, 1, pixels.x1, width, times);
  keep_side(0, -1, pixels.x0, width, times);
  keep_side(1, 1, pixels.y1, width, times);
  keep_side(1, -1, pixels.y0, width, times);
  return times;
}

double PrimitiveBound::size() const {
  const Box open = over(0, 0), close = over(1, 1);
  return std::max({open.x1 - open.x0, open.y1 - open.y0, close.x1 - close.x0, close.y1 - close.y0});
}

double PrimitiveBound::blur() const {
  double most = 0;
  for (const Vertex& v : vertices_) most = std::max({most, std::abs(v.way[0]), std::abs(v.way[1])});
  return most;
}

std::size_t whole_motion_piece(const PrimitiveBound& bound, const IntRect& tile, const TimeRange& times,
                               std::vector<BoundingPiece>& out) {
  const IntRect pixels = bound.pixels(0, 1, tile);
  if (!pixels.empty() && !times.empty()) out.push_back({pixels, StencilReferences::of(times)});
  return 1;
}

std::size_t segment_pieces(const PrimitiveBound& bound, const IntRect& tile, const TimeRange& times, int count,
                           std::vector<BoundingPiece>& out) {
  for (int k = 0; k < count; ++k) {
    const int first = 256 * k / count, end = 256 * (k + 1) / count;
    const TimeRange values = TimeRange{first, end - 1}.intersect(times);
    if (values.empty()) continue;
    const IntRect pixels = bound.pixels(first / 256.0, end / 256.0, tile);
    if (!pixels.empty()) out.push_back({pixels, StencilReferences::of(values)});
  }
  return static_cast<std::size_t>(count);
}

std::size_t partition_pieces(const PrimitiveBound& bound, const IntRect& tile, const TimeRange& times,
                             std::vector<BoundingPiece>& out) {
  const IntRect whole = bound.pixels(0, 1, tile);
  if (whole.empty()) return 1;
  const int side = static_cast<int>(std::ceil(std::clamp(bound.size(), kSmallestPart, 256.0)));
  std::size_t parts = 0;
  for (int y = whole.y0; y < whole.y1; y += side)
    for (int x = whole.x0; x < whole.x1; x += side, ++parts) {
      const IntRect part = IntRect{x, y, x + side, y + side}.intersect(whole);
      const TimeRange values = first_and_last(bound.times_over(part)).intersect(times);
      if (!values.empty()) out.push_back({part, StencilReferences::of(values)});
    }
  return parts;
}

std::size_t interleaved_pieces(const PrimitiveBound& bound, const IntRect& tile, const TimeRange& times,
                               const SampleClasses& classes, std::vector<BoundingPiece>& out) {
  std::size_t looked_at = 0;
  for (int value = times.first; value <= times.last; ++value) {
    const std::uint32_t first = classes.first_at[static_cast<std::size_t>(value)],
                        end = classes.first_at[static_cast<std::size_t>(value) + 1];
    if (first == end) continue;
    ++looked_at;
    const IntRect pixels =
        bound.pixels(static_cast<double>(classes.t[first]), static_cast<double>(classes.t[end - 1]), tile);
    if (!pixels.empty()) out.push_back({pixels, StencilReferences::of({value, value})});
  }
  return looked_at;
}

int segments_for(const PrimitiveBound& bound) {
  const double ratio = bound.blur() / std::max(bound.size(), 1.0);
  return static_cast<int>(std::ceil(std::clamp(ratio, 1.0, static_cast<double>(kMaxSegments))));
}

}  // namespace tessera::tilecore

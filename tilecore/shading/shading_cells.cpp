#include "tilecore/shading/shading_cells.h"

#include <algorithm>
#include <cmath>

#include "tilecore/shading/vertex_outputs.h"

namespace tessera::tilecore {
namespace {

using scene::FrameGeometry;

constexpr int kMaxBlockBits = 4;
constexpr double kLeastBlockPixels = 8;
constexpr float kMaxStretch = 2;

// Blocks of a Bezier patch along a direction with this many tessellated cells: 2^bits.
int block_bits(const FrameGeometry& frame, int cells) {
  const double pixels = cells * frame.request.tessellation.target_edge_pixels;
  int bits = 0;
  while (bits < kMaxBlockBits && pixels >= kLeastBlockPixels * static_cast<double>(2 << bits)) ++bits;
  return bits;
}

Vec2 on_screen(const FrameGeometry& frame, const SurfaceLocation& at) {
  const Vec4 r = evaluate_surface(frame, at).raster;
  // Points behind the near plane count as if on it: no sample sees their cells.
  const float w = frame.projection.orthographic ? 1.0f : std::max(r.w, static_cast<float>(frame.projection.near));
  return {r.x / w, r.y / w};
}

// Power of two nearest to a length, as bits.
std::uint8_t bits_for(float pixels) {
  std::uint8_t bits = 0;
  while (bits < ShadingCells::kMaxBits && pixels > 1.41421356f * static_cast<float>(1 << bits)) ++bits;
  return bits;
}

float cross(const Vec2& a, const Vec2& b) { return a.x * b.y - a.y * b.x; }

// Lengths of a part's sides and its area (of the whole parallelogram for a triangle), and the corner where the sides
// meet.
struct PartSize {
  float along_p = 0, along_q = 0, area = 0;
  std::uint8_t origin = 0;
};

PartSize block_size(const FrameGeometry& frame, std::uint32_t patch, Vec2 low, Vec2 size) {
  std::array<std::array<Vec2, 3>, 3> point;
  for (std::size_t j = 0; j < 3; ++j)
    for (std::size_t i = 0; i < 3; ++i)
      point[j][i] =
          on_screen(frame, {patch, SurfaceLocation::kWholePatch, low.x + size.x * 0.5f * static_cast<float>(i),
                            low.y + size.y * 0.5f * static_cast<float>(j), ShadingCells::kTime});
  PartSize out;
  for (std::size_t k = 0; k < 3; ++k) {
    out.along_p =
        std::max(out.along_p, glm::length(point[k][1] - point[k][0]) + glm::length(point[k][2] - point[k][1]));
    out.along_q =
        std::max(out.along_q, glm::length(point[1][k] - point[0][k]) + glm::length(point[2][k] - point[1][k]));
  }
  for (std::size_t j = 0; j < 2; ++j)
    for (std::size_t i = 0; i < 2; ++i)
      out.area += 0.5f * std::abs(cross(point[j + 1][i + 1] - point[j][i], point[j + 1][i] - point[j][i + 1]));
  return out;
}

PartSize triangle_size(const FrameGeometry& frame, std::uint32_t patch, std::uint32_t triangle) {
  const auto corner = [&](float b1, float b2) {
    return on_screen(frame, {patch, triangle, b1, b2, ShadingCells::kTime});
  };
  const std::array<Vec2, 3> point = {corner(0, 0), corner(1, 0), corner(0, 1)};
  PartSize out;
  for (std::uint8_t k = 0; k < 3; ++k) {
    const Vec2 p = point[(k + 1u) % 3] - point[k], q = point[(k + 2u) % 3] - point[k];
    const PartSize from{glm::length(p), glm::length(q), std::abs(cross(p, q)), k};
    // The area is the same from each corner: the sine of the angle is largest where the product of the sides is
    // smallest.
    if (k == 0 || from.along_p * from.along_q < out.along_p * out.along_q) out = from;
  }
  return out;
}

}  // namespace

void ShadingCells::start(const FrameGeometry& frame, float cell_pixels) {
  frame_ = &frame;
  cell_pixels_ = cell_pixels;
  measured_.fill({});
}

ShadingCells::Grid ShadingCells::grid_of(std::uint32_t patch, std::uint32_t part) {
  Measured& m = measured_[(patch * 0x9E3779B1u + part * 0x85EBCA77u) >> 20];
  if (m.patch == patch && m.part == part) return m.grid;
  PartSize size;
  if (has_grid(frame_->drawable_of(patch))) {
    const scene::TessellationPattern& pattern = frame_->pattern_of(patch);
    const int columns = block_bits(*frame_, pattern.nu), rows = block_bits(*frame_, pattern.nv);
    const Vec2 block(1.0f / static_cast<float>(1 << columns), 1.0f / static_cast<float>(1 << rows));
    const Vec2 place(static_cast<float>(part & ((1u << columns) - 1)), static_cast<float>(part >> columns));
    size = block_size(*frame_, patch, place * block, block);
  } else {
    size = triangle_size(*frame_, patch, part);
  }
  // Sides s_p and s_q that meet at an angle of sine a hold a parallelogram of a * s_p * s_q: both shrink by sqrt(a).
  const float sides = size.along_p * size.along_q;
  const float shrink =
      sides > 0 ? std::sqrt(std::clamp(size.area / sides, 1.0f / (kMaxStretch * kMaxStretch), 1.0f)) : 1.0f;
  const float scale = shrink / cell_pixels_;
  m = {patch, part, {bits_for(size.along_p * scale), bits_for(size.along_q * scale), size.origin}};
  return m.grid;
}

ShadingCell ShadingCells::cell_of(const SurfaceLocation& at) {
  Vec2 parameters = surface_parameters(*frame_, at);
  ShadingCell cell;
  cell.patch = at.patch;
  cell.part = at.triangle;
  const auto cut = [](float value, int bits, float& rest) {  // piece of [0, 1] that holds the value, and where in it
    // Rounding may leave a parameter a little outside; not a number counts as 0.
    const float inside = value > 0.0f ? std::min(value, 1.0f) : 0.0f, scaled = inside * static_cast<float>(1 << bits);
    const float piece = std::min(std::floor(scaled), static_cast<float>((1 << bits) - 1));
    rest = scaled - piece;
    return static_cast<std::uint32_t>(piece);
  };
  if (has_grid(frame_->drawable_of(at.patch))) {
    const scene::TessellationPattern& pattern = frame_->pattern_of(at.patch);
    const int columns = block_bits(*frame_, pattern.nu), rows = block_bits(*frame_, pattern.nv);
    const Vec2 whole = parameters;
    const std::uint32_t column = cut(whole.x, columns, parameters.x), row = cut(whole.y, rows, parameters.y);
    cell.part = (row << columns) + column;
  }
  const Grid grid = grid_of(cell.patch, cell.part);
  cell.i_bits = grid.i_bits;
  cell.j_bits = grid.j_bits;
  cell.origin = grid.origin;
  const std::array<float, 3> weight = {1.0f - parameters.x - parameters.y, parameters.x, parameters.y};
  if (grid.origin != 0) parameters = Vec2(weight[(grid.origin + 1u) % 3], weight[(grid.origin + 2u) % 3]);
  float rest;
  cell.i = static_cast<std::uint16_t>(cut(parameters.x, grid.i_bits, rest));
  cell.j = static_cast<std::uint16_t>(cut(parameters.y, grid.j_bits, rest));
  return cell;
}

SurfaceLocation ShadingCells::canonical_point(const FrameGeometry& frame, const ShadingCell& cell) {
  const Vec2 size(1.0f / static_cast<float>(1 << cell.i_bits), 1.0f / static_cast<float>(1 << cell.j_bits));
  const Vec2 corner = Vec2(static_cast<float>(cell.i), static_cast<float>(cell.j)) * size;
  if (has_grid(frame.drawable_of(cell.patch))) {
    const scene::TessellationPattern& pattern = frame.pattern_of(cell.patch);
    const int columns = block_bits(frame, pattern.nu), rows = block_bits(frame, pattern.nv);
    const Vec2 block(static_cast<float>(cell.part & ((1u << columns) - 1)), static_cast<float>(cell.part >> columns));
    const Vec2 uv =
        (block + corner + size * 0.5f) / Vec2(static_cast<float>(1 << columns), static_cast<float>(1 << rows));
    if (!interpolates_surface(frame, frame.drawable_of(cell.patch)))
      return {cell.patch, SurfaceLocation::kWholePatch, uv.x, uv.y, kTime};
    const scene::GridPoint point = scene::triangle_at(pattern, uv.x, uv.y);
    return {cell.patch, point.triangle, point.b1, point.b2, kTime};
  }
  // From the corner, which is on the triangle, towards the middle: two thirds of the way to the third side where that
  // comes first.
  const Vec2 way = size * 0.5f;
  const float room = 1.0f - corner.x - corner.y, full = way.x + way.y;
  const Vec2 point = corner + way * (full < room ? 1.0f : room > 0.0f ? room / full * (2.0f / 3.0f) : 0.0f);
  std::array<float, 3> weight;
  weight[cell.origin] = 1.0f - point.x - point.y;
  weight[(cell.origin + 1u) % 3] = point.x;
  weight[(cell.origin + 2u) % 3] = point.y;
  return {cell.patch, cell.part, weight[1], weight[2], kTime};
}

}  // namespace tessera::tilecore

#include "baselines/grid_code.h"

#include <array>

#include "base/check.h"

namespace tessera::baselines {
namespace {

constexpr unsigned kMissingBit = 64;
constexpr std::size_t kGridVertices = std::size_t{kGridCells + 1} * (kGridCells + 1);

// Grid vertices of a triangle, numbered row by row.
std::array<std::size_t, 3> grid_corners(std::size_t triangle, std::size_t columns) {
  const std::size_t cell = triangle / 2, a = cell / columns * (columns + 1) + cell % columns, b = a + 1,
                    d = a + columns + 1, c = d + 1;
  return triangle % 2 == 0 ? std::array{a, c, d} : std::array{a, b, c};
}

}  // namespace

std::vector<std::uint8_t> encode_grids(std::span<const GridRectangle> rectangles) {
  std::vector<std::uint8_t> out;
  for (const GridRectangle& r : rectangles) {
    TESSERA_CHECK(r.columns >= 1 && r.columns <= kGridCells && r.rows >= 1 && r.rows <= kGridCells,
                  "a rectangle of a block has 1 to 7 cells a side");
    const std::size_t count = std::size_t{2} * r.columns * r.rows;
    const bool missing = r.triangles.count() != count;
    out.push_back(static_cast<std::uint8_t>((r.columns - 1u) | (r.rows - 1u) << 3 | (missing ? kMissingBit : 0u)));
    for (std::size_t byte = 0; missing && byte < (count + 7) / 8; ++byte) {
      unsigned bits = 0;
      for (std::size_t b = 0; b < 8 && byte * 8 + b < count; ++b) bits |= (r.triangles[byte * 8 + b] ? 1u : 0u) << b;
      out.push_back(static_cast<std::uint8_t>(bits));
    }
  }
  return out;
}

std::vector<BlockTriangle> decode_grids(std::span<const std::uint8_t> bytes, std::size_t count) {
  std::vector<BlockTriangle> triangles;
  std::uint8_t first_vertex = 0;
  for (std::size_t at = 0; triangles.size() < count;) {
    TESSERA_CHECK(at < bytes.size(), "grid indices end within their bytes");
    const unsigned head = bytes[at++];
    const std::size_t columns = (head & 7u) + 1, rows = (head >> 3 & 7u) + 1, all = 2 * columns * rows;
    std::vector<std::size_t> present;
    for (std::size_t t = 0; t < all; ++t)
      if ((head & kMissingBit) == 0 || (bytes[at + t / 8] >> (t % 8) & 1u) != 0) present.push_back(t);
    if ((head & kMissingBit) != 0) at += (all + 7) / 8;
    std::array<std::uint8_t, kGridVertices> number{};
    for (const std::size_t t : present)
      for (const std::size_t v : grid_corners(t, columns)) number[v] = 1;
    for (std::uint8_t& n : number)
      if (n != 0) n = ++first_vertex;  // one more than its number
    for (const std::size_t t : present) {
      BlockTriangle triangle{};
      const auto corners = grid_corners(t, columns);
      for (std::size_t k = 0; k < 3; ++k) triangle[k] = static_cast<std::uint8_t>(number[corners[k]] - 1);
      triangles.push_back(triangle);
    }
  }
  return triangles;
}

}  // namespace tessera::baselines

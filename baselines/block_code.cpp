#include "baselines/block_code.h"

#include <algorithm>
#include <array>
#include <bit>

#include "base/bit_stream.h"
#include "base/check.h"

namespace tessera::baselines {
namespace {

constexpr std::uint32_t kFresh = 3, kDeltaBits = 6;

// The edge of `before` that `next` shares in the other direction, and the corner of `next` opposite to it.
struct SharedEdge {
  std::uint32_t edge = kFresh;
  std::size_t corner = 0;
};

SharedEdge shared_edge(const BlockTriangle& before, const BlockTriangle& next) {
  for (std::uint32_t k = 0; k < 3; ++k)
    for (std::size_t c = 0; c < 3; ++c)
      if (next[(c + 1) % 3] == before[(k + 1) % 3] && next[(c + 2) % 3] == before[k]) return {k, c};
  return {};
}

}  // namespace

std::vector<std::uint8_t> encode_strip(std::span<const BlockTriangle> triangles) {
  BitWriter out;
  std::uint32_t used = 0;  // numbers below it have been used
  const auto put_vertex = [&](std::uint32_t vertex) {
    TESSERA_CHECK(vertex <= used && used <= kBlockVertices, "vertices are numbered by first use");
    out.put(vertex == used ? 1 : 0, 1);
    if (vertex == used)
      ++used;
    else
      out.put(used - 1 - vertex, kDeltaBits);
  };
  BlockTriangle before{};
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const BlockTriangle& next = triangles[t];
    const SharedEdge shared = t > 0 ? shared_edge(before, next) : SharedEdge{};
    out.put(shared.edge, 2);
    if (shared.edge == kFresh) {
      for (const std::uint8_t vertex : next) put_vertex(vertex);
      before = next;
    } else {
      put_vertex(next[shared.corner]);
      before = {next[(shared.corner + 1) % 3], next[(shared.corner + 2) % 3], next[shared.corner]};
    }
  }
  return out.bytes();
}

std::vector<BlockTriangle> decode_strip(std::span<const std::uint8_t> bytes, std::size_t count) {
  BitReader in(bytes);
  std::uint32_t used = 0;
  const auto get_vertex = [&] {
    const std::uint32_t vertex = in.get(1) != 0 ? used++ : used - 1 - in.get(kDeltaBits);
    return static_cast<std::uint8_t>(vertex);
  };
  std::vector<BlockTriangle> triangles;
  triangles.reserve(count);
  BlockTriangle before{};
  for (std::size_t t = 0; t < count; ++t) {
    const std::uint32_t edge = in.get(2);
    if (edge == kFresh)
      for (std::uint8_t& vertex : before) vertex = get_vertex();
    else
      before = {before[(edge + 1) % 3], before[edge], get_vertex()};
    triangles.push_back(before);
  }
  return triangles;
}

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
      if (n != 0) n = ++first_vertex;  // one more than the vertex's number
    for (const std::size_t t : present) {
      BlockTriangle triangle{};
      const auto corners = grid_corners(t, columns);
      for (std::size_t k = 0; k < 3; ++k) triangle[k] = static_cast<std::uint8_t>(number[corners[k]] - 1);
      triangles.push_back(triangle);
    }
  }
  return triangles;
}

namespace {

constexpr std::uint64_t kMiddleUnit = 4;
constexpr std::uint32_t kPlaceBits = 6;

std::uint32_t choice_bits(std::size_t blocks) { return static_cast<std::uint32_t>(std::bit_width(blocks - 1)); }

}  // namespace

std::vector<std::uint8_t> encode_places(std::span<const std::optional<VertexPlace>> vertices, std::uint64_t address) {
  std::vector<std::uint64_t> distances;
  for (const std::optional<VertexPlace>& vertex : vertices) {
    if (!vertex) continue;
    TESSERA_CHECK(vertex->middle <= address && (address - vertex->middle) % kMiddleUnit == 0,
                  "a shared vertex lies before the block");
    distances.push_back((address - vertex->middle) / kMiddleUnit);
  }
  std::sort(distances.begin(), distances.end());
  distances.erase(std::unique(distances.begin(), distances.end()), distances.end());
  TESSERA_CHECK(!distances.empty(), "places are listed where a vertex is shared");
  std::vector<std::uint8_t> out;
  put_number(distances.size(), out);
  for (std::size_t k = 0; k < distances.size(); ++k) put_number(distances[k] - (k == 0 ? 0 : distances[k - 1]), out);
  BitWriter bits;
  for (const std::optional<VertexPlace>& vertex : vertices) {
    bits.put(vertex ? 0 : 1, 1);
    if (!vertex) continue;
    const auto block = std::lower_bound(distances.begin(), distances.end(), (address - vertex->middle) / kMiddleUnit);
    bits.put(static_cast<std::uint32_t>(block - distances.begin()), choice_bits(distances.size()));
    bits.put(vertex->place, kPlaceBits);
  }
  out.insert(out.end(), bits.bytes().begin(), bits.bytes().end());
  return out;
}

std::vector<std::optional<VertexPlace>> decode_places(std::span<const std::uint8_t> bytes, std::size_t count,
                                                      std::uint64_t address, std::size_t& bytes_taken) {
  std::size_t at = 0;
  std::vector<std::uint64_t> middles(get_number(bytes, at));
  std::uint64_t distance = 0;
  for (std::uint64_t& middle : middles) {
    distance += get_number(bytes, at);
    middle = address - distance * kMiddleUnit;
  }
  BitReader in(bytes.subspan(at));
  std::size_t bits = 0;
  std::vector<std::optional<VertexPlace>> places(count);
  for (std::optional<VertexPlace>& place : places) {
    const bool own = in.get(1) != 0;
    bits += own ? 1 : 1 + choice_bits(middles.size()) + kPlaceBits;
    if (own) continue;
    const std::uint64_t middle = middles[in.get(choice_bits(middles.size()))];
    place = VertexPlace{middle, static_cast<std::uint8_t>(in.get(kPlaceBits))};
  }
  bytes_taken = at + (bits + 7) / 8;
  return places;
}

}  // namespace tessera::baselines

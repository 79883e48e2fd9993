#include "baselines/block_code.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

#include "base/check.h"
#include "baselines/bit_stream.h"

namespace tessera::baselines {
namespace {

constexpr std::uint32_t kFresh = 3, kDeltaBits = 6;

// The edge of `before` that `next` has the other way round, and the corner of `next` opposite to it.
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

namespace {

constexpr float kSnapsPerPixel = 256;
constexpr float kLargestPixel = 1 << 22;
constexpr std::uint32_t kDeltaMode = 64, kWidthMask = 63;
constexpr std::size_t kComponentBytes = 5;

struct Component {
  bool deltas = false;
  std::uint32_t width = 0, base = 0;
};

std::uint32_t delta_of(std::span<const PositionWords> vertices, std::size_t v, std::size_t c) {
  return zigzag(static_cast<std::int32_t>(vertices[v][c] - (v == 0 ? vertices[0][c] : vertices[v - 1][c])));
}

Component choose(std::span<const PositionWords> vertices, std::size_t c) {
  const auto is_less = [&](const PositionWords& a, const PositionWords& b) {
    return static_cast<std::int32_t>(a[c]) < static_cast<std::int32_t>(b[c]);
  };
  const std::uint32_t least = (*std::min_element(vertices.begin(), vertices.end(), is_less))[c];
  std::uint32_t offsets = 0, deltas = 0;
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    offsets |= vertices[v][c] - least;
    deltas |= delta_of(vertices, v, c);
  }
  const auto offset_bits = static_cast<std::uint32_t>(std::bit_width(offsets)),
             delta_bits = static_cast<std::uint32_t>(std::bit_width(deltas));
  if (delta_bits < offset_bits) return {true, delta_bits, vertices[0][c]};
  return {false, offset_bits, least};
}

Component component_at(std::span<const std::uint8_t> bytes, std::size_t c) {
  Component component;
  const std::uint32_t head = bytes[c * kComponentBytes];
  component.deltas = (head & kDeltaMode) != 0;
  component.width = head & kWidthMask;
  std::memcpy(&component.base, &bytes[c * kComponentBytes + 1], sizeof component.base);
  return component;
}

}  // namespace

std::optional<PositionWords> position_words(const std::array<float, 6>& position, std::size_t words) {
  PositionWords out{};
  for (std::size_t c = 0; c < words; ++c) {
    if (c % 3 == 2) {
      out[c] = std::bit_cast<std::uint32_t>(position[c]);
      continue;
    }
    const float snapped = position[c] * kSnapsPerPixel;
    if (!(std::abs(position[c]) < kLargestPixel) || snapped != std::floor(snapped) ||
        (position[c] == 0 && std::signbit(position[c])))
      return std::nullopt;
    out[c] = static_cast<std::uint32_t>(static_cast<std::int32_t>(snapped));
  }
  for (std::size_t c = 3; c < words; ++c) out[c] -= out[c - 3];
  return out;
}

std::array<float, 6> position_of(const PositionWords& words, std::size_t count) {
  std::array<float, 6> out{};
  for (std::size_t c = 0; c < count; ++c) {
    const std::uint32_t word = words[c] + (c < 3 ? 0 : words[c - 3]);
    out[c] =
        c % 3 == 2 ? std::bit_cast<float>(word) : static_cast<float>(static_cast<std::int32_t>(word)) / kSnapsPerPixel;
  }
  return out;
}

std::vector<std::uint8_t> encode_positions(std::span<const PositionWords> vertices, std::size_t words) {
  std::vector<std::uint8_t> out(words * kComponentBytes, 0);
  std::vector<Component> components;
  for (std::size_t c = 0; c < words; ++c) {
    const Component component = choose(vertices, c);
    out[c * kComponentBytes] = static_cast<std::uint8_t>(component.width | (component.deltas ? kDeltaMode : 0u));
    std::memcpy(&out[c * kComponentBytes + 1], &component.base, sizeof component.base);
    components.push_back(component);
  }
  BitWriter bits;
  for (std::size_t v = 0; v < vertices.size(); ++v)
    for (std::size_t c = 0; c < words; ++c)
      bits.put(components[c].deltas ? delta_of(vertices, v, c) : vertices[v][c] - components[c].base,
               components[c].width);
  out.insert(out.end(), bits.bytes().begin(), bits.bytes().end());
  return out;
}

std::vector<PositionWords> decode_positions(std::span<const std::uint8_t> bytes, std::size_t count, std::size_t words) {
  std::vector<Component> components;
  for (std::size_t c = 0; c < words; ++c) components.push_back(component_at(bytes, c));
  BitReader bits(bytes.subspan(words * kComponentBytes));
  std::vector<PositionWords> vertices(count, PositionWords{});
  for (std::size_t v = 0; v < count; ++v)
    for (std::size_t c = 0; c < words; ++c) {
      const std::uint32_t code = bits.get(components[c].width);
      const std::uint32_t before = v == 0 ? components[c].base : vertices[v - 1][c];
      vertices[v][c] =
          components[c].deltas ? before + static_cast<std::uint32_t>(unzigzag(code)) : components[c].base + code;
    }
  return vertices;
}

std::size_t position_bytes(std::span<const std::uint8_t> bytes, std::size_t count, std::size_t words) {
  std::size_t bits = 0;
  for (std::size_t c = 0; c < words; ++c) bits += component_at(bytes, c).width;
  return words * kComponentBytes + (bits * count + 7) / 8;
}

}  // namespace tessera::baselines

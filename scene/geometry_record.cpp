#include "scene/geometry_record.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <utility>

#include "base/bit_stream.h"
#include "base/check.h"
#include "scene/dgf_block.h"

namespace tessera::scene {
namespace {

constexpr std::uint32_t kEdges = 15, kNoEdge = kEdges, kCornerBits = 8;
constexpr std::uint8_t kUnnumbered = 0xff;

using Corners = std::array<std::uint8_t, 4>;
std::size_t corner_count(const ClusterCell& cell) { return cell.single() ? 3 : 4; }

// The newest edges of the cells so far: encoder and decoder keep the same list.
class RecentEdges {
 public:
  struct Edge {
    std::uint8_t from, to;
  };
  // The newest edge that runs from `from` to `to`, or kNoEdge.
  std::uint32_t find(std::uint8_t from, std::uint8_t to) const {
    for (std::uint32_t k = 0; k < std::min(count_, kEdges); ++k)
      if (const Edge& edge = at(k); edge.from == from && edge.to == to) return k;
    return kNoEdge;
  }
  const Edge& at(std::uint32_t k) const { return ring_[(count_ - 1 - k) % kEdges]; }
  std::uint32_t count() const { return std::min(count_, kEdges); }

  // The edges of a cell of `corners` corners but for the one that begins at `shared`; `corners`: none is shared.
  void add(const Corners& corner, std::size_t corners, std::size_t shared) {
    for (std::size_t k = 0; k < corners; ++k)
      if (k != shared) ring_[count_++ % kEdges] = {corner[k], corner[(k + 1) % corners]};
  }

 private:
  std::array<Edge, kEdges> ring_{};
  std::uint32_t count_ = 0;
};

std::uint32_t bits_of_number(std::uint32_t known) { return known == 0 ? 0 : std::bit_width(known - 1); }

class CellEncoder {
 public:
  CellEncoder(BitWriter& bits, std::size_t vertices) : bits_(bits), number_(vertices, kUnnumbered) {}

  void put(const ClusterCell& cell) {
    const std::size_t corners = corner_count(cell);
    bits_.put(cell.single() ? 1 : 0, 1);
    std::uint32_t edge = kNoEdge;
    std::size_t shared = corners;
    for (std::size_t k = 0; k < corners; ++k) {
      const std::uint8_t from = number_[cell.corner[k]], to = number_[cell.corner[(k + 1) % corners]];
      if (from == kUnnumbered || to == kUnnumbered) continue;
      if (const std::uint32_t found = edges_.find(to, from); found < edge) edge = found, shared = k;
    }
    bits_.put(edge, 4);
    if (edge != kNoEdge) bits_.put(static_cast<std::uint32_t>(shared), 2);
    const std::size_t known = edge != kNoEdge ? 2 : 0, first = edge != kNoEdge ? shared : 0;
    for (std::size_t k = known; k < corners; ++k) put_corner(cell.corner[(first + k) % corners]);
    Corners numbers{};
    for (std::size_t k = 0; k < corners; ++k) numbers[k] = number_[cell.corner[k]];
    edges_.add(numbers, corners, shared);
  }

  // Vertices by their numbers; vertices without a cell come last.
  std::vector<std::uint8_t> order() const {
    std::vector<std::uint8_t> order = order_;
    for (std::size_t v = 0; v < number_.size(); ++v)
      if (number_[v] == kUnnumbered) order.push_back(static_cast<std::uint8_t>(v));
    return order;
  }

 private:
  void put_corner(std::uint8_t vertex) {
    std::uint8_t& number = number_[vertex];
    const auto known = static_cast<std::uint32_t>(order_.size());
    bits_.put(number == kUnnumbered ? 1 : 0, 1);
    if (number != kUnnumbered) return bits_.put(number, bits_of_number(known));
    number = static_cast<std::uint8_t>(known);
    order_.push_back(vertex);
  }

  BitWriter& bits_;
  RecentEdges edges_;
  std::vector<std::uint8_t> number_, order_;
};

class CellDecoder {
 public:
  CellDecoder(BoundedBitReader& bits, std::size_t vertices) : bits_(bits), vertices_(vertices) {}

  // Returns nothing where the bits are no cell of the vertices.
  std::optional<ClusterCell> get() {
    const std::size_t corners = bits_.get(1) != 0 ? 3 : 4;
    Corners corner{};
    const std::uint32_t edge = bits_.get(4);
    std::size_t shared = corners;
    if (edge != kNoEdge) {
      shared = bits_.get(2);
      if (edge >= edges_.count() || shared >= corners) return std::nullopt;
      corner[shared] = edges_.at(edge).to;
      corner[(shared + 1) % corners] = edges_.at(edge).from;
    }
    const std::size_t known = edge != kNoEdge ? 2 : 0, first = edge != kNoEdge ? shared : 0;
    for (std::size_t k = known; k < corners; ++k) {
      const std::uint32_t number = corner_number();
      if (number >= vertices_ || bits_.overrun()) return std::nullopt;
      corner[(first + k) % corners] = static_cast<std::uint8_t>(number);
    }
    edges_.add(corner, corners, shared);
    if (corners == 3) corner[3] = corner[2];
    return ClusterCell{corner};
  }

 private:
  std::uint32_t corner_number() {
    if (bits_.get(1) != 0) return known_++;
    return bits_.get(bits_of_number(known_));
  }

  BoundedBitReader& bits_;
  RecentEdges edges_;
  std::size_t vertices_;
  std::uint32_t known_ = 0;
};

// The least corner of points, and the bits of their differences to it.
struct RecordBox {
  LatticePoint anchor{};
  std::array<std::uint32_t, 3> widths{};
};
RecordBox box_of(std::span<const LatticePoint> points) {
  RecordBox box;
  for (std::size_t axis = 0; axis < 3 && !points.empty(); ++axis) {
    const auto [low, high] = std::minmax_element(points.begin(), points.end(),
                                                 [&](const auto& a, const auto& b) { return a[axis] < b[axis]; });
    box.anchor[axis] = (*low)[axis];
    box.widths[axis] =
        static_cast<std::uint32_t>(std::bit_width(static_cast<std::uint32_t>((*high)[axis] - (*low)[axis])));
  }
  return box;
}

// ---- Blocks of DGF ----------------------------------------------------------------------------------------------

std::vector<LocalTriangle> triangles_of(std::span<const ClusterCell> cells) {
  std::vector<LocalTriangle> out;
  for (const auto& [c] : cells) {
    out.push_back({c[0], c[1], c[2]});
    if (c[2] != c[3]) out.push_back({c[0], c[2], c[3]});
  }
  return out;
}

EncodedRecord encode_blocks(const PositionLattice& lattice, std::span<const LatticePoint> points,
                            std::span<const ClusterCell> cells) {
  EncodedRecord out;
  BitWriter bits;
  std::vector<std::uint8_t> number(points.size(), kUnnumbered);
  const std::vector<DgfBlock> blocks = encode_dgf_blocks(lattice, points, triangles_of(cells));
  for (const DgfBlock& block : blocks) {
    out.bytes.insert(out.bytes.end(), block.bytes.begin(), block.bytes.end());
    out.elements += block.vertices.size() + block.triangles.size();
    for (const std::uint8_t v : block.vertices) {
      const auto known = static_cast<std::uint32_t>(out.order.size());
      const bool first = number[v] == kUnnumbered;
      bits.put(first ? 1 : 0, 1);
      if (!first) {
        bits.put(number[v], bits_of_number(known));
        continue;
      }
      number[v] = static_cast<std::uint8_t>(known);
      out.order.push_back(v);
    }
  }
  TESSERA_CHECK(out.order.size() == points.size(), "each vertex of a cluster has a triangle");
  out.bytes.insert(out.bytes.end(), bits.bytes().begin(), bits.bytes().end());
  out.parts = blocks.size();
  return out;
}

void pair_neighbours(std::span<const LocalTriangle> triangles, std::vector<ClusterCell>& cells) {
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    std::optional<ClusterCell> pair;
    if (t + 1 < triangles.size()) pair = join_triangles(triangles[t], triangles[t + 1]);
    if (pair && pair->single()) pair.reset();  // the second has a corner twice
    cells.push_back(pair.value_or(cell_alone(triangles[t])));
    if (pair) ++t;
  }
}

std::optional<DecodedRecord> read_blocks(std::span<const std::uint8_t> bytes, std::size_t vertices,
                                         std::size_t blocks) {
  DecodedRecord out;
  if (bytes.size() < blocks * kDgfBlockBytes) return std::nullopt;
  BoundedBitReader bits(bytes.subspan(blocks * kDgfBlockBytes));
  for (std::size_t b = 0; b < blocks; ++b) {
    std::optional<DecodedDgfBlock> block = decode_dgf_block(bytes.subspan(b * kDgfBlockBytes, kDgfBlockBytes));
    if (!block) return std::nullopt;
    std::vector<std::uint8_t> number;
    for (const Vec3& position : block->positions) {
      const auto known = static_cast<std::uint32_t>(out.positions.size());
      const bool first = bits.get(1) != 0;
      if (first && known == vertices) return std::nullopt;
      if (first) out.positions.push_back(position);
      const std::uint32_t at = first ? known : bits.get(bits_of_number(known));
      if (at >= out.positions.size() || out.positions[at] != position) return std::nullopt;
      number.push_back(static_cast<std::uint8_t>(at));
    }
    for (LocalTriangle& triangle : block->triangles)
      for (std::uint8_t& corner : triangle) corner = number[corner];
    pair_neighbours(block->triangles, out.cells);
  }
  if (bits.overrun() || out.positions.size() != vertices) return std::nullopt;
  return out;
}

bool all_finite(std::span<const Vec3> positions) {
  return std::all_of(positions.begin(), positions.end(),
                     [](const Vec3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); });
}

// The place at so many steps from the anchor, if floats can tell it from its neighbours.
bool offset_place(const LatticePoint& anchor, const std::array<std::uint32_t, 3>& steps, LatticePoint& place) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t k = std::int64_t{anchor[axis]} + std::int64_t{steps[axis]};
    if (std::abs(k) > std::int64_t{1} << kPlaceBits) return false;
    place[axis] = static_cast<std::int32_t>(k);
  }
  return true;
}

}  // namespace

EncodedRecord encode_record(const GeometrySettings& settings, const PositionLattice& lattice,
                            std::span<const LatticePoint> points, std::span<const ClusterCell> cells) {
  TESSERA_CHECK(!settings.raw() && points.size() <= kMaxClusterVertices, "records have at most 64 vertices");
  if (settings.encoding == GeometryEncoding::kDgf) return encode_blocks(lattice, points, cells);
  const bool meshlet = settings.encoding == GeometryEncoding::kMeshlet;
  EncodedRecord out;
  out.parts = cells.size();
  out.elements = points.size() + (meshlet ? cells.size() : 0);
  // Cells first: they say in which order vertices come.
  BitWriter cell_bits;
  CellEncoder encoder(cell_bits, points.size());
  std::size_t cell_bit_count = 0;
  if (meshlet) {
    for (const ClusterCell& cell : cells) encoder.put(cell);
    out.order = encoder.order();
  } else {
    for (std::size_t v = 0; v < points.size(); ++v) out.order.push_back(static_cast<std::uint8_t>(v));
    for (const ClusterCell& cell : cells)
      for (const std::uint8_t corner : cell.corner) cell_bits.put(corner, kCornerBits);
  }
  cell_bit_count = cell_bits.bit_count();

  RecordBox box{lattice.origin, {}};
  if (meshlet)
    box = box_of(points);
  else
    box.widths.fill(static_cast<std::uint32_t>(settings.bits));
  BitWriter bits;
  bits.put(static_cast<std::uint32_t>(lattice.exponent), kExponentBits);
  for (const std::int32_t k : box.anchor) bits.put(static_cast<std::uint32_t>(k), kAnchorBits);
  if (meshlet)
    for (const std::uint32_t width : box.widths) bits.put(width, kWidthBits);
  for (const std::uint8_t v : out.order)
    for (std::size_t axis = 0; axis < 3; ++axis)
      bits.put(static_cast<std::uint32_t>(points[v][axis] - box.anchor[axis]), box.widths[axis]);
  BitReader coded(cell_bits.bytes());
  for (std::size_t k = 0; k < cell_bit_count; ++k) bits.put(coded.get(1), 1);
  out.bytes = bits.bytes();
  return out;
}

std::optional<DecodedRecord> read_record(const GeometrySettings& settings, std::span<const std::uint8_t> bytes,
                                         std::size_t vertices, std::size_t parts) {
  if (vertices == 0 || vertices > kMaxClusterVertices) return std::nullopt;
  if (settings.encoding == GeometryEncoding::kDgf) {
    std::optional<DecodedRecord> out = read_blocks(bytes, vertices, parts);
    return out && all_finite(out->positions) ? std::move(out) : std::nullopt;
  }
  const bool meshlet = settings.encoding == GeometryEncoding::kMeshlet;
  BoundedBitReader bits(bytes);
  PositionLattice lattice;
  lattice.exponent = sign_extended(bits.get(kExponentBits), kExponentBits);
  LatticePoint anchor;
  for (std::int32_t& k : anchor) k = sign_extended(bits.get(kAnchorBits), kAnchorBits);
  std::array<std::uint32_t, 3> widths;
  for (std::uint32_t& width : widths)
    width = meshlet ? bits.get(kWidthBits) : static_cast<std::uint32_t>(settings.bits);
  DecodedRecord out;
  out.positions.reserve(vertices);
  for (std::size_t v = 0; v < vertices; ++v) {
    std::array<std::uint32_t, 3> steps;
    for (std::size_t axis = 0; axis < 3; ++axis) steps[axis] = bits.get(widths[axis]);
    LatticePoint place;
    if (!offset_place(anchor, steps, place)) return std::nullopt;
    out.positions.push_back(lattice.point(place));
  }
  if (bits.overrun() || !all_finite(out.positions)) return std::nullopt;
  out.cells.reserve(parts);
  CellDecoder decoder(bits, vertices);
  for (std::size_t c = 0; c < parts; ++c) {
    if (meshlet) {
      const std::optional<ClusterCell> cell = decoder.get();
      if (!cell) return std::nullopt;
      out.cells.push_back(*cell);
      continue;
    }
    ClusterCell& cell = out.cells.emplace_back();
    for (std::uint8_t& corner : cell.corner) {
      corner = static_cast<std::uint8_t>(bits.get(kCornerBits));
      if (corner >= vertices) return std::nullopt;
    }
  }
  return bits.overrun() ? std::nullopt : std::optional(std::move(out));
}

DecodedRecord decode_record(const GeometrySettings& settings, std::span<const std::uint8_t> bytes, std::size_t vertices,
                            std::size_t parts) {
  std::optional<DecodedRecord> record = read_record(settings, bytes, vertices, parts);
  TESSERA_CHECK(record.has_value(), "records that were encoded are sound");
  return std::move(*record);
}

}  // namespace tessera::scene

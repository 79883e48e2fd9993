#include "scene/dgf_block.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "base/bit_stream.h"
#include "base/check.h"

namespace tessera::scene {
namespace {

constexpr std::uint32_t kMagic = 6, kMagicBits = 8, kReusedWidthBits = 2, kCountBits = 6, kGeometryBits = 10;
constexpr std::uint32_t kExponentFieldBits = 8, kAnchorFieldBits = 24, kOffsetWidthBits = 4, kTriangleNumberBits = 29,
                        kFlagBits = 3;
constexpr std::uint32_t kLeastReusedBits = 3, kMaxOffsetBits = 16, kVertexAlignment = 4, kControlBits = 2;
constexpr int kExponentBias = 127, kLeastExponentField = 1, kMaxExponentField = 254;
constexpr std::size_t kHeaderBits = 160, kBlockBits = 8 * kDgfBlockBytes, kMaxVertexBits = 8 * 96,
                      kMaxReusedBits = 8 * 24;
constexpr std::int32_t kMaxAnchor = (1 << (kAnchorFieldBits - 1)) - 1;

constexpr std::size_t kStarts = 4;  // triangles at which strips begin before a block counts as too large
constexpr std::uint8_t kNoIndex = 0xff;

// ---- Indices ----------------------------------------------------------------------------------------------------

// The indices that a strip states, and the vertices that its block numbers by them.
struct Indices {
  std::size_t count = 0, vertex_count = 0, reused_count = 0;
  std::array<bool, 3 * kDgfMaxTriangles> first_use;
  std::array<std::uint8_t, 3 * kDgfMaxTriangles> reused;
  // One more than a block may have: corners of the first triangle that are one vertex take two.
  std::array<std::uint8_t, kMaxClusterVertices + 2> vertices;
  std::uint32_t reused_width = kLeastReusedBits;

  explicit Indices(const DgfStrip& strip) {
    std::array<std::uint8_t, kMaxClusterVertices> number;
    number.fill(kNoIndex);
    for (std::size_t t = 0; t < strip.count; ++t)
      for (std::size_t k = strip.controls[t] == DgfControl::kRestart ? 0 : 2; k < 3; ++k)
        put(strip.corners[t][k], t == 0, number);
  }
  std::span<const std::uint8_t> used() const { return std::span(vertices).first(vertex_count); }
  std::size_t reused_bits() const { return reused_count * reused_width; }

 private:
  void put(std::uint8_t vertex, bool always_new, std::span<std::uint8_t> number) {
    const bool first = always_new || number[vertex] == kNoIndex;
    first_use[count++] = first;
    if (first) {
      number[vertex] = static_cast<std::uint8_t>(vertex_count);
      vertices[vertex_count++] = vertex;
      return;
    }
    reused_width = std::max(reused_width, static_cast<std::uint32_t>(std::bit_width(unsigned{number[vertex]})));
    reused[reused_count++] = number[vertex];
  }
};

// ---- Sizes ------------------------------------------------------------------------------------------------------

struct Offsets {
  LatticePoint anchor;
  std::array<std::uint32_t, 3> widths;
  std::size_t vertex_bits() const {
    const std::uint32_t bits = widths[0] + widths[1] + widths[2];
    return (bits + kVertexAlignment - 1) / kVertexAlignment * kVertexAlignment;
  }
};

Offsets offsets_of(std::span<const LatticePoint> points, std::span<const std::uint8_t> vertices) {
  Offsets out;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::int32_t low = std::numeric_limits<std::int32_t>::max(), high = std::numeric_limits<std::int32_t>::min();
    for (const std::uint8_t v : vertices) low = std::min(low, points[v][axis]), high = std::max(high, points[v][axis]);
    out.anchor[axis] = std::min(low, kMaxAnchor);
    const auto range = static_cast<std::uint32_t>(high - out.anchor[axis]);
    out.widths[axis] = std::max(1u, static_cast<std::uint32_t>(std::bit_width(range)));
    TESSERA_CHECK(out.widths[axis] <= kMaxOffsetBits, "records take 16 bits along an axis");
  }
  return out;
}

}  // namespace

bool fits_dgf(std::span<const LatticePoint> points) {
  for (std::size_t axis = 0; axis < 3 && !points.empty(); ++axis) {
    const auto [low, high] = std::minmax_element(points.begin(), points.end(),
                                                 [&](const auto& a, const auto& b) { return a[axis] < b[axis]; });
    if ((*high)[axis] - std::min((*low)[axis], kMaxAnchor) >= 1 << kMaxOffsetBits) return false;
  }
  return true;
}

namespace {

// A section of so many bits ends on a byte.
std::size_t whole_bytes(std::size_t bits) { return (bits + 7) / 8 * 8; }

// ---- Writing ----------------------------------------------------------------------------------------------------

void put_bit_from_end(DgfBlock& block, std::size_t& from_end, bool bit) {
  const std::size_t at = kBlockBits - ++from_end;
  block.bytes[at / 8] = static_cast<std::uint8_t>(block.bytes[at / 8] | (bit ? 1u << at % 8 : 0u));
}

DgfBlock written(const PositionLattice& lattice, std::span<const LatticePoint> points, const DgfStrip& strip,
                 const Indices& indices, const Offsets& offsets, std::uint32_t first_triangle) {
  BitWriter bits;
  const auto anchor = [&](std::size_t axis) {
    bits.put(static_cast<std::uint32_t>(offsets.anchor[axis]), kAnchorFieldBits);
  };
  bits.put(kMagic, kMagicBits);
  bits.put(indices.reused_width - kLeastReusedBits, kReusedWidthBits);
  bits.put(static_cast<std::uint32_t>(indices.vertex_count - 1), kCountBits);
  bits.put(static_cast<std::uint32_t>(strip.count - 1), kCountBits);
  bits.put(0, kGeometryBits);
  bits.put(static_cast<std::uint32_t>(lattice.exponent + kExponentBias), kExponentFieldBits);
  anchor(0);
  bits.put(offsets.widths[0] - 1, kOffsetWidthBits);
  bits.put(offsets.widths[1] - 1, kOffsetWidthBits);
  anchor(1);
  bits.put(offsets.widths[2] - 1, kOffsetWidthBits);
  bits.put(0, kOffsetWidthBits);
  anchor(2);
  bits.put(first_triangle, kTriangleNumberBits);
  bits.put(0, kFlagBits);
  const auto padding =
      static_cast<std::uint32_t>(offsets.vertex_bits() - offsets.widths[0] - offsets.widths[1] - offsets.widths[2]);
  for (const std::uint8_t v : indices.used()) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      bits.put(static_cast<std::uint32_t>(points[v][axis] - offsets.anchor[axis]), offsets.widths[axis]);
    bits.put(0, padding);
  }
  bits.put(0, static_cast<std::uint32_t>(whole_bytes(bits.bit_count()) - bits.bit_count()));
  for (std::size_t k = 0; k < indices.reused_count; ++k) bits.put(indices.reused[k], indices.reused_width);
  DgfBlock out{{},
               {indices.used().begin(), indices.used().end()},
               {strip.order.begin(), strip.order.begin() + static_cast<std::ptrdiff_t>(strip.count)}};
  std::copy(bits.bytes().begin(), bits.bytes().end(), out.bytes.begin());
  std::size_t from_end = 0;
  for (std::size_t t = 1; t < strip.count; ++t) {
    const auto control = static_cast<unsigned>(strip.controls[t]);
    put_bit_from_end(out, from_end, (control & 2u) != 0);
    put_bit_from_end(out, from_end, (control & 1u) != 0);
  }
  for (std::size_t k = 3; k < indices.count; ++k) put_bit_from_end(out, from_end, indices.first_use[k]);
  return out;
}

// ---- Reading ----------------------------------------------------------------------------------------------------

struct Header {
  PositionLattice lattice;
  std::size_t vertices, triangles;
  std::uint32_t reused_width, first_triangle;
  Offsets offsets;

  std::size_t front_bits() const { return whole_bytes(vertices * offsets.vertex_bits()); }
};

// Returns nothing where the bits are no block's header, or the vertices take too much of the block.
std::optional<Header> read_header(BitReader& bits) {
  const auto anchor = [&] { return sign_extended(bits.get(kAnchorFieldBits), kAnchorFieldBits); };
  Header out{};
  bool sound = bits.get(kMagicBits) == kMagic;
  out.reused_width = bits.get(kReusedWidthBits) + kLeastReusedBits;
  out.vertices = bits.get(kCountBits) + 1;
  out.triangles = bits.get(kCountBits) + 1;
  sound &= bits.get(kGeometryBits) == 0;
  const int exponent = static_cast<int>(bits.get(kExponentFieldBits));
  sound &= exponent >= kLeastExponentField && exponent <= kMaxExponentField;
  out.lattice.exponent = exponent - kExponentBias;
  out.offsets.anchor[0] = anchor();
  out.offsets.widths[0] = bits.get(kOffsetWidthBits) + 1;
  out.offsets.widths[1] = bits.get(kOffsetWidthBits) + 1;
  out.offsets.anchor[1] = anchor();
  out.offsets.widths[2] = bits.get(kOffsetWidthBits) + 1;
  sound &= bits.get(kOffsetWidthBits) == 0;
  out.offsets.anchor[2] = anchor();
  out.first_triangle = bits.get(kTriangleNumberBits);
  sound &= bits.get(kFlagBits) == 0;
  sound &= out.vertices >= 3 && out.front_bits() <= kMaxVertexBits;
  return sound ? std::optional(out) : std::nullopt;
}

// Bits of a block from its end towards its begin; none of them where the vertices end.
class BitsFromEnd {
 public:
  BitsFromEnd(std::span<const std::uint8_t> bytes, std::size_t begin) : bytes_(bytes), begin_(begin) {}
  std::optional<unsigned> get(std::size_t bits) {
    if (at_ < begin_ + bits) return std::nullopt;
    unsigned value = 0;
    for (std::size_t b = 0; b < bits; ++b) --at_, value = value << 1 | (bytes_[at_ / 8] >> at_ % 8 & 1u);
    return value;
  }
  std::size_t at() const { return at_; }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t begin_, at_ = kBlockBits;
};

// The indices of a strip whose first uses and reused ones are known, one after the other.
class IndexReader {
 public:
  // `reused`: the bytes from the first reused index to the block's end.
  IndexReader(std::size_t vertices, BitsFromEnd& first_uses, std::span<const std::uint8_t> reused, std::uint32_t width)
      : vertices_(vertices),
        max_reused_bits_(std::min(kMaxReusedBits, 8 * reused.size())),
        first_uses_(first_uses),
        reused_(reused),
        width_(width) {}

  // Returns nothing where the block has no such vertex, or its sections overlap.
  std::optional<std::uint8_t> next() {
    const std::optional<unsigned> first = count_++ < 3 ? std::optional(1u) : first_uses_.get(1);
    if (!first) return std::nullopt;
    if (*first != 0) return known_ < vertices_ ? std::optional(static_cast<std::uint8_t>(known_++)) : std::nullopt;
    reused_bits_ += width_;
    if (reused_bits_ > max_reused_bits_) return std::nullopt;
    const std::uint32_t index = reused_.get(width_);
    return index < vertices_ ? std::optional(static_cast<std::uint8_t>(index)) : std::nullopt;
  }
  std::size_t reused_bits() const { return reused_bits_; }

 private:
  std::size_t vertices_, max_reused_bits_, count_ = 0, known_ = 0, reused_bits_ = 0;
  BitsFromEnd& first_uses_;
  BitReader reused_;
  std::uint32_t width_;
};

// The two corners that the next triangle's control selects; nothing where the control is not allowed there.
std::optional<std::array<std::uint8_t, 2>> shared_corners(DgfControl control, const std::vector<DgfControl>& before,
                                                          const std::vector<LocalTriangle>& triangles) {
  const LocalTriangle& last = triangles.back();
  if (control == DgfControl::kEdge1) return {{last[2], last[1]}};
  if (control == DgfControl::kEdge2) return {{last[0], last[2]}};
  if (before.back() != DgfControl::kEdge1 && before.back() != DgfControl::kEdge2) return std::nullopt;
  const LocalTriangle& left = triangles[triangles.size() - 2];
  if (before.back() == DgfControl::kEdge1) return {{left[0], left[2]}};
  return {{left[2], left[1]}};
}

}  // namespace

bool DgfBlockSize::fits() const {
  const std::size_t front = whole_bytes(vertices * vertex_bits), reused_bits = reused * reused_width;
  return vertices <= kDgfMaxVertices && triangles <= kDgfMaxTriangles && front <= kMaxVertexBits &&
         reused_bits <= kMaxReusedBits &&
         kHeaderBits + front + reused_bits + (vertices + reused - 3) + kControlBits * (triangles - 1) <= kBlockBits;
}

std::optional<DgfBlock> encode_dgf_block(const PositionLattice& lattice, std::span<const LatticePoint> points,
                                         const TriangleAdjacency& triangles, std::span<const std::uint8_t> some,
                                         std::uint32_t first_triangle) {
  if (some.size() > kDgfMaxTriangles) return std::nullopt;
  std::optional<Offsets> offsets;
  for (std::size_t k = 0; k < std::min(some.size(), kStarts); ++k)
    for (const bool third_edge_first : {false, true}) {
      const DgfStrip strip = walk_strip(triangles, some, some[k], third_edge_first);
      const Indices indices(strip);
      if (!offsets) offsets = offsets_of(points, indices.used());
      if (DgfBlockSize{strip.count, indices.vertex_count, offsets->vertex_bits(), indices.reused_count,
                       indices.reused_width}
              .fits())
        return written(lattice, points, strip, indices, *offsets, first_triangle);
    }
  return std::nullopt;
}

std::optional<DecodedDgfBlock> decode_dgf_block(std::span<const std::uint8_t> bytes) {
  TESSERA_CHECK(bytes.size() == kDgfBlockBytes, "blocks have 128 bytes");
  BitReader bits(bytes);
  const std::optional<Header> header = read_header(bits);
  if (!header) return std::nullopt;
  DecodedDgfBlock out;
  out.first_triangle = header->first_triangle;
  const Offsets& offsets = header->offsets;
  const auto padding =
      static_cast<std::uint32_t>(offsets.vertex_bits()) - offsets.widths[0] - offsets.widths[1] - offsets.widths[2];
  for (std::size_t v = 0; v < header->vertices; ++v) {
    LatticePoint place;
    for (std::size_t axis = 0; axis < 3; ++axis)
      place[axis] = offsets.anchor[axis] + static_cast<std::int32_t>(bits.get(offsets.widths[axis]));
    bits.get(padding);
    out.positions.push_back(header->lattice.point(place));
    for (int axis = 0; axis < 3; ++axis)
      if (!std::isfinite(out.positions.back()[axis])) return std::nullopt;
  }
  const std::size_t reused_begin = kHeaderBits + header->front_bits();
  BitsFromEnd from_end(bytes, reused_begin);
  std::vector<DgfControl> controls = {DgfControl::kRestart};
  while (controls.size() < header->triangles) {
    const std::optional<unsigned> control = from_end.get(kControlBits);
    if (!control) return std::nullopt;
    controls.push_back(static_cast<DgfControl>(*control));
  }
  IndexReader indices(header->vertices, from_end, bytes.subspan(reused_begin / 8), header->reused_width);
  for (std::size_t t = 0; t < header->triangles; ++t) {
    LocalTriangle corners{};
    std::size_t known = 0;
    if (controls[t] != DgfControl::kRestart) {
      const auto shared = shared_corners(
          controls[t], {controls.begin(), controls.begin() + static_cast<std::ptrdiff_t>(t)}, out.triangles);
      if (!shared) return std::nullopt;
      corners[0] = (*shared)[0], corners[1] = (*shared)[1], known = 2;
    }
    for (; known < 3; ++known) {
      const std::optional<std::uint8_t> index = indices.next();
      if (!index) return std::nullopt;
      corners[known] = *index;
    }
    out.triangles.push_back(corners);
  }
  if (reused_begin + indices.reused_bits() > from_end.at()) return std::nullopt;
  return out;
}

}  // namespace tessera::scene

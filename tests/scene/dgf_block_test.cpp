// Blocks of the Dense Geometry Format (scene/dgf_block.h, scene/dgf_partition.cpp) against a decoder that is written down here
// from the specification.
#include <rapidcheck/gtest.h>

#include "base/bit_stream.h"
#include "scene/dgf_block.h"
#include "tests/support/tests.h"

namespace tessera::scene::dgf_block_test {
namespace {

using Bytes = std::vector<std::uint8_t>;

// ---- The specification ------------------------------------------------------------------------------------------

enum class Mistake { kNone, kEdgesKeepTheirDirection, kBacktracksTakeTheSameEdge, kFirstUsesFromLowBits };

std::uint32_t bits_at(std::span<const std::uint8_t> bytes, std::size_t at, std::size_t count) {
  std::uint32_t value = 0;
  for (std::size_t b = 0; b < count; ++b) value |= (bytes[(at + b) / 8] >> (at + b) % 8 & 1u) << b;
  return value;
}
std::int32_t anchor_at(std::span<const std::uint8_t> bytes, std::size_t at) {
  const auto value = static_cast<std::int32_t>(bits_at(bytes, at, 24));
  return value < 1 << 23 ? value : value - (1 << 24);
}

struct Plain {
  std::vector<Vec3> positions;
  std::vector<LocalTriangle> triangles;
};

// A sound block, one number after the other as the specification's pseudo-code has them.
Plain decode_by_hand(std::span<const std::uint8_t> bytes, Mistake mistake = Mistake::kNone) {
  Plain out;
  EXPECT_EQ(bits_at(bytes, 0, 8), 6u);
  const std::size_t index_bits = 3 + bits_at(bytes, 8, 2), vertices = 1 + bits_at(bytes, 10, 6),
                    triangles = 1 + bits_at(bytes, 16, 6);
  const int exponent = static_cast<int>(bits_at(bytes, 32, 8)) - 127;
  const std::array<std::int32_t, 3> anchor = {anchor_at(bytes, 40), anchor_at(bytes, 72), anchor_at(bytes, 104)};
  const std::array<std::size_t, 3> widths = {1 + bits_at(bytes, 64, 4), 1 + bits_at(bytes, 68, 4),
                                             1 + bits_at(bytes, 96, 4)};
  const std::size_t vertex_bits = (widths[0] + widths[1] + widths[2] + 3) / 4 * 4;
  for (std::size_t v = 0; v < vertices; ++v) {
    std::size_t at = 160 + v * vertex_bits;
    Vec3 p;
    for (std::size_t axis = 0; axis < 3; at += widths[axis++])
      p[static_cast<int>(axis)] = std::ldexp(
          static_cast<float>(anchor[axis] + static_cast<std::int32_t>(bits_at(bytes, at, widths[axis]))), exponent);
    out.positions.push_back(p);
  }
  const std::size_t reused_at = 160 + (vertices * vertex_bits + 7) / 8 * 8, controls_at = 1024 - 2 * (triangles - 1);
  const auto control = [&](std::size_t t) { return t == 0 ? 0u : bits_at(bytes, 1024 - 2 * t, 2); };
  std::size_t indices = 0;
  for (std::size_t t = 0; t < triangles; ++t) indices += control(t) == 0 ? 3 : 1;
  const auto first_use = [&](std::size_t k) {
    if (k < 3) return true;
    const std::size_t at =
        mistake == Mistake::kFirstUsesFromLowBits ? controls_at - (indices - 3) + (k - 3) : controls_at - 1 - (k - 3);
    return bits_at(bytes, at, 1) != 0;
  };
  const auto index = [&](std::size_t k) {
    std::size_t firsts = 0;
    for (std::size_t i = 0; i < k; ++i) firsts += first_use(i) ? 1 : 0;
    if (first_use(k)) return static_cast<std::uint8_t>(firsts);
    return static_cast<std::uint8_t>(bits_at(bytes, reused_at + (k - firsts) * index_bits, index_bits));
  };
  std::size_t position = 0;
  for (std::size_t t = 0; t < triangles; ++t) {
    const auto put = [&](std::uint8_t a, std::uint8_t b) {
      if (mistake == Mistake::kEdgesKeepTheirDirection) std::swap(a, b);
      out.triangles.push_back({a, b, index(position++)});
    };
    const auto edge = [&](const LocalTriangle& of, unsigned which) {
      which == 1 ? put(of[2], of[1]) : put(of[0], of[2]);
    };
    if (control(t) == 0) {
      out.triangles.push_back({index(position), index(position + 1), index(position + 2)});
      position += 3;
    } else if (control(t) < 3) {
      edge(LocalTriangle(out.triangles.back()), control(t));
    } else {
      const unsigned taken = control(t - 1);
      edge(LocalTriangle(out.triangles[t - 2]), mistake == Mistake::kBacktracksTakeTheSameEdge ? taken : 3 - taken);
    }
  }
  return out;
}

// A block of bits that are stated one by one.
Bytes block_by_hand(std::size_t vertices, const std::vector<unsigned>& controls, const std::vector<bool>& first_uses,
                    const std::vector<std::uint8_t>& reused) {
  BitWriter bits;
  bits.put(6, 8), bits.put(0, 2);
  bits.put(static_cast<std::uint32_t>(vertices - 1), 6), bits.put(static_cast<std::uint32_t>(controls.size() - 1), 6);
  bits.put(0, 10);
  bits.put(127 - 2, 8), bits.put(static_cast<std::uint32_t>(-5), 24);
  bits.put(3, 4), bits.put(0, 4), bits.put(7, 24);
  bits.put(1, 4), bits.put(0, 4), bits.put(0, 24);
  bits.put(1234, 29), bits.put(0, 3);
  for (std::size_t v = 0; v < vertices; ++v)  // 4 + 1 + 2 bits, and one more
    bits.put(static_cast<std::uint32_t>(v), 4), bits.put(v & 1, 1), bits.put(v & 3, 2), bits.put(0, 1);
  for (const std::uint8_t index : reused) bits.put(index, 3);
  Bytes out = bits.bytes();
  out.resize(kDgfBlockBytes);
  std::size_t at = 1024;
  const auto put = [&](unsigned bit) {
    --at;
    out[at / 8] = static_cast<std::uint8_t>(out[at / 8] | bit << at % 8);
  };
  for (std::size_t t = 1; t < controls.size(); ++t) put(controls[t] >> 1), put(controls[t] & 1);
  for (std::size_t k = 3; k < first_uses.size(); ++k) put(first_uses[k] ? 1 : 0);
  return out;
}

// The specification's own drawing: RESTART 0 1 2, EDGE1 2 1 3, EDGE1 3 1 4, and then each of the four.
TEST(DgfBlock, ControlsGoOnAsTheSpecificationDrawsThem) {
  const std::vector<LocalTriangle> begin = {{0, 1, 2}, {2, 1, 3}, {3, 1, 4}};
  for (const auto& [control, last] : std::vector<std::pair<unsigned, LocalTriangle>>{
           {0, {5, 6, 7}}, {1, {4, 1, 5}}, {2, {3, 4, 5}}, {3, {2, 3, 5}}}) {
    const std::size_t vertices = control == 0 ? 8 : 6;
    const Bytes bytes = block_by_hand(vertices, {0, 1, 1, control}, std::vector<bool>(vertices, true), {});
    const std::optional<DecodedDgfBlock> block = decode_dgf_block(bytes);
    ASSERT_TRUE(block.has_value());
    std::vector<LocalTriangle> expected = begin;
    expected.push_back(last);
    EXPECT_EQ(block->triangles, expected) << control;
    EXPECT_EQ(decode_by_hand(bytes).triangles, expected) << control;
    EXPECT_EQ(block->first_triangle, 1234u);
    EXPECT_EQ(block->positions[3], Vec3((-5.0f + 3) / 4, (7.0f + 1) / 4, 3.0f / 4));
  }
}

TEST(DgfBlock, BlocksThatTheSpecificationForbidsAreRefused) {
  const auto sound = [](const Bytes& bytes) { return decode_dgf_block(bytes).has_value(); };
  const Bytes good = block_by_hand(4, {0, 1, 2}, {true, true, true, true, false}, {2});
  ASSERT_TRUE(sound(good));
  EXPECT_FALSE(sound(block_by_hand(4, {0, 1, 2}, {true, true, true, true, false}, {4}))) << "no such vertex";
  EXPECT_FALSE(sound(block_by_hand(4, {0, 1, 2}, {true, true, true, true, true}, {}))) << "a fifth vertex";
  EXPECT_FALSE(sound(block_by_hand(4, {0, 3}, {true, true, true, true}, {}))) << "a backtrack behind a restart";
  EXPECT_FALSE(sound(block_by_hand(6, {0, 1, 3, 3}, {true, true, true, true, true, true}, {}))) << "two backtracks";
  EXPECT_FALSE(sound(block_by_hand(2, {0}, {true, true, true}, {}))) << "three vertices at least";
  for (const std::size_t bit : {0u, 22u, 103u, 157u, 159u}) {
    Bytes bytes = good;
    bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ 1u << bit % 8);
    EXPECT_FALSE(sound(bytes)) << "bit " << bit;
  }
  for (const unsigned exponent : {0u, 255u}) {
    Bytes bytes = good;
    bytes[4] = static_cast<std::uint8_t>(exponent);
    EXPECT_FALSE(sound(bytes)) << exponent;
  }
  // 64 triangles that restart: their indices run into the vertices.
  EXPECT_FALSE(sound(block_by_hand(64, std::vector<unsigned>(64, 0), std::vector<bool>(3, true), {})));
}

// ---- Random clusters --------------------------------------------------------------------------------------------

struct Mesh {
  PositionLattice lattice;
  std::vector<LatticePoint> points;
  std::vector<LocalTriangle> triangles;
};

// A grid with holes whose triangles may be turned over, doubled or have a corner twice, or triangles without order; on places
// anywhere that blocks reach.
Mesh any_mesh() {
  Mesh mesh;
  mesh.lattice.exponent = *rc::gen::inRange(-126, 105);
  Random random(*rc::gen::arbitrary<std::uint32_t>());
  const int columns = random.integer(1, 8), rows = random.integer(1, 8), width = random.integer(0, 16),
            spoilt = random.integer(0, 3) * 10;
  LatticePoint origin;
  for (std::int32_t& k : origin)
    k = random.coin() ? random.integer(-(1 << 23), (1 << 23) - (1 << width) + 1) : random.coin() ? -(1 << 23) : 1 << 23;
  for (int v = 0; v < columns * rows; ++v) {
    LatticePoint p = origin;
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (origin[axis] < 1 << 23) p[axis] += random.integer(0, (1 << width) - 1);
    mesh.points.push_back(p);
  }
  const auto vertex = [&](int x, int y) { return static_cast<std::uint8_t>(y * columns + x); };
  const auto any = [&] { return static_cast<std::uint8_t>(random.integer(0, columns * rows - 1)); };
  const auto add = [&](LocalTriangle t) {
    if (random.integer(0, 99) < spoilt) {
      if (random.coin()) std::swap(t[0], t[1]);
      if (random.coin()) t[2] = t[1];
      if (random.coin()) t = {any(), any(), any()};
    }
    for (int copies = random.integer(0, 99) < spoilt ? 2 : 1; copies > 0; --copies)
      if (mesh.triangles.size() < kMaxClusterTriangles) mesh.triangles.push_back(t);
  };
  for (int y = 0; y + 1 < rows; ++y)
    for (int x = 0; x + 1 < columns; ++x) {
      if (random.integer(0, 99) >= spoilt) add({vertex(x, y), vertex(x + 1, y), vertex(x + 1, y + 1)});
      if (random.integer(0, 99) >= spoilt) add({vertex(x, y), vertex(x + 1, y + 1), vertex(x, y + 1)});
    }
  if (mesh.triangles.empty()) mesh.triangles.push_back({any(), any(), any()});
  return mesh;
}

// A triangle from its least corner on: it may be turned, not turned over.
LocalTriangle wound(const LocalTriangle& t) {
  return std::min({t, LocalTriangle{t[1], t[2], t[0]}, LocalTriangle{t[2], t[0], t[1]}});
}

// Whether a decoder gives the mesh back from its blocks.
bool comes_back(const Mesh& mesh, const std::vector<DgfBlock>& blocks,
                const std::function<Plain(const DgfBlock&)>& decode) {
  std::set<std::uint8_t> seen;
  for (const DgfBlock& block : blocks) {
    const Plain plain = decode(block);
    if (plain.positions.size() != block.vertices.size() || plain.triangles.size() != block.triangles.size())
      return false;
    for (std::size_t v = 0; v < block.vertices.size(); ++v)
      if (std::memcmp(&plain.positions[v], std::array{mesh.lattice.point(mesh.points[block.vertices[v]])}.data(), 12))
        return false;
    for (std::size_t t = 0; t < block.triangles.size(); ++t) {
      LocalTriangle corners = plain.triangles[t];
      for (std::uint8_t& corner : corners) {
        if (corner >= block.vertices.size()) return false;
        corner = block.vertices[corner];
      }
      if (!seen.insert(block.triangles[t]).second || wound(corners) != wound(mesh.triangles[block.triangles[t]]))
        return false;
    }
  }
  return seen.size() == mesh.triangles.size();
}

RC_GTEST_PROP(DgfBlockProperty, DGF1AnyMeshComesBackAndTheSpecificationReadsTheSame, ()) {
  const Mesh mesh = any_mesh();
  const std::vector<DgfBlock> blocks = encode_dgf_blocks(mesh.lattice, mesh.points, mesh.triangles);
  RC_ASSERT(comes_back(mesh, blocks, [](const DgfBlock& block) {
    const std::optional<DecodedDgfBlock> decoded = decode_dgf_block(block.bytes);
    return decoded ? Plain{decoded->positions, decoded->triangles} : Plain{};
  }));
  RC_ASSERT(comes_back(mesh, blocks, [](const DgfBlock& block) { return decode_by_hand(block.bytes); }));
  std::uint32_t first = 0;
  for (const DgfBlock& block : blocks) {
    RC_ASSERT(decode_dgf_block(block.bytes)->first_triangle == first);
    first += static_cast<std::uint32_t>(block.triangles.size());
  }
}

TEST(DgfBlockTwin, DecodersThatMistakeTheFormatAreCaught) {
  Mesh mesh;
  for (int v = 0; v < 64; ++v) mesh.points.push_back({v % 8, v / 8, v * v % 7});
  for (std::uint8_t v = 0; v < 55; ++v)
    if (v % 8 < 7) {
      const auto at = [&](int further) { return static_cast<std::uint8_t>(v + further); };
      mesh.triangles.push_back({v, at(1), at(9)});
      mesh.triangles.push_back({v, at(9), at(8)});
    }
  const std::vector<DgfBlock> blocks = encode_dgf_blocks(mesh.lattice, mesh.points, mesh.triangles);
  const auto with = [&](Mistake mistake) {
    return comes_back(mesh, blocks, [&](const DgfBlock& block) { return decode_by_hand(block.bytes, mistake); });
  };
  EXPECT_TRUE(with(Mistake::kNone));
  EXPECT_FALSE(with(Mistake::kEdgesKeepTheirDirection));
  EXPECT_FALSE(with(Mistake::kBacktracksTakeTheSameEdge));
  EXPECT_FALSE(with(Mistake::kFirstUsesFromLowBits));
}

TEST(DgfBlock, DGF3ThreeVerticesOfALatticeAlwaysFit) {
  for (const std::int32_t low : {-(1 << 23), 0, (1 << 23) - 65535}) {
    const std::vector<LatticePoint> points = {
        {low, low, low}, {low + 65535, low, low}, {low, low + 65535, low + 65535}};
    const std::vector<LocalTriangle> triangles = {{2, 0, 1}};
    EXPECT_EQ(encode_dgf_blocks({}, points, triangles).size(), 1u) << low;
  }
}

// ---- Any bytes --------------------------------------------------------------------------------------------------

// The bytes lie in a heap block of their own, so that the address sanitizer sees reads beyond them.
void expect_sound_or_refused(const Bytes& bytes) {
  const std::unique_ptr<std::uint8_t[]> alone(new std::uint8_t[kDgfBlockBytes]);
  std::copy(bytes.begin(), bytes.end(), alone.get());
  const std::optional<DecodedDgfBlock> block = decode_dgf_block({alone.get(), kDgfBlockBytes});
  if (!block) return;
  ASSERT_GE(block->triangles.size(), 1u);
  for (const LocalTriangle& triangle : block->triangles)
    for (const std::uint8_t corner : triangle) ASSERT_LT(corner, block->positions.size());
}

TEST(DgfBlock, DGF2AnyBytesGiveVerticesThatExistOrNothing) {
  Random random(1);
  std::size_t decoded = 0;
  for (int trial = 0; trial < 100'000; ++trial) {
    Bytes bytes(kDgfBlockBytes);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random.integer(0, 255));
    if (trial % 8 != 0) {  // a header that may stand
      bytes[0] = 6, bytes[2] &= 0x3f, bytes[3] = 0, bytes[4] = 100, bytes[12] &= 0x0f, bytes[19] &= 0x1f;
      if (random.coin()) bytes[2] &= 7, bytes[1] &= 0x1f;
      if (random.coin()) bytes[8] &= 0x33, bytes[12] &= 3;
    }
    expect_sound_or_refused(bytes);
    decoded += decode_dgf_block(bytes).has_value() ? 1 : 0;
  }
  EXPECT_GT(decoded, 100u);
}

RC_GTEST_PROP(DgfBlockProperty, DGF2DamagedBlocksGiveVerticesThatExistOrNothing, ()) {
  const Mesh mesh = any_mesh();
  for (const DgfBlock& block : encode_dgf_blocks(mesh.lattice, mesh.points, mesh.triangles)) {
    Bytes bytes(block.bytes.begin(), block.bytes.end());
    for (int flips = *rc::gen::inRange(1, 4); flips > 0; --flips) {
      const auto bit = *rc::gen::inRange<std::size_t>(0, 1024);
      bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ 1u << bit % 8);
    }
    expect_sound_or_refused(bytes);
  }
}

}  // namespace
}  // namespace tessera::scene::dgf_block_test

#include <half.h>
#include <rapidcheck/gtest.h>
#include <random>

#include "tests/support/tests.h"
#include "tilecore/resolve/frame_compression.h"

namespace tessera::tilecore::frame_compression_test {
namespace {

using Halves = std::vector<std::uint16_t>;

struct Shape {
  int width;
  std::size_t burst_bytes;
};
constexpr Shape kShapes[] = {{4, 16}, {4, 32}, {4, 64}, {8, 32}, {8, 64}, {16, 32}, {16, 64}};

std::size_t raw_size(const Shape& shape) { return static_cast<std::size_t>(shape.width * 4 * 8); }

// All that FC1 and FC2 ask of a block; returns its bytes.
std::size_t round_trip(const Halves& halves, const Shape& shape) {
  const CompressedBlock block = compress_block(halves, shape.width, 4, shape.burst_bytes);
  Halves back(halves.size(), 0xdead);
  decompress_block(block, shape.width, 4, back);
  EXPECT_EQ(back, halves);
  EXPECT_EQ(block.payload_bytes % shape.burst_bytes, 0u);
  EXPECT_LE(block.payload_bytes, raw_size(shape));
  EXPECT_LE(block.stream_bits, 8 * block.payload_bytes);
  EXPECT_EQ(compressed_block_bytes(halves, shape.width, 4, shape.burst_bytes), block.payload_bytes);
  EXPECT_EQ(block.raw, block.payload_bytes == raw_size(shape));
  return block.payload_bytes;
}

template <class Value>
Halves make_block(const Shape& shape, const Value& value) {
  Halves halves;
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < shape.width; ++x)
      for (int c = 0; c < 4; ++c) halves.push_back(value(x, y, c));
  return halves;
}

// Bits of every kind: any, few low bits around a value, special ones.
RC_GTEST_PROP(FrameCompression, DecodesToTheSameBitsAndIsNeverLargerThanThePixels, (std::uint32_t seed)) {  // FC1, FC2
  std::mt19937 random(seed);
  constexpr std::uint16_t kSpecial[] = {0, 0x8000, 0x7c00, 0xfc00, 0x7e00, 0xffff, 0x7c01,
                                        1, 0x8001, 0x03ff, 0x0400, 0x7bff, 0xfbff, 0x3c00};
  for (const Shape& shape : kShapes) {
    std::array<unsigned, 4> kind, base, bits;
    for (std::size_t c = 0; c < 4; ++c) kind[c] = random() % 4, base[c] = random(), bits[c] = random() % 16;
    round_trip(make_block(shape,
                          [&](int x, int y, int channel) {
                            const auto c = static_cast<std::size_t>(channel);
                            switch (kind[c]) {
                              case 0:
                                return static_cast<std::uint16_t>(random());
                              case 1:
                                return static_cast<std::uint16_t>(base[c] + (random() & ((1u << bits[c]) - 1)));
                              case 2:
                                return kSpecial[random() % std::size(kSpecial)];
                              default:
                                return static_cast<std::uint16_t>(base[c] + static_cast<unsigned>(x) * bits[c] +
                                                                  static_cast<unsigned>(y) * 3);
                            }
                          }),
               shape);
  }
}

// Blocks of fixed-point formats: any codes, slopes, few values.
RC_GTEST_PROP(FrameCompression, FixedPointPixelsDecodeToTheSameBits, (std::uint32_t seed)) {  // FC1, FC2
  std::mt19937 random(seed);
  for (const FrameFormat format : {FrameFormat::kRgba8, FrameFormat::kRgb10a2})
    for (const std::size_t burst : {16u, 32u, 64u, 128u, 256u}) {
      const BlockShape shape = stored_block(format);
      EXPECT_EQ(shape.raw_bytes(), 256u);
      const unsigned kind = random() % 4, step = random() % 7;
      std::vector<std::uint16_t> codes;
      for (std::size_t i = 0; i < 4 * shape.pixels(); ++i) {
        const std::uint32_t mask = (1u << shape.bits[i % 4]) - 1;
        const std::uint32_t value = kind == 0   ? random()
                                    : kind == 1 ? static_cast<std::uint32_t>(i / 4 % 8 * step + i / 32)
                                    : kind == 2 ? random() % 3
                                                : mask;
        codes.push_back(static_cast<std::uint16_t>(value & mask));
      }
      const CompressedBlock block = compress_block(codes, shape, burst);
      std::vector<std::uint16_t> back(codes.size(), 0xdead);
      decompress_block(block, shape, back);
      EXPECT_EQ(back, codes);
      EXPECT_EQ(block.payload_bytes % burst, 0u);
      EXPECT_LE(block.payload_bytes, shape.raw_bytes());
      EXPECT_EQ(compressed_block_bytes(codes, shape, burst), block.payload_bytes);
      EXPECT_EQ(block.raw, block.payload_bytes == shape.raw_bytes());
      if (kind == 3) {
        EXPECT_LE(block.payload_bytes, std::max<std::size_t>(burst, 16 + burst));
      }
    }
}

// All halves, and floats around each.
TEST(FrameCompression, AHalfDecodesByItsCode) {
  for (std::uint32_t high = 0; high < 0x10000; ++high)
    for (const std::uint32_t low : {0x0000u, 0x0001u, 0x0fffu, 0x1000u, 0x1001u, 0x3000u, 0xffffu}) {
      const auto value = std::bit_cast<float>(high << 16 | low);
      Vec4 stored;
      as_halves(std::array{Vec4(value, 0, 1, value)}, &stored);
      ASSERT_EQ(half_bits(stored.x), half_bits(value)) << value;
      ASSERT_EQ(stored.y, 0.0f);
      if (std::isnan(value)) continue;
      // A half times 2^24 is a whole number, and the nearest one is no farther than half of a step.
      ASSERT_TRUE(std::isinf(stored.x) || stored.x * 16777216.0f == std::trunc(stored.x * 16777216.0f)) << value;
      Vec4 again;
      as_halves(std::array{stored}, &again);
      ASSERT_EQ(std::bit_cast<std::uint32_t>(again.x), std::bit_cast<std::uint32_t>(stored.x));
    }
}

TEST(FrameCompression, NoiseIsKeptRawAndSpecialValuesSurvive) {
  std::mt19937 random(1);
  for (const Shape& shape : kShapes) {
    EXPECT_EQ(round_trip(make_block(shape, [&](int, int, int) { return static_cast<std::uint16_t>(random()); }), shape),
              raw_size(shape));
    for (const std::uint16_t special : {0x7c00, 0xfc00, 0x7e55, 0xfdff, 0x8000}) {
      EXPECT_LE(round_trip(make_block(shape, [&](int, int, int) { return special; }), shape),
                std::max<std::size_t>(shape.burst_bytes, 32));
      round_trip(
          make_block(shape, [&](int x, int y,
                                int) { return static_cast<std::uint16_t>((x + y) % 3 == 0 ? special : 0x3c00); }),
          shape);
    }
  }
}

TEST(FrameCompression, ClearedBlocksTakeNothingAndFlatOnesABurst) {  // FC3
  for (const Shape& shape : kShapes) {
    EXPECT_EQ(round_trip(make_block(shape, [](int, int, int) { return std::uint16_t{0}; }), shape), 0u);
    EXPECT_EQ(round_trip(make_block(shape, [](int, int, int c) { return static_cast<std::uint16_t>(0x3a57 + 77 * c); }),
                         shape),
              shape.burst_bytes);
    // The failing twin: -0 is not cleared.
    EXPECT_GT(
        round_trip(make_block(shape, [](int, int, int c) { return static_cast<std::uint16_t>(c == 1 ? 0x8000 : 0); }),
                   shape),
        0u);
  }
}

TEST(FrameCompression, AGradientTakesAtMostHalf) {
  for (const Shape& shape : kShapes) {
    const auto gradient = [](int x, int y, int c) {
      return c == 3 ? half_bits(1.0f)
                    : half_bits(0.3f + 0.01f * static_cast<float>((c + 1) * x) + 0.007f * static_cast<float>(y));
    };
    EXPECT_LE(round_trip(make_block(shape, gradient), shape), raw_size(shape) / 2);
  }
}

TEST(FrameCompression, AcrossZeroValuesAreNeighbours) {
  // 2^-24 .. and their negatives: halves' bits jump by 2^15 between -0 and 0.
  const Shape shape{4, 16};
  const auto around_zero = [](int x, int y, int) {
    return half_bits(std::ldexp(static_cast<float>(x + 4 * y - 8), -24));
  };
  EXPECT_LE(round_trip(make_block(shape, around_zero), shape), 48u);
}

TEST(FrameCompression, AWrongBitIsAnotherImage) {
  const Shape shape{4, 16};
  const Halves halves =
      make_block(shape, [](int x, int y, int c) { return half_bits(static_cast<float>(1 + x * y + c)); });
  const CompressedBlock block = compress_block(halves, 4, 4, 16);
  ASSERT_FALSE(block.raw);
  int same = 0;
  // The widths say how the rest is read, so only values are flipped: the first pixel's, bits 2 to 17.
  for (std::size_t bit = 2; bit < 18; ++bit) {
    CompressedBlock wrong = block;
    wrong.payload[bit / 8] ^= static_cast<std::uint8_t>(1u << (bit % 8));
    Halves back(halves.size());
    decompress_block(wrong, 4, 4, back);
    same += back == halves;
  }
  EXPECT_EQ(same, 0);
}

TEST(FrameCompression, OddShapesAreRefused) {
  Halves halves(4 * 5 * 4);
  EXPECT_DEATH(compress_block(halves, 5, 4, 32), "4, 8 or 16 pixels wide");
  EXPECT_DEATH(compress_block(std::span(halves).first(60), 4, 4, 32), "four halves");
  EXPECT_DEATH(compressed_block_bytes(std::span(halves).first(64), 4, 4, 48), "whole bursts");
}

TEST(FrameCompression, HeadersAreWholeBursts) {
  EXPECT_EQ(block_header_bytes(0, 64), 0u);
  EXPECT_EQ(block_header_bytes(1, 64), 64u);
  EXPECT_EQ(block_header_bytes(64, 64), 64u);
  EXPECT_EQ(block_header_bytes(65, 64), 128u);
}

TEST(HalfBits, AreOpenExrsForEveryHalfItsNeighboursAndTheMiddlesBetween) {
  for (std::uint32_t bits = 0; bits < 0x10000; ++bits) {
    half h;
    h.setBits(static_cast<std::uint16_t>(bits));
    const float value = h;
    if (std::isnan(value)) {
      EXPECT_EQ(half_bits(value) & 0x7c00, 0x7c00);
      EXPECT_NE(half_bits(value) & 0x03ff, 0);
      continue;
    }
    const float next = half(std::nextafter(value, std::numeric_limits<float>::infinity()));
    for (const float v : {value, std::nextafter(value, std::numeric_limits<float>::infinity()),
                          std::nextafter(value, -std::numeric_limits<float>::infinity()), next})
      EXPECT_EQ(half_bits(v), half(v).bits()) << v;
    half after;
    after.setBits(static_cast<std::uint16_t>(bits + 1));
    if ((bits & 0x7fff) >= 0x7bff) continue;
    const float middle = 0.5f * (value + static_cast<float>(after));
    for (const float v : {middle, std::nextafter(middle, 1e30f), std::nextafter(middle, -1e30f)})
      EXPECT_EQ(half_bits(v), half(v).bits()) << v;
  }
  for (const float v : {65519.0f, 65519.996f, 65520.0f, 65536.0f, 1e30f, 1e-30f, 0x1p-25f, 0x1.000002p-25f, -0x1p-25f,
                        -1e30f, std::numeric_limits<float>::infinity()})
    EXPECT_EQ(half_bits(v), half(v).bits()) << v;
}

}  // namespace
}  // namespace tessera::tilecore::frame_compression_test

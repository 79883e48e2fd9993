// The parts of KTX2 textures: Huffman codes, blocks of ETC2, EAC and ASTC.
#include <astcenc.h>
#include <rapidcheck/gtest.h>

#include "base/ktx2/astc_block.h"
#include "base/ktx2/astc_fit.h"
#include "base/ktx2/etc1s.h"
#include "base/ktx2/etc2_fit.h"
#include "base/ktx2/huffman.h"
#include "base/random.h"
#include "base/sha256.h"
#include "tests/support/tests.h"

namespace tessera::ktx2::ktx2_blocks_test {
namespace {

// Numbers that follow from a seed.
class Numbers {
 public:
  explicit Numbers(std::uint32_t seed) : state_(seed) {}
  int below(int end) { return static_cast<int>(mix32(++state_) % static_cast<std::uint32_t>(end)); }
  std::uint8_t byte() { return static_cast<std::uint8_t>(below(256)); }

 private:
  std::uint32_t state_;
};

// ---- Huffman codes ----------------------------------------------------------------------------------------------

// Lengths of a complete code: leaves of a tree that are split until there are `count`.
std::vector<std::uint8_t> complete_lengths(int count, Numbers& numbers) {
  std::vector<std::uint8_t> lengths(1, 0);
  while (static_cast<int>(lengths.size()) < count) {
    std::uint8_t& leaf = lengths[static_cast<std::size_t>(numbers.below(static_cast<int>(lengths.size())))];
    if (leaf == HuffmanCode::kMaxLength) continue;
    const auto length = static_cast<std::uint8_t>(leaf + 1);
    leaf = length;
    lengths.push_back(length);
  }
  return lengths;
}

RC_GTEST_PROP(Huffman, CompleteCodesAreAcceptedAndGiveTheirSymbols, (std::uint32_t seed)) {  // HU1
  Numbers numbers(seed);
  std::vector<std::uint8_t> lengths = complete_lengths(2 + numbers.below(200), numbers);
  HuffmanCode code;
  RC_ASSERT(code.build(lengths));
  // Codes by RFC 1951, 3.2.2, written with their first bit first.
  std::vector<std::uint32_t> next(HuffmanCode::kMaxLength + 2);
  for (unsigned length = 1; length <= HuffmanCode::kMaxLength; ++length)
    next[length + 1] =
        2 * (next[length] + static_cast<std::uint32_t>(std::count(lengths.begin(), lengths.end(), length)));
  std::vector<std::uint8_t> bytes;
  unsigned at = 0;
  for (const std::uint8_t length : lengths) {
    const std::uint32_t bits = next[length]++;
    for (unsigned i = length; i-- > 0; ++at) {
      if (at % 8 == 0) bytes.push_back(0);
      bytes.back() = static_cast<std::uint8_t>(bytes.back() | (((bits >> i) & 1u) << (at % 8)));
    }
  }
  BitReader reader(bytes);
  for (std::uint32_t symbol = 0; symbol < lengths.size(); ++symbol) RC_ASSERT(code.decode(reader) == symbol);
  RC_ASSERT(!reader.overrun());
}

RC_GTEST_PROP(Huffman, IncompleteAndOverfullCodesAreRefused, (std::uint32_t seed)) {  // HU1's twin
  Numbers numbers(seed);
  std::vector<std::uint8_t> lengths = complete_lengths(3 + numbers.below(200), numbers);
  HuffmanCode code;
  std::uint8_t& changed = lengths[static_cast<std::size_t>(numbers.below(static_cast<int>(lengths.size())))];
  changed = static_cast<std::uint8_t>(numbers.below(2) == 0 || changed == 1 ? changed + 1 : changed - 1);
  RC_ASSERT(!code.build(lengths));
}

TEST(Huffman, ASingleSymbolAndNoneAreCodes) {  // HU1
  HuffmanCode code;
  const std::uint8_t zeros[] = {0}, ones[] = {0xFF};
  ASSERT_TRUE(code.build({0, 0, 3}));
  BitReader sound(zeros), damaged(ones);
  EXPECT_EQ(code.decode(sound), 2u);
  EXPECT_EQ(code.decode(damaged), HuffmanCode::kNone);
  ASSERT_TRUE(code.build({0, 0}));
  BitReader empty(zeros);
  EXPECT_EQ(code.decode(empty), HuffmanCode::kNone);
  EXPECT_FALSE(code.build({1, 1, 17}));
}

TEST(BitReader, GivesZerosBehindTheEndAndRemembersIt) {
  const std::uint8_t bytes[] = {0xB5, 0x01};
  BitReader reader(bytes);
  EXPECT_EQ(reader.bits(3), 5u);
  EXPECT_EQ(reader.bits(13), 0x36u);
  EXPECT_FALSE(reader.overrun());
  EXPECT_EQ(reader.bits(1), 0u);
  EXPECT_TRUE(reader.overrun());
}

// ---- ETC2 and EAC -----------------------------------------------------------------------------------------------

Rgb random_color(Numbers& numbers, int bits) {
  return {numbers.below(1 << bits), numbers.below(1 << bits), numbers.below(1 << bits)};
}
TexelIndices random_indices(Numbers& numbers, int end) {
  TexelIndices indices;
  for (std::uint8_t& index : indices) index = static_cast<std::uint8_t>(numbers.below(end));
  return indices;
}
Rgb rgb_of(const TexelBlock& texels, unsigned texel) { return {texels[texel][0], texels[texel][1], texels[texel][2]}; }

RC_GTEST_PROP(Etc2Block, PaintedBlocksDecodeToTheirColours, (std::uint32_t seed)) {
  Numbers numbers(seed);
  EtcPaint paint{{random_color(numbers, 4), random_color(numbers, 4)}, numbers.below(8), random_indices(numbers, 4)};
  TexelBlock texels{};
  decode_etc2_rgb(pack_etc2_t(paint), texels);
  for (unsigned t = 0; t < 16; ++t) RC_ASSERT(rgb_of(texels, t) == etc2_t_colors(paint)[paint.indices[t]]);
  if (paint.color[0] == paint.color[1]) paint.color[0][1] ^= 1;
  decode_etc2_rgb(pack_etc2_h(paint), texels);
  for (unsigned t = 0; t < 16; ++t) RC_ASSERT(rgb_of(texels, t) == etc2_h_colors(paint)[paint.indices[t]]);
}

RC_GTEST_PROP(Etc2Block, PlanesAndHalvesDecodeToTheirColours, (std::uint32_t seed)) {
  Numbers numbers(seed);
  EtcPlane plane{random_color(numbers, 6), random_color(numbers, 6), random_color(numbers, 6)};
  plane.origin[1] = 2 * plane.origin[1] + 1;
  TexelBlock texels{};
  decode_etc2_rgb(pack_etc2_plane(plane), texels);
  for (int t = 0; t < 16; ++t)
    for (std::size_t c = 0; c < 3; ++c)
      RC_ASSERT(texels[static_cast<std::size_t>(t)][c] == etc2_plane_value(plane, c, t % 4, t / 4));

  EtcHalves halves;
  halves.differential = numbers.below(2) == 0;
  halves.flip = numbers.below(2) == 0;
  halves.table = {numbers.below(8), numbers.below(8)};
  halves.indices = random_indices(numbers, 4);
  const int bits = halves.differential ? 5 : 4;
  halves.base = {random_color(numbers, bits), random_color(numbers, bits)};
  if (halves.differential)
    for (std::size_t c = 0; c < 3; ++c) halves.base[1][c] = std::clamp(halves.base[0][c] + numbers.below(8) - 4, 0, 31);
  decode_etc2_rgb(pack_etc1(halves), texels);
  for (unsigned t = 0; t < 16; ++t) {
    const unsigned half = etc_half(halves.flip, t);
    const int step = kEtc1Modifiers[static_cast<std::size_t>(halves.table[half])][halves.indices[t] & 1u];
    for (std::size_t c = 0; c < 3; ++c)
      RC_ASSERT(texels[t][c] ==
                std::clamp(widen_bits(halves.base[half][c], bits) + (halves.indices[t] < 2 ? step : -step), 0, 255));
  }
}

// 4096 blocks of any bytes; Mesa's decoder, which was asked once, gives the texels of the same hash.
TEST(Etc2Block, AnyBytesDecodeAsInMesa) {
  Sha256 hash;
  std::uint32_t state = 0;
  for (int block = 0; block < 4096; ++block) {
    std::array<std::uint8_t, 16> bytes;
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(mix32(++state));
    TexelBlock texels{};
    decode_eac_alpha(std::span(bytes).first<8>(), texels);
    decode_etc2_rgb(std::span(bytes).last<8>(), texels);
    for (const auto& texel : texels) hash.add(texel);
  }
  EXPECT_EQ(hash.finish(), "b8fbc93b5615a66790c8db4bfd3e3911c1fa499b921f55b69a1c79ba372b504f");
}

int error_of(const TexelBlock& a, const TexelBlock& b) {
  int sum = 0;
  for (std::size_t t = 0; t < 16; ++t)
    for (std::size_t c = 0; c < 3; ++c) sum += (a[t][c] - b[t][c]) * (a[t][c] - b[t][c]);
  return sum;
}

TEST(Etc2Fit, BlocksThatEtc2HoldsComeBackNearly) {
  // A plane, two colours, and halves of greys, each as ETC2 has them: four steps off in every channel at most, squared.
  Numbers numbers(7);
  for (int trial = 0; trial < 300; ++trial) {
    TexelBlock wanted{}, got{};
    if (trial % 3 == 0) {
      decode_etc2_rgb(pack_etc2_plane({random_color(numbers, 6), random_color(numbers, 6), random_color(numbers, 6)}),
                      wanted);
    } else if (trial % 3 == 1) {
      EtcPaint paint{{random_color(numbers, 4), random_color(numbers, 4)}, 0, random_indices(numbers, 4)};
      decode_etc2_rgb(pack_etc2_t(paint), wanted);
    } else {
      const int level = numbers.below(32);
      EtcHalves halves{
          true, false, {{{level, level, level}, {level, level, level}}}, {2, 2}, random_indices(numbers, 4)};
      decode_etc2_rgb(pack_etc1(halves), wanted);
    }
    decode_etc2_rgb(fit_etc2_rgb(wanted), got);
    EXPECT_LE(error_of(wanted, got), 16 * 48) << trial;
  }
}

TEST(Etc2Fit, AlphaOfOneValueIsKept) {  // EA1
  for (int value = 0; value < 256; ++value) {
    const std::array<std::uint8_t, 16> values = [&] {
      std::array<std::uint8_t, 16> all;
      all.fill(static_cast<std::uint8_t>(value));
      return all;
    }();
    TexelBlock texels{};
    decode_eac_alpha(pack_eac(fit_eac(values)), texels);
    for (const auto& texel : texels) ASSERT_EQ(texel[3], value);
    // The twin: a multiplier of 1 with another index is another value.
    EacValues other = fit_eac(values);
    other.indices.fill(value < 128 ? 7 : 3);
    decode_eac_alpha(pack_eac(other), texels);
    EXPECT_NE(texels[0][3], value);
  }
}

// ---- ASTC -------------------------------------------------------------------------------------------------------

TEST(AstcNumbers, SequencesComeBackForEveryRangeAndLength) {
  Numbers numbers(3);
  for (const AstcRange& range : kAstcRanges)
    for (unsigned count = 1; count <= 32; ++count) {
      if (range.sequence_bits(count) > 100) continue;
      std::vector<std::uint8_t> values(count), back(count);
      for (std::uint8_t& value : values) value = static_cast<std::uint8_t>(numbers.below(range.levels()));
      AstcBytes bytes{};
      put_sequence(bytes, 20, range, values);
      EXPECT_EQ(get_bits(bytes, 0, 20), 0u);
      for (unsigned at = 20 + range.sequence_bits(count); at < 128; ++at) EXPECT_EQ(get_bits(bytes, at, 1), 0u);
      get_sequence(bytes, 20, range, back);
      EXPECT_EQ(back, values) << range.levels() << " levels, " << count << " values";
    }
}

// A block of any of UASTC's modes.
AstcBlock random_block(Numbers& numbers, bool& sound) {
  AstcBytes bytes;
  for (std::uint8_t& byte : bytes) byte = numbers.byte();
  AstcBlock block;
  sound = read_uastc(bytes, block);
  if (block.components == 3) block.plane_channel %= 3;
  return block;
}

RC_GTEST_PROP(AstcBlock, PackedBlocksDecodeToTheirTexels, (std::uint32_t seed)) {  // AB1
  Numbers numbers(seed);
  bool sound = false;
  const AstcBlock block = random_block(numbers, sound);
  RC_PRE(sound);
  for (const bool srgb : {false, true}) {
    TexelBlock wanted{}, got{};
    astc_texels(block, srgb, wanted);
    RC_ASSERT(decode_astc(pack_astc(block), srgb, got));
    RC_ASSERT(got == wanted);
  }
}

TEST(AstcBlock, AnotherWeightGivesOtherTexels) {  // the twin of AB1
  AstcBlock block;
  for (std::size_t i = 0; i < block.endpoint_count(); ++i)
    block.endpoints[i] = static_cast<std::uint8_t>(200 * (i % 2));
  TexelBlock wanted{}, got{};
  astc_texels(block, false, wanted);
  for (std::size_t i = 0; i < block.weight_count(); ++i) {
    AstcBlock other = block;
    other.weights[i] = 1;
    ASSERT_TRUE(decode_astc(pack_astc(other), false, got));
    EXPECT_NE(got, wanted) << i;
  }
  AstcBytes bytes = pack_astc(block);
  bytes[1] ^= 0x20;  // another endpoint mode, which is never packed
  EXPECT_FALSE(decode_astc(bytes, false, got));
}

// libastcenc's decoder of a row of blocks.
std::vector<std::uint8_t> by_astcenc(const std::vector<AstcBytes>& blocks, bool srgb) {
  astcenc_config config{};
  EXPECT_EQ(astcenc_config_init(srgb ? ASTCENC_PRF_LDR_SRGB : ASTCENC_PRF_LDR, 4, 4, 1, ASTCENC_PRE_FASTEST,
                                ASTCENC_FLG_DECOMPRESS_ONLY, &config),
            ASTCENC_SUCCESS);
  astcenc_context* context = nullptr;
  EXPECT_EQ(astcenc_context_alloc(&config, 1, &context), ASTCENC_SUCCESS);
  const std::unique_ptr<astcenc_context, decltype(&astcenc_context_free)> guard(context, astcenc_context_free);
  std::vector<std::uint8_t> texels(64 * blocks.size());
  void* rows[] = {texels.data()};
  astcenc_image image{static_cast<unsigned>(4 * blocks.size()), 4, 1, ASTCENC_TYPE_U8, rows};
  const astcenc_swizzle swizzle{ASTCENC_SWZ_R, ASTCENC_SWZ_G, ASTCENC_SWZ_B, ASTCENC_SWZ_A};
  EXPECT_EQ(astcenc_decompress_image(context, blocks[0].data(), 16 * blocks.size(), &image, &swizzle, 0),
            ASTCENC_SUCCESS);
  return texels;
}

TEST(AstcBlock, DecodesAsLibastcencDoes) {  // AB2
  Numbers numbers(11);
  std::vector<AstcBytes> packed;
  while (packed.size() < 2000) {
    bool sound = false;
    AstcBlock block = random_block(numbers, sound);
    if (!sound) continue;
    // The ranges of fits, too.
    const AstcFitRanges fits[] = {kRgbFit, kRgbaFit, kTwoPlaneFit4, kTwoPlaneFit3, kTwoPlaneFit2, kGreyAlphaFit};
    if (packed.size() % 3 == 0) {
      const std::size_t which = packed.size() / 3 % 6;
      block = AstcBlock{};
      block.components = which == 0 ? 3 : which == 5 ? 2 : 4;
      block.planes = which < 2 ? 1 : 2;
      block.plane_channel = 3;
      block.weight_range = fits[which].weights;
      block.endpoint_range = fits[which].endpoints;
      for (std::size_t i = 0; i < block.endpoint_count(); ++i)
        block.endpoints[i] = static_cast<std::uint8_t>(numbers.below(block.endpoint_range.levels()));
      for (std::size_t i = 0; i < block.weight_count(); ++i)
        block.weights[i] = static_cast<std::uint8_t>(numbers.below(block.weight_range.levels()));
    }
    packed.push_back(pack_astc(block));
  }
  for (const bool srgb : {false, true}) {
    const std::vector<std::uint8_t> wanted = by_astcenc(packed, srgb);
    int max_color = 0, max_alpha = 0, twin = 0;
    for (std::size_t b = 0; b < packed.size(); ++b) {
      TexelBlock texels{}, other{};
      ASSERT_TRUE(decode_astc(packed[b], srgb, texels));
      ASSERT_TRUE(decode_astc(packed[b], !srgb, other));
      for (std::size_t t = 0; t < 16; ++t)
        for (std::size_t c = 0; c < 4; ++c) {
          const int value = wanted[4 * (t / 4 * 4 * packed.size() + 4 * b + t % 4) + c];
          int& most = c < 3 ? max_color : max_alpha;
          most = std::max(most, std::abs(value - texels[t][c]));
          if (c < 3) twin += value != other[t][c] ? 1 : 0;
        }
    }
    EXPECT_LE(max_color, srgb ? 0 : 1);
    EXPECT_LE(max_alpha, 1);
    EXPECT_GT(twin, 1000);  // read by the other rule they are others
  }
}

TEST(AstcFit, TwoColoursAreKeptAndFourAreNear) {
  Numbers numbers(5);
  for (int trial = 0; trial < 200; ++trial) {
    const Etc1sEndpoint endpoint{static_cast<std::uint8_t>(numbers.below(32)),
                                 static_cast<std::uint8_t>(numbers.below(32)),
                                 static_cast<std::uint8_t>(numbers.below(32)), static_cast<std::uint8_t>(trial % 8)};
    const auto colors = etc1s_colors(endpoint);
    const auto two = fit_astc(colors, 0b1010, 3, kRgbFit).errors;
    EXPECT_EQ(two[1] + two[3], 0) << trial;
    // Where nothing is clamped four colours lie on a line.
    const bool line = colors[0][0] > 0 && colors[0][1] > 0 && colors[0][2] > 0 && colors[3][0] < 255 &&
                      colors[3][1] < 255 && colors[3][2] < 255;
    const auto four = fit_astc(colors, 0b1111, 3, kRgbFit).errors;
    const int range = 2 * kEtc1Modifiers[endpoint.table][1];
    if (line) {
      EXPECT_LE(four[0] + four[1] + four[2] + four[3], 12 * (range * range / 2500 + 1)) << trial;
    }
  }
}

}  // namespace
}  // namespace tessera::ktx2::ktx2_blocks_test

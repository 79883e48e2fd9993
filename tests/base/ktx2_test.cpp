// KTX2 textures as a whole. tests/base/data has files that Basis Universal's encoder wrote from generated images, and
// the output of its transcoder for them; tests/README.md says how both were made.
#include <rapidcheck/gtest.h>

#include "base/error.h"
#include "base/ktx2/astc_block.h"
#include "base/ktx2/container.h"
#include "base/ktx2/etc1s.h"
#include "base/parallel.h"
#include "base/random.h"
#include "base/sha256.h"
#include "tests/support/heap_meter.h"
#include "tests/support/tests.h"

namespace tessera::ktx2::ktx2_test {
namespace {

using Bytes = std::vector<std::uint8_t>;

const fs::path kData = fs::path(TESSERA_SOURCE_DIR) / "tests" / "base" / "data";
constexpr BasisTarget kTargets[] = {BasisTarget::kRgba32, BasisTarget::kAstc4x4};

Bytes file_bytes(const std::string& name) {
  const std::string text = test::read_text(kData / (name + ".ktx2"));
  return {text.begin(), text.end()};
}

// A line of expected.txt: hashes over all levels of the transcoder's RGBA32 and, of UASTC, of its ASTC blocks.
struct Expected {
  std::string name;
  std::size_t levels = 0;
  std::string rgba, astc;
};
std::vector<Expected> expected_files() {
  std::vector<Expected> all;
  std::istringstream stream(test::read_text(kData / "expected.txt"));
  for (Expected one; stream >> one.name >> one.levels >> one.rgba >> one.astc;) all.push_back(one);
  return all;
}

struct Answer {
  bool accepted = false;
  BasisTexture texture;
  std::string fault;
  std::uint64_t charged = 0;
};

// From a block of exactly the file's size, so that the sanitizers see a byte read behind it.
Answer decode(const Bytes& file, BasisTarget target, const ImageLimits& limits = {}) {
  const Bytes exact(file.begin(), file.end());
  Answer answer;
  answer.accepted = decode_ktx2(exact, target, limits, answer.texture, answer.fault,
                                [&](std::uint64_t bytes) { answer.charged = bytes; });
  EXPECT_EQ(answer.accepted, answer.fault.empty());
  return answer;
}

BasisTexture texture_of(const std::string& name, BasisTarget target) {
  Answer answer = decode(file_bytes(name), target);
  EXPECT_TRUE(answer.accepted) << name << ": " << answer.fault;
  return std::move(answer.texture);
}

std::string hash_of(const BasisTexture& texture, std::vector<std::uint8_t> BasisLevel::*part) {
  Sha256 hash;
  for (const BasisLevel& level : texture.levels) hash.add(level.*part);
  return hash.finish();
}

void put32(Bytes& bytes, std::size_t at, std::uint32_t value) {
  for (std::size_t i = 0; i < 4; ++i) bytes[at + i] = static_cast<std::uint8_t>(value >> (8 * i));
}
std::uint32_t word32(const Bytes& bytes, std::size_t at) {
  return bytes[at] | (std::uint32_t{bytes[at + 1]} << 8) | (std::uint32_t{bytes[at + 2]} << 16) |
         (std::uint32_t{bytes[at + 3]} << 24);
}

// ---- Sound files ------------------------------------------------------------------------------------------------

TEST(Ktx2, TexelsHaveTheBitsOfTheReferenceTranscoder) {  // KT1
  const std::vector<Expected> files = expected_files();
  ASSERT_GE(files.size(), 30u);
  for (const Expected& file : files) {
    const BasisTexture texture = texture_of(file.name, BasisTarget::kRgba32);
    EXPECT_EQ(texture.levels.size(), file.levels) << file.name;
    EXPECT_EQ(hash_of(texture, &BasisLevel::texels), file.rgba) << file.name;
  }
}

TEST(Ktx2, AChangedBlockHasOtherBits) {  // the twin of KT1
  for (const Expected& file : expected_files()) {
    if (!file.name.starts_with("uastc_modes")) continue;
    Bytes bytes = file_bytes(file.name);
    bytes[bytes.size() - 3] ^= 0x10;
    const Answer answer = decode(bytes, BasisTarget::kRgba32);
    EXPECT_NE(hash_of(answer.texture, &BasisLevel::texels), file.rgba) << file.name;
  }
}

TEST(Ktx2, UastcBecomesTheAstcBlocksOfTheReferenceTranscoder) {
  for (const Expected& file : expected_files()) {
    if (file.astc != "-") {
      EXPECT_EQ(hash_of(texture_of(file.name, BasisTarget::kAstc4x4), &BasisLevel::blocks), file.astc) << file.name;
    }
  }
}

TEST(Ktx2, EveryModeOfUastcOccursInTheFiles) {
  const Bytes file = file_bytes("uastc_modes");
  std::set<std::string> kinds;  // fields that differ between modes after parsing
  for (std::size_t at = file.size() - 19 * 32 * 16; at < file.size(); at += 16) {
    AstcBytes bytes;
    std::copy_n(file.begin() + static_cast<std::ptrdiff_t>(at), 16, bytes.begin());
    AstcBlock block;
    ASSERT_TRUE(read_uastc(bytes, block));
    const std::size_t mode = (at - (file.size() - 19 * 32 * 16)) / (32 * 16);
    EXPECT_EQ(block.solid, mode == 8);
    kinds.insert(std::to_string(block.solid) + " " + std::to_string(block.components) + std::to_string(block.subsets) +
                 std::to_string(block.planes) + " " + std::to_string(block.weight_range.levels()) + " " +
                 std::to_string(block.endpoint_range.levels()));
  }
  EXPECT_EQ(kinds.size(), 18u);  // 4 and 7 differ in their patterns alone
}

// Decodes the blocks in memory one by one.
std::vector<std::uint8_t> texels_of_blocks(const BasisTexture& texture, const BasisLevel& level) {
  std::vector<std::uint8_t> texels(level.texels.size());
  const int columns = (level.width + 3) / 4;
  for (std::size_t b = 0; b * texture.block_bytes < level.blocks.size(); ++b) {
    const std::uint8_t* bytes = level.blocks.data() + b * texture.block_bytes;
    TexelBlock block;
    AstcBytes packed;
    std::copy_n(bytes, 16, packed.begin());
    EXPECT_TRUE(decode_astc(packed, texture.srgb, block));
    for (int t = 0; t < 16; ++t) {
      const int x = static_cast<int>(b) % columns * 4 + t % 4, y = static_cast<int>(b) / columns * 4 + t / 4;
      if (x < level.width && y < level.height)
        std::copy_n(block[static_cast<std::size_t>(t)].begin(), 4, texels.begin() + 4 * (y * level.width + x));
    }
  }
  return texels;
}

TEST(Ktx2, TexelsEqualTheDecodedBlocks) {  // KT2
  for (const Expected& file : expected_files()) {
    const BasisTexture texture = texture_of(file.name, BasisTarget::kAstc4x4);
    EXPECT_EQ(texture.block_bytes, 16u);
    for (const BasisLevel& level : texture.levels) {
      EXPECT_EQ(level.blocks.size() / texture.block_bytes,
                static_cast<std::size_t>((level.width + 3) / 4 * ((level.height + 3) / 4)));
      EXPECT_EQ(level.texels, texels_of_blocks(texture, level)) << file.name;
    }
  }
}

TEST(Ktx2, TexelsOfOtherBlocksAreToldApart) {  // the twin of KT2
  BasisTexture texture = texture_of("uastc_ramp_32", BasisTarget::kAstc4x4);
  BasisLevel& level = texture.levels[0];
  std::swap_ranges(level.blocks.begin(), level.blocks.begin() + 16, level.blocks.end() - 16);
  EXPECT_NE(level.texels, texels_of_blocks(texture, level));
}

TEST(Ktx2, LinearUastcIsAstcWithoutLoss) {  // KT2
  int count = 0;
  for (const Expected& file : expected_files()) {
    const BasisTexture plain = texture_of(file.name, BasisTarget::kRgba32);
    if (!file.name.starts_with("uastc") || plain.srgb) continue;
    const BasisTexture packed = texture_of(file.name, BasisTarget::kAstc4x4);
    EXPECT_EQ(hash_of(plain, &BasisLevel::texels), hash_of(packed, &BasisLevel::texels)) << file.name;
    ++count;
  }
  EXPECT_GE(count, 3);
}

double psnr(const BasisTexture& a, const BasisTexture& b) {
  double sum = 0, count = 0;
  for (std::size_t l = 0; l < a.levels.size(); ++l)
    for (std::size_t i = 0; i < a.levels[l].texels.size(); ++i, ++count)
      sum += std::pow(double{1} * a.levels[l].texels[i] - b.levels[l].texels[i], 2);
  return sum == 0 ? 99 : 10 * std::log10(255.0 * 255.0 * count / sum);
}

TEST(Ktx2, BlocksAreFortyDecibelsFromRgbaUnlessTheImageIsNoise) {
  for (const Expected& file : expected_files())
    // White noise in RGBA is more than two lines of ASTC hold.
    EXPECT_GE(psnr(texture_of(file.name, BasisTarget::kAstc4x4), texture_of(file.name, BasisTarget::kRgba32)),
              file.name == "etc1s_noisea_32" ? 38 : 40)
        << file.name;
}

TEST(Ktx2, TheHeadDescribesTheTexture) {
  Ktx2Header header;
  std::string fault;
  ASSERT_TRUE(read_ktx2_header(file_bytes("etc1s_cloud_mips_32x20"), {}, header, fault)) << fault;
  EXPECT_EQ(std::tuple(header.width, header.height, header.levels), std::tuple(32, 20, 6));
  EXPECT_TRUE(header.etc1s && header.srgb && header.alpha);
  ASSERT_TRUE(read_ktx2_header(file_bytes("uastc_normal_32"), {}, header, fault)) << fault;
  EXPECT_FALSE(header.etc1s || header.srgb || header.alpha);
  EXPECT_FALSE(is_ktx2(Bytes{0xAB, 'K', 'T', 'X', ' ', '1', '1', 0xBB, '\r', '\n', 0x1A, '\n'}));
  const BasisTexture texture = texture_of("etc1s_cloud_mips_32x20", BasisTarget::kRgba32);
  for (std::size_t l = 0; l < texture.levels.size(); ++l) {
    EXPECT_EQ(texture.levels[l].width, std::max(32 >> l, 1));
    EXPECT_EQ(texture.levels[l].height, std::max(20 >> l, 1));
  }
}

TEST(Ktx2, TextureDoesNotDependOnTheNumberOfThreads) {  // KT4
  for (const char* name : {"etc1s_q128_cloud_128", "uastc_disc_mips_64"})
    for (const BasisTarget target : kTargets) {
      const BasisTexture many = texture_of(name, target);
      const ThreadLimit one(1);
      const BasisTexture alone = texture_of(name, target);
      EXPECT_EQ(hash_of(many, &BasisLevel::texels), hash_of(alone, &BasisLevel::texels));
      EXPECT_EQ(hash_of(many, &BasisLevel::blocks), hash_of(alone, &BasisLevel::blocks));
    }
  // Its twin: outputs that depend on the target do differ.
  EXPECT_NE(hash_of(texture_of("uastc_disc_32", BasisTarget::kRgba32), &BasisLevel::texels),
            hash_of(texture_of("uastc_disc_32", BasisTarget::kAstc4x4), &BasisLevel::texels));
}

// ---- Damaged files ----------------------------------------------------------------------------------------------

TEST(Ktx2, EveryTruncatedFileIsRefused) {
  for (const char* name :
       {"etc1s_cloud_7x5", "etc1s_soft_1x1", "etc1s_disc_32", "uastc_cloud_7x5", "uastc_zstd_mips_ramp_32"}) {
    const Bytes whole = file_bytes(name);
    for (std::size_t length = 0; length < whole.size(); ++length)
      EXPECT_FALSE(
          decode({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length)}, BasisTarget::kAstc4x4).accepted)
          << name << " of " << length << " bytes";
  }
}

// Decodes arbitrary bytes and checks KT3.
void expect_within_charge(const Bytes& file, BasisTarget target) {
  constexpr std::int64_t kSlack = 1 << 20;  // of messages, threads and of the test
  const ImageLimits limits{.max_side = 256, .max_pixels = 1 << 15};
  const test::HeapMeter meter;
  std::uint64_t charged = 0;
  BasisTexture texture;
  std::string fault;
  try {
    const bool accepted =
        decode_ktx2(file, target, limits, texture, fault, [&](std::uint64_t bytes) { charged = bytes; });
    EXPECT_EQ(accepted, fault.empty());
    for (const BasisLevel& level : texture.levels) EXPECT_LE(level.texels.size(), 4 * limits.max_pixels);
  } catch (const LimitError&) {
    EXPECT_EQ(charged, 0u);
  }
  EXPECT_LE(meter.peak_bytes(), static_cast<std::int64_t>(charged) + kSlack);
}

TEST(Ktx2, ChangedBytesTakeNoMoreThanWasCharged) {  // KT3
  std::uint32_t seed = 1;
  for (const char* name : {"etc1s_disc_mips_64", "etc1s_noisea_32", "etc1s_normal_32", "uastc_cloud_7x5",
                           "uastc_zstd_mips_ramp_32", "uastc_modes"}) {
    const Bytes whole = file_bytes(name);
    for (int trial = 0; trial < 150; ++trial) {
      Bytes broken = whole;
      for (std::uint32_t changes = 1 + mix32(++seed) % 3; changes > 0; --changes) {
        // Half of the changes to the heads, where sizes are.
        const std::size_t part = mix32(++seed) % 2 == 0 ? 300 : broken.size(), where = mix32(++seed) % part;
        broken[where % broken.size()] = static_cast<std::uint8_t>(mix32(++seed));
      }
      expect_within_charge(broken, kTargets[mix32(++seed) % 2]);
    }
  }
}

RC_GTEST_PROP(Ktx2, AnyBytesBehindASoundHeadAreAnswered, (std::uint32_t seed)) {  // KT3
  Bytes file = file_bytes("etc1s_disc_32");
  for (std::size_t i = 300; i < file.size(); ++i)
    if (mix32(seed + static_cast<std::uint32_t>(i)) % 8 == 0)
      file[i] = static_cast<std::uint8_t>(mix32(seed ^ mix32(i)));
  expect_within_charge(file, kTargets[seed % 2]);
}

TEST(Ktx2, TheChargeIsAtMostTwiceTheAllocation) {  // the twin of KT3: a charge that is any number would hold, too
  const Bytes file = file_bytes("uastc_disc_mips_64");
  for (const BasisTarget target : kTargets) {
    const Answer answer = decode(file, target);
    std::uint64_t taken = 0;
    for (const BasisLevel& level : answer.texture.levels) taken += level.texels.size() + level.blocks.size();
    EXPECT_GE(answer.charged, taken);
    EXPECT_LE(answer.charged, 2 * taken);
  }
}

TEST(Ktx2, SizesBeyondTheLimitsAreRefusedBeforeAnythingIsCharged) {  // KT3
  const Bytes file = file_bytes("uastc_disc_32");
  EXPECT_THROW(decode(file, BasisTarget::kRgba32, {.max_side = 31, .max_pixels = 1 << 20}), LimitError);
  EXPECT_THROW(decode(file, BasisTarget::kRgba32, {.max_side = 32, .max_pixels = 1023}), LimitError);
  EXPECT_TRUE(decode(file, BasisTarget::kRgba32, {.max_side = 32, .max_pixels = 1024}).accepted);
  Bytes huge = file;
  put32(huge, 20, 16384), put32(huge, 24, 8192);
  BasisTexture texture;
  std::string fault;
  EXPECT_THROW((void)decode_ktx2(huge, BasisTarget::kRgba32, {}, texture, fault,
                                 [](std::uint64_t bytes) {
                                   EXPECT_GE(bytes, 512u << 20);
                                   throw LimitError("too much");
                                 }),
               LimitError);
}

// Fields of the header, the level index, the data format and BasisLZ's head, each with a value that is not allowed.
struct Damage {
  const char* file;
  std::size_t at;
  std::uint32_t value;
  const char* fault;
};

TEST(Ktx2, EveryFieldThatIsNotAllowedIsNamed) {
  const Bytes etc1s = file_bytes("etc1s_disc_32"), zstd = file_bytes("uastc_zstd_cloud_32");
  const std::size_t descriptor = word32(etc1s, 48) + 4, global = word32(etc1s, 64), pairs = word32(etc1s, 56);
  const Damage damages[] = {{"etc1s_disc_32", 12, 37, "no Basis Universal data"},
                            {"etc1s_disc_32", 20, 0, "no two-dimensional texture"},
                            {"etc1s_disc_32", 28, 1, "no two-dimensional texture"},
                            {"etc1s_disc_32", 32, 1, "no two-dimensional texture"},
                            {"etc1s_disc_32", 36, 6, "no two-dimensional texture"},
                            {"etc1s_disc_32", 40, 7, "7 levels of 32x32"},
                            {"etc1s_disc_32", 44, 2, "supercompression scheme 2"},
                            {"etc1s_disc_32", 48, 0xFFFFFFF0, "no sound data format descriptor"},
                            {"etc1s_disc_32", 60, 0x7FFFFFFF, "key/value data"},
                            {"etc1s_disc_32", 72, 0x7FFFFFFF, "global data"},
                            {"etc1s_disc_32", 88, 0x7FFFFFFF, "level 0 of a KTX2 file reaches beyond"},
                            {"etc1s_disc_32", descriptor + 8, 0x000201A4, "colour model 164"},
                            {"etc1s_disc_32", descriptor + 8, 0x000301A3, "transfer function 3"},
                            {"etc1s_disc_32", descriptor + 8, 0x010201A3, "premultiplied"},
                            {"etc1s_disc_32", descriptor + 24, 0x043F0000, "channels other than"},
                            {"etc1s_disc_32", pairs, 0x7FFFFFFF, "end inside a pair"},
                            {"etc1s_disc_32", global, 0x00010000, "empty codebook"},
                            {"etc1s_disc_32", global + 4, 0x7FFFFFFF, "do not add up"},
                            {"etc1s_disc_32", global + 20, 2, "frame of a video"},
                            {"etc1s_disc_32", global + 28, 0x7FFFFFFF, "colour slice of level 0"},
                            {"etc1s_disc_32", global + 36, 0, "alpha slice of level 0"},
                            {"uastc_disc_32", 44, 1, "supercompression scheme 1"},
                            {"uastc_disc_32", 20, 64, "does not unpack to 128 UASTC blocks"},
                            {"uastc_zstd_cloud_32", 96, 1 << 20, "does not unpack to 64 UASTC blocks"},
                            {"uastc_zstd_cloud_32", word32(zstd, 80), 0, "does not unpack to 64 UASTC blocks"}};
  for (const Damage& damage : damages) {
    Bytes file = file_bytes(damage.file);
    put32(file, damage.at, damage.value);
    const Answer answer = decode(file, BasisTarget::kRgba32);
    EXPECT_FALSE(answer.accepted) << damage.fault;
    EXPECT_THAT(answer.fault, testing::HasSubstr(damage.fault));
  }
}

TEST(Ktx2, ReservedUastcBlocksAreRefused) {
  Bytes file = file_bytes("uastc_noise_32");
  file[file.size() - 16] = 69;  // the one code of no mode
  EXPECT_THAT(decode(file, BasisTarget::kAstc4x4).fault, testing::HasSubstr("reserved kind"));
}

TEST(Etc1s, BlocksNameEntriesThatExist) {  // BL1
  for (const char* name : {"etc1s_noisea_32", "etc1s_q128_cloud_128", "etc1s_q1_noise_64"}) {
    const Bytes file = file_bytes(name);
    Container container;
    BasisLzData data;
    Etc1sCodebooks books;
    std::string fault;
    ASSERT_TRUE(read_container(file, {}, container, fault) && read_basis_lz(container, data, fault)) << fault;
    ASSERT_TRUE(read_etc1s_codebooks(data.endpoint_count, data.endpoints, data.selector_count, data.selectors,
                                     data.tables, books, fault))
        << fault;
    const ContainerLevel& level = container.levels[0];
    std::vector<Etc1sBlock> blocks(static_cast<std::size_t>(level.block_count()));
    ASSERT_TRUE(read_etc1s_slice(books, data.levels[0].color, level.columns(), level.rows(), blocks, fault)) << fault;
    std::size_t last_endpoint = 0, last_selector = 0;
    for (const Etc1sBlock& block : blocks) {
      last_endpoint = std::max<std::size_t>(last_endpoint, block.endpoint);
      last_selector = std::max<std::size_t>(last_selector, block.selector);
    }
    EXPECT_LT(last_endpoint, books.endpoints.size());
    EXPECT_LT(last_selector, books.selectors.size());
    // The twin: without the last entry that a block names, the same slice is refused or names others.
    Etc1sCodebooks fewer = books;
    fewer.selectors.resize(last_selector);
    std::vector<Etc1sBlock> again(blocks.size());
    if (last_selector > 0 &&
        read_etc1s_slice(fewer, data.levels[0].color, level.columns(), level.rows(), again, fault)) {
      for (const Etc1sBlock& block : again) EXPECT_LT(block.selector, fewer.selectors.size());
    } else {
      EXPECT_THAT(fault, testing::AnyOf(testing::IsEmpty(), testing::HasSubstr("damaged at block")));
    }
  }
}

}  // namespace
}  // namespace tessera::ktx2::ktx2_test

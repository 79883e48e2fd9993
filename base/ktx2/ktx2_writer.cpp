#include <zstd.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "base/error.h"
#include "base/ktx2/bit_writer.h"
#include "base/ktx2/etc1s_encoder.h"
#include "base/ktx2/level_blocks.h"
#include "base/ktx2/uastc_encoder.h"
#include "base/parallel.h"

namespace tessera::ktx2 {
namespace {

constexpr std::string_view kKtx2Identifier = "\xABKTX 20\xBB\r\n\x1A\n";
// Of the library's levels the highest that needs no large windows; files are written once.
constexpr int kZstandardLevel = 19;
constexpr std::size_t kKtx2HeadBytes = 80, kKtx2EntryBytes = 24;

std::string uastc_level(const LevelToWrite& level, bool alpha) {
  std::vector<TexelBlock> texels = level_blocks(level);
  std::string blocks(texels.size() * 16, '\0');
  parallel_for(texels.size(), [&](std::size_t b) {
    if (!alpha)
      for (auto& texel : texels[b]) texel[3] = 255;
    const AstcBytes bytes = encode_uastc(texels[b]);
    std::copy(bytes.begin(), bytes.end(), blocks.begin() + static_cast<std::ptrdiff_t>(16 * b));
  });
  return blocks;
}

std::string zstandard_of(const std::string& bytes) {
  std::string out(ZSTD_compressBound(bytes.size()), '\0');
  const std::size_t size = ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), kZstandardLevel);
  if (ZSTD_isError(size) != 0) throw SystemError(std::string("zstd: ") + ZSTD_getErrorName(size));
  out.resize(size);
  return out;
}

// What the file holds of a texture: planes of a block in the data format's words.
struct Sample {
  std::uint32_t first_bit, bits, channel;
};

// The data format descriptor: one basic block. Planes of supercompressed data have no size.
std::string format_descriptor(const Ktx2Options& options) {
  constexpr std::uint32_t kHeadBytes = 24, kSampleBytes = 16, kEtc1sModel = 163, kUastcModel = 166, kBt709 = 1;
  constexpr std::uint32_t kRgb = 0, kUastcRgba = 3, kEtc1sAlpha = 15;
  std::vector<Sample> samples = {{0, 128, options.alpha ? kUastcRgba : kRgb}};
  if (options.etc1s) samples = {{0, 64, kRgb}};
  if (options.etc1s && options.alpha) samples.push_back({64, 64, kEtc1sAlpha});
  const std::size_t block_bytes = kHeadBytes + kSampleBytes * samples.size();
  std::string out;
  put_number(out, 4 + block_bytes, 4);
  put_number(out, 0, 4);  // Khronos, basic
  put_number(out, 2, 2);
  put_number(out, block_bytes, 2);
  put_number(out, options.etc1s ? kEtc1sModel : kUastcModel, 1);
  put_number(out, options.srgb ? kBt709 : 0, 1);
  put_number(out, options.srgb ? 2 : 1, 1);  // transfer function
  put_number(out, 0, 1);
  put_number(out, 0x0303, 4);  // blocks of 4x4
  put_number(out, 0, 8);
  for (const Sample& sample : samples) {
    put_number(out, sample.first_bit | (sample.bits - 1) << 16 | sample.channel << 24, 4);
    put_number(out, 0, 8);
    put_number(out, 0xFFFFFFFFu, 4);
  }
  return out;
}

std::string writer_pairs() {
  constexpr std::string_view kPair("KTXwriter\0Tessera\0", 18);
  std::string out;
  put_number(out, kPair.size(), 4);
  out += kPair;
  out.resize((out.size() + 3) / 4 * 4, '\0');
  return out;
}

}  // namespace

std::string write_ktx2(std::span<const LevelToWrite> levels, const Ktx2Options& options) {
  constexpr std::uint32_t kBasisLz = 1, kZstandard = 2;
  const std::string format = format_descriptor(options), pairs = writer_pairs();
  BasisLzFile data;  // of UASTC only levels
  std::vector<std::size_t> unpacked(levels.size(), 0);
  if (options.etc1s) {
    data = encode_basis_lz(levels, options.alpha);
  } else {
    for (std::size_t l = 0; l < levels.size(); ++l) {
      const std::string blocks = uastc_level(levels[l], options.alpha);
      unpacked[l] = blocks.size();
      data.levels.push_back(zstandard_of(blocks));
    }
  }
  const std::size_t format_at = kKtx2HeadBytes + kKtx2EntryBytes * levels.size(), pairs_at = format_at + format.size();
  // Global data begin at a multiple of 8.
  const std::size_t pairs_end = pairs_at + pairs.size(), global_at = (pairs_end + 7) / 8 * 8;

  std::string out(kKtx2Identifier);
  put_number(out, 0, 4);  // no Vulkan format
  put_number(out, 1, 4);
  put_number(out, static_cast<std::uint64_t>(levels.front().width), 4);
  put_number(out, static_cast<std::uint64_t>(levels.front().height), 4);
  for (const std::uint32_t value : {0u, 0u, 1u}) put_number(out, value, 4);  // depth, layers, faces
  put_number(out, levels.size(), 4);
  put_number(out, options.etc1s ? kBasisLz : kZstandard, 4);
  for (const std::size_t value : {format_at, format.size(), pairs_at, pairs.size()}) put_number(out, value, 4);
  put_number(out, options.etc1s ? global_at : 0, 8);
  put_number(out, data.global_data.size(), 8);

  // Levels lie in the file from the smallest on.
  const std::size_t levels_at = options.etc1s ? global_at + data.global_data.size() : pairs_end;
  std::string levels_data;
  std::vector<std::array<std::size_t, 3>> index(levels.size());
  for (std::size_t i = levels.size(); i-- > 0;) {
    index[i] = {levels_at + levels_data.size(), data.levels[i].size(), unpacked[i]};
    levels_data += data.levels[i];
  }
  for (const auto& entry : index)
    for (const std::size_t value : entry) put_number(out, value, 8);
  out += format + pairs;
  if (options.etc1s) out.resize(global_at, '\0');
  return out + data.global_data + levels_data;
}

}  // namespace tessera::ktx2

#include <zstd.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "base/error.h"
#include "base/ktx2/uastc_encoder.h"
#include "base/parallel.h"

namespace tessera::ktx2 {
namespace {

constexpr std::string_view kKtx2Identifier = "\xABKTX 20\xBB\r\n\x1A\n";
// Of the library's levels the highest that needs no large windows; files are written once.
constexpr int kZstandardLevel = 19;
constexpr std::size_t kKtx2HeadBytes = 80, kKtx2EntryBytes = 24;

void put_number(std::string& out, std::uint64_t value, unsigned bytes) {
  for (unsigned i = 0; i < bytes; ++i) out.push_back(static_cast<char>(value >> (8 * i) & 0xFF));
}

std::string blocks_of(const LevelToWrite& level, bool alpha) {
  const auto columns = static_cast<std::size_t>((level.width + 3) / 4),
             rows = static_cast<std::size_t>((level.height + 3) / 4);
  std::string blocks(columns * rows * 16, '\0');
  parallel_for(rows, [&](std::size_t row) {
    for (std::size_t column = 0; column < columns; ++column) {
      TexelBlock texels;
      for (std::size_t t = 0; t < 16; ++t) {
        const std::size_t x = std::min(4 * column + t % 4, static_cast<std::size_t>(level.width) - 1),
                          y = std::min(4 * row + t / 4, static_cast<std::size_t>(level.height) - 1);
        const std::size_t at = 4 * (y * static_cast<std::size_t>(level.width) + x);
        for (std::size_t c = 0; c < 4; ++c) texels[t][c] = level.texels[at + c];
        if (!alpha) texels[t][3] = 255;
      }
      const AstcBytes bytes = encode_uastc(texels);
      std::copy(bytes.begin(), bytes.end(),
                blocks.begin() + static_cast<std::ptrdiff_t>(16 * (row * columns + column)));
    }
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

// The data format descriptor: one basic block with one sample of 128 bits. Planes of supercompressed data have no size.
std::string format_descriptor(const Ktx2Options& options) {
  constexpr std::uint32_t kBlockBytes = 40, kUastcModel = 166, kBt709 = 1, kRgba = 3;
  std::string out;
  put_number(out, 4 + kBlockBytes, 4);
  put_number(out, 0, 4);  // Khronos, basic
  put_number(out, 2, 2);
  put_number(out, kBlockBytes, 2);
  put_number(out, kUastcModel, 1);
  put_number(out, options.srgb ? kBt709 : 0, 1);
  put_number(out, options.srgb ? 2 : 1, 1);  // transfer function
  put_number(out, 0, 1);
  put_number(out, 0x0303, 4);  // blocks of 4x4
  put_number(out, 0, 8);
  put_number(out, 127u << 16 | (options.alpha ? kRgba << 24 : 0u), 4);
  put_number(out, 0, 8);
  put_number(out, 0xFFFFFFFFu, 4);
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
  const std::string format = format_descriptor(options), pairs = writer_pairs();
  std::vector<std::string> data;
  for (const LevelToWrite& level : levels) data.push_back(blocks_of(level, options.alpha));
  const std::size_t format_at = kKtx2HeadBytes + kKtx2EntryBytes * levels.size(), pairs_at = format_at + format.size();

  std::string out(kKtx2Identifier);
  put_number(out, 0, 4);  // no Vulkan format
  put_number(out, 1, 4);
  put_number(out, static_cast<std::uint64_t>(levels.front().width), 4);
  put_number(out, static_cast<std::uint64_t>(levels.front().height), 4);
  for (const std::uint32_t value : {0u, 0u, 1u}) put_number(out, value, 4);  // depth, layers, faces
  put_number(out, levels.size(), 4);
  put_number(out, 2, 4);  // Zstandard
  for (const std::size_t value : {format_at, format.size(), pairs_at, pairs.size()}) put_number(out, value, 4);
  put_number(out, 0, 8);
  put_number(out, 0, 8);

  // Levels lie in the file from the smallest on.
  std::string levels_data;
  std::vector<std::array<std::size_t, 3>> index(levels.size());
  for (std::size_t i = levels.size(); i-- > 0;) {
    const std::string packed = zstandard_of(data[i]);
    index[i] = {pairs_at + pairs.size() + levels_data.size(), packed.size(), data[i].size()};
    levels_data += packed;
  }
  for (const auto& entry : index)
    for (const std::size_t value : entry) put_number(out, value, 8);
  return out + format + pairs + levels_data;
}

}  // namespace tessera::ktx2

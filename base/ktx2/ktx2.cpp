#include "base/ktx2/ktx2.h"

#include <zstd.h>

#include <atomic>

#include <fmt/format.h>

#include "base/check.h"
#include "base/ktx2/astc_block.h"
#include "base/ktx2/level_writer.h"

namespace tessera::ktx2 {
namespace {

// Codebooks of 65535 entries, Huffman tables of 16383 symbols, a history of 8191 selectors; Zstandard's tables.
constexpr std::uint64_t kBasisLzBytes = 1 << 20, kZstandardBytes = 256 << 10;

// Bytes of the texture plus, for the largest level, of the working memory between the file and the texture.
std::uint64_t unpacking_bytes(const Container& container, BasisTarget target) {
  const bool alpha = container.header.alpha;
  std::uint64_t sum = 0;
  for (const ContainerLevel& level : container.levels)
    sum += level.block_count() * block_bytes_of(target) + std::uint64_t{4} * level.width * level.height;
  const std::uint64_t blocks = container.levels.front().block_count();
  switch (container.scheme) {
    case Supercompression::kNone:
      return sum;
    case Supercompression::kZstandard:
      return sum + 16 * blocks + kZstandardBytes;
    case Supercompression::kBasisLz:
      break;
  }
  // Plus one row of blocks that the decoder remembers.
  return sum + blocks * sizeof(Etc1sBlock) * (alpha ? 2 : 1) + etc1s_working_bytes(target, alpha, blocks) +
         std::uint64_t{4} * container.levels.front().columns() + kBasisLzBytes;
}

bool decode_basis_lz(const Container& container, BasisTexture& texture, std::string& fault) {
  BasisLzData data;
  Etc1sCodebooks books;
  if (!read_basis_lz(container, data, fault) ||
      !read_etc1s_codebooks(data.endpoint_count, data.endpoints, data.selector_count, data.selectors, data.tables,
                            books, fault))
    return false;
  std::vector<Etc1sBlock> color, alpha;
  for (std::size_t i = 0; i < container.levels.size(); ++i) {
    const ContainerLevel& level = container.levels[i];
    color.resize(static_cast<std::size_t>(level.block_count()));
    alpha.resize(texture.alpha ? color.size() : 0);
    if (!read_etc1s_slice(books, data.levels[i].color, level.columns(), level.rows(), color, fault)) return false;
    if (texture.alpha && !read_etc1s_slice(books, data.levels[i].alpha, level.columns(), level.rows(), alpha, fault))
      return false;
    write_etc1s_level(books, {color, alpha}, level, texture.target, texture.srgb, texture.levels.emplace_back());
  }
  return true;
}

// A level's blocks, in the file or unpacked into `memory`. False where they are not as many as there should be.
bool uastc_blocks(const ContainerLevel& level, Supercompression scheme, std::vector<std::uint8_t>& memory,
                  FileBytes& blocks) {
  const std::uint64_t wanted = 16 * level.block_count();
  blocks = level.data;
  if (scheme == Supercompression::kNone) return blocks.size() == wanted;
  if (level.unpacked_bytes != wanted) return false;
  memory.resize(static_cast<std::size_t>(wanted));
  const std::size_t size = ZSTD_decompress(memory.data(), memory.size(), level.data.data(), level.data.size());
  blocks = memory;
  return ZSTD_isError(size) == 0 && size == wanted;
}

// A level of UASTC blocks, 16 bytes each. False where one of them is of a reserved kind.
bool write_uastc_level(FileBytes blocks, const ContainerLevel& source, BasisTarget target, const Ktx2Header& header,
                       BasisLevel& level) {
  std::atomic<bool> sound = true;
  const auto make_block = [&](std::size_t index, std::span<std::uint8_t> bytes, TexelBlock& texels) {
    AstcBytes stored;
    std::copy_n(blocks.begin() + static_cast<std::ptrdiff_t>(16 * index), 16, stored.begin());
    AstcBlock block;
    if (!read_uastc(stored, block)) {
      sound = false;
      texels.fill({});
      return;
    }
    if (target == BasisTarget::kAstc4x4) {
      const AstcBytes packed = pack_astc(block);
      std::copy(packed.begin(), packed.end(), bytes.begin());
      TESSERA_CHECK(decode_astc(packed, header.srgb, texels), "a block that was packed is read");
    } else {
      astc_texels(block, false, texels);
    }
    if (!header.alpha)
      for (auto& texel : texels) texel[3] = 255;
  };
  write_level(source, block_bytes_of(target), level, make_block);
  return sound;
}

bool decode_uastc(const Container& container, BasisTexture& texture, std::string& fault) {
  std::vector<std::uint8_t> memory;
  for (std::size_t i = 0; i < container.levels.size(); ++i) {
    const ContainerLevel& level = container.levels[i];
    FileBytes blocks;
    if (!uastc_blocks(level, container.scheme, memory, blocks))
      return fault = fmt::format("level {} does not unpack to {} UASTC blocks", i, level.block_count()), false;
    if (!write_uastc_level(blocks, level, texture.target, container.header, texture.levels.emplace_back()))
      return fault = fmt::format("level {} has a UASTC block of a reserved kind", i), false;
  }
  return true;
}

}  // namespace

bool read_ktx2_header(FileBytes bytes, const ImageLimits& limits, Ktx2Header& header, std::string& fault) {
  Container container;
  if (!read_container(bytes, limits, container, fault)) return false;
  header = container.header;
  for (const BasisTarget target : {BasisTarget::kRgba32, BasisTarget::kAstc4x4})
    header.unpacking_bytes[static_cast<std::size_t>(target)] = unpacking_bytes(container, target);
  return true;
}

bool decode_ktx2(FileBytes bytes, BasisTarget target, const ImageLimits& limits, BasisTexture& texture,
                 std::string& fault, const ChargeBytes& charge) {
  Container container;
  if (!read_container(bytes, limits, container, fault)) return false;
  if (charge) charge(unpacking_bytes(container, target));
  texture = BasisTexture{};
  texture.target = target;
  texture.srgb = container.header.srgb;
  texture.alpha = container.header.alpha;
  texture.block_bytes = block_bytes_of(target);
  texture.levels.reserve(container.levels.size());
  return container.header.etc1s ? decode_basis_lz(container, texture, fault) : decode_uastc(container, texture, fault);
}

}  // namespace tessera::ktx2

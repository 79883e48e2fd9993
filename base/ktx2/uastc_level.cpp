#include <atomic>

#include "base/check.h"
#include "base/ktx2/astc_block.h"
#include "base/ktx2/level_writer.h"

namespace tessera::ktx2 {
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

}  // namespace tessera::ktx2

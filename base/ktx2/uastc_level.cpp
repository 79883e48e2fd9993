#include <atomic>

#include "base/check.h"
#include "base/ktx2/astc_block.h"
#include "base/ktx2/etc2_fit.h"
#include "base/ktx2/level_writer.h"

namespace tessera::ktx2 {
namespace {

// EAC alpha where the block has 16 bytes, ETC2 RGB, and the texels that they decode to. Hints of a UASTC block, which
// save time at the cost of quality, are not used.
void make_etc2_block(const TexelBlock& wanted, std::span<std::uint8_t> bytes, TexelBlock& texels) {
  if (bytes.size() == 16) {
    std::array<std::uint8_t, 16> alpha{};
    for (std::size_t t = 0; t < 16; ++t) alpha[t] = wanted[t][3];
    const EtcBytes packed = pack_eac(fit_eac(alpha));
    std::copy(packed.begin(), packed.end(), bytes.begin());
    decode_eac_alpha(packed, texels);
  }
  const EtcBytes packed = fit_etc2_rgb(wanted);
  std::copy(packed.begin(), packed.end(), bytes.end() - 8);
  decode_etc2_rgb(packed, texels);
}

}  // namespace

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
      if (target == BasisTarget::kEtc2) make_etc2_block(TexelBlock(texels), bytes, texels);
    }
    if (!header.alpha)
      for (auto& texel : texels) texel[3] = 255;
  };
  write_level(source, block_bytes_of(target, header.alpha), level, make_block);
  return sound;
}

}  // namespace tessera::ktx2

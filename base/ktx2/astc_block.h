#pragma once

#include <array>
#include <cstdint>

#include "base/ktx2/astc_numbers.h"
#include "base/ktx2/texel_block.h"

// Blocks of ASTC 4x4, LDR (Khronos Data Format 1.3, chapter 23), as far as universal textures need them: a weight for
// each texel, one endpoint mode for all subsets, endpoints stored directly.
namespace tessera::ktx2 {

// Invariants (cited by the tests):
//   AB1  decode_astc(pack_astc(block)) gives the texels of the block, with and without sRGB.
//   AB2  decode_astc() agrees with libastcenc: bit by bit for sRGB, and otherwise except for libastcenc's rounding of
//        16 bits to 8, which differs by at most one step.
struct AstcBlock {
  bool solid = false;  // one colour, `color`, and nothing else
  std::array<std::uint8_t, 4> color{};

  int components = 3;      // 2 luminance and alpha, 3 RGB, 4 RGBA
  int subsets = 1;         // 1 to 3
  std::uint32_t seed = 0;  // of the partition, 0 to 1023, where there are several subsets
  int planes = 1;          // 2: the channel `plane_channel` has weights of its own
  std::uint32_t plane_channel = 0;
  AstcRange endpoint_range{1, 8}, weight_range{1, 2};
  // Low and high value by subset and component: [subset][component][low, high], without gaps.
  std::array<std::uint8_t, 18> endpoints{};
  // By texel, row by row, and plane, without gaps.
  std::array<std::uint8_t, 32> weights{};

  std::size_t endpoint_count() const { return static_cast<std::size_t>(2 * components * subsets); }
  std::size_t weight_count() const { return static_cast<std::size_t>(16 * planes); }
};

// The texels as decode mode unorm8 gives them: the high 8 of 16 bits. For sRGB red, green and blue are widened to 16
// bits by 0x80, otherwise and for alpha by themselves.
void astc_texels(const AstcBlock& block, bool srgb, TexelBlock& texels);

// The 16 bytes. Fields must be in their ranges and fit.
AstcBytes pack_astc(const AstcBlock& block);

// False where the bytes are a block that pack_astc() never makes.
[[nodiscard]] bool decode_astc(const AstcBytes& bytes, bool srgb, TexelBlock& texels);

// A UASTC block (Basis Universal, "UASTC LDR 4x4 Texture Specification"): an ASTC block of one of 19 kinds, with its
// bits in another order. Returns false where its mode or pattern is reserved.
[[nodiscard]] bool read_uastc(const AstcBytes& bytes, AstcBlock& block);

}  // namespace tessera::ktx2

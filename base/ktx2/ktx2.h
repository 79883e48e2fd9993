#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/image_codec.h"

// Textures in KTX 2.0 files with Basis Universal data, as glTF's KHR_texture_basisu allows them: BasisLZ/ETC1S, or
// UASTC plain or packed by Zstandard; two-dimensional, with all, some or one of the mip levels, RGB or RGBA, sRGB or
// linear. Sources: KTX 2.0 with its appendices on BasisLZ, Khronos Data Format 1.3, "UASTC LDR 4x4 Texture
// Specification".
//
//   BasisTexture texture;
//   std::string fault;
//   if (!decode_ktx2(bytes, BasisTarget::kAstc4x4, limits, texture, fault, charge)) refuse(fault);
//   for (const BasisLevel& level : texture.levels) upload(level.blocks), show(level.width, level.height, level.texels);
namespace tessera::ktx2 {

// Form of the textures in memory. kRgba32: the texels, 4 bytes each, no blocks. kAstc4x4: blocks of 16 bytes.
enum class BasisTarget : std::uint8_t { kRgba32, kAstc4x4 };

// One mip level, width x height texels. Blocks of 4x4 texels come row by row from the top left; those at the right and
// lower border reach beyond the image.
struct BasisLevel {
  int width = 0, height = 0;
  std::vector<std::uint8_t> blocks;  // empty for kRgba32
  std::vector<std::uint8_t> texels;  // RGBA8 as stored (no transfer function), rows from the top
};

// Invariants (cited by the tests):
//   KT1  For kRgba32 the texels have the bits of the Basis Universal transcoder's RGBA32; without alpha in the file,
//        alpha is 255.
//   KT2  For kAstc4x4 the texels are decoded from the blocks; for linear UASTC they have the same bits as for kRgba32.
//   KT3  Whatever the bytes, unpacking takes no more memory than it charged before, and never charges for more pixels
//        than the limits allow.
//   KT4  The same bytes give the same texture whatever the machine and the number of threads.
struct BasisTexture {
  BasisTarget target = BasisTarget::kRgba32;
  bool srgb = false;               // RGB is to be read through the sRGB transfer function
  bool alpha = false;              // the file has alpha; else all alpha is 255
  std::size_t block_bytes = 0;     // 16; 0 for kRgba32
  std::vector<BasisLevel> levels;  // the largest first, each half as wide and high as the one before, rounded down
};

// Contents of a file's head. Sides in texels of the largest level, `levels` at least 1.
struct Ktx2Header {
  int width = 0, height = 0, levels = 0;
  bool etc1s = false;  // else UASTC
  bool srgb = false, alpha = false;
  // Peak bytes of unpacking, the texture included, by target.
  std::array<std::uint64_t, 2> unpacking_bytes{};
};

// Whether bytes begin like a KTX 2.0 file.
bool is_ktx2(std::span<const std::uint8_t> bytes);

// Reads the head alone: header, level index, data format, key/value data. Returns false with the fault in words in
// `fault` where KHR_texture_basisu forbids something in it; throws LimitError where the image is larger than the
// limits. Sides need not be multiples of 4, and levels may be missing.
[[nodiscard]] bool read_ktx2_header(std::span<const std::uint8_t> bytes, const ImageLimits& limits, Ktx2Header& header,
                                    std::string& fault);

// Reads and unpacks all levels. Faults and limits as above. `charge` receives once, before anything large is allocated,
// the peak bytes of unpacking, the texture included. `texture` is unspecified where the result is false.
[[nodiscard]] bool decode_ktx2(std::span<const std::uint8_t> bytes, BasisTarget target, const ImageLimits& limits,
                               BasisTexture& texture, std::string& fault, const ChargeBytes& charge = {});

}  // namespace tessera::ktx2

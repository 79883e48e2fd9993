#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string_view>

#include "base/enum_words.h"
#include "base/ktx2/ktx2.h"

namespace tessera {

// Form in which memory holds a texture: the texels as the file stores them, or blocks of a GPU format.
enum class BlockFormat : std::uint8_t {
  kStored,
  kEtc2,
  kAstc4x4,
  kAstc5x5,
  kAstc6x6,
  kAstc8x8,
  kAstc10x10,
  kAstc12x12,
};
template <>
inline constexpr auto kEnumWords<BlockFormat> = std::to_array<std::string_view>({"stored", "etc2", "astc-4x4",
                                                                                 "astc-5x5", "astc-6x6", "astc-8x8",
                                                                                 "astc-10x10", "astc-12x12"});

// Texels along a block's side, and bytes of a block. [spec] ETC2 with alpha pairs an EAC block with the RGB block.
// Neither function takes kStored.
int block_side(BlockFormat format);
int block_bytes(BlockFormat format, bool alpha);

// Encodes mip levels to blocks and decodes these again: ETC2 with the codec of ktx2/, ASTC (LDR) with libastcenc's
// preset "fast". The encoders minimize the error of the stored codes: channels are coded as they are, and data such as
// normals with all three or four channels. All threads take part in a call; calls must not overlap.
//
// Invariants (cited by the tests):
//   BE1  Texels are decoded from the blocks, bit by bit: by libastcenc in its profile for sRGB or linear data, and by
//        decode_etc2_rgb() and decode_eac_alpha().
//   BE2  The same texels give the same blocks whatever the number of threads.
//   BE3  A level without alpha stays without alpha.
class BlockEncoder {
 public:
  // Bytes of memory that an encoder takes besides the levels. [measured] libastcenc 4.2 allocates 34.2 MB for one image
  // at a time, and 0.2 MB for each thread.
  static constexpr std::uint64_t kWorkingBytes = 48ull << 20;

  BlockEncoder(BlockFormat format, bool srgb);
  ~BlockEncoder();

  // `level` has texels, width * height * 4 of them, and gets blocks, row by row from the top left; its texels become
  // what these decode to. Blocks that reach beyond the level repeat its last column and row. Without `alpha` all alpha
  // must be 255.
  void encode(bool alpha, ktx2::BasisLevel& level);

 private:
  struct Astc;
  BlockFormat format_;
  std::unique_ptr<Astc> astc_;  // null for ETC2
};

}  // namespace tessera

#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string_view>

#include "base/enum_words.h"
#include "base/ktx2/ktx2.h"

namespace tessera {

// What memory holds of a texture: its texels as the file has them, or blocks of a format that GPUs read.
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

// Texels along a block's sides, and its bytes: [spec] ETC2 with alpha has a block of EAC beside that of RGB. Not of
// kStored.
int block_side(BlockFormat format);
int block_bytes(BlockFormat format, bool alpha);

// Encodes mip levels to blocks and decodes these again: ETC2 by the codec of ktx2/, ASTC (LDR) by libastcenc's preset
// "fast". Channels are coded as they are, normals and other data by all three or four; the error that encoders keep
// small is that of the codes. All threads take part; one call at a time.
//
// Invariants (cited by the tests):
//   BE1  Texels are what the blocks decode to: by libastcenc in its profile for sRGB or linear data, bit by bit, and by
//        decode_etc2_rgb() and decode_eac_alpha().
//   BE2  The same texels give the same blocks whatever the number of threads.
//   BE3  A level without alpha stays without.
class BlockEncoder {
 public:
  // What it takes of memory besides the levels. [measured] libastcenc 4.2 allocates 34.2 MB for an image at a time, and
  // 0.2 MB for each thread.
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

#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/rect.h"
#include "tilecore/resolve/frame_compression.h"
#include "tilecore/resolve/frame_format.h"

namespace tessera::tilecore {

// Texels that a pass stores for later passes beside attachments of colours: depths, velocities, a G-buffer, the history of
// temporal antialiasing, levels of a bloom.
//
// A texel has planes of up to four channels, and in each plane a code for every sample. In memory the texels of a tile
// are a piece of the array. Stored raw, the texels of a piece lie row by row. With compression a piece is a sequence of
// blocks, plane by plane, sample by sample, row by row. Every block is compressed on its own (frame_compression.h), keeps
// the place of its raw bytes, and has a header; blocks smaller than a burst stay raw. Samples behind the first one hold the difference from the first, channel
// by channel modulo 2^N, as most pixels see one surface [assumed].
//
// Invariants (cited by the tests):
//   STX1  Depths at infinity, and all else that a clear leaves, have codes of zero bits. Compressed blocks of them take no
//         payload.
//   STX2  If all samples of a pixel are alike, the blocks of samples behind the first take no payload.
//   STX3  A compressed block takes no more bursts than its rows in the piece do raw.
struct TexelFormat {
  std::vector<BlockShape> planes;
  int samples = 1;
  // Number of planes, the last ones, whose data the emulator does not know. They are stored raw, and follow from the others
  // [assumed]: a signature of the others stands for them, too.
  std::size_t unknown_planes = 0;

  std::size_t known_planes() const { return planes.size() - unknown_planes; }
  // All planes and samples.
  std::uint64_t texel_bytes() const;
  // Bytes that blocks take in memory without headers, and number of blocks, which is also the bytes of their headers.
  std::uint64_t block_bytes(IntRect texels) const;
  std::uint64_t block_count(IntRect texels) const;
  // The blocks of one plane, all samples included.
  std::uint64_t plane_blocks(const BlockShape& plane, IntRect texels) const;
};

// Integers of 32 bits in two channels, or of 16 bits.
inline constexpr BlockShape kWordBlock{.width = 8, .height = 8, .bits = {16, 16, 0, 0}, .halves = false};
inline constexpr BlockShape kShortBlock{.width = 8, .height = 8, .bits = {16, 0, 0, 0}, .halves = false};
// Two half floats, and three small floats without signs (r11g11b10f).
inline constexpr BlockShape kTwoHalvesBlock{.width = 8, .height = 8, .bits = {16, 16, 0, 0}};
inline constexpr BlockShape kSmallFloatsBlock{.width = 8, .height = 8, .bits = {11, 11, 10, 0}};

inline PixelCode word_code(std::uint32_t word) {
  return {static_cast<std::uint16_t>(word), static_cast<std::uint16_t>(word >> 16), 0, 0};
}
// Bits of a float in the order of values, so that neighbours differ by little.
inline std::uint32_t ordered_bits(float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  return (bits & 0x80000000u) != 0 ? ~bits : bits | 0x80000000u;
}
// A depth in single precision, and its upper half in formats of 16 bits [assumed]. Infinity, which clears, is 0.
inline std::uint32_t depth_bits(float depth) { return 0xff800000u - ordered_bits(depth); }
inline PixelCode depth_code(float depth, bool single) {
  return word_code(single ? depth_bits(depth) : depth_bits(depth) >> 16);
}

// `bytes` of a sample: 4, or 2 for formats of 16 bits.
TexelFormat depth_format(std::uint64_t bytes, int samples);

// Texels of a tile as it stores them into an array.
struct StoredTexels {
  std::vector<std::uint16_t> block_bytes;  // in memory, in the order of the blocks; empty: raw
  std::uint64_t pixels_compressed = 0;     // of all planes and samples
  std::uint64_t signature = 0;             // CRC-64 of all codes
  std::uint64_t check = 0;                 // an independent hash of the same
  std::uint64_t signed_bytes = 0;          // bytes of texels behind the signature; 0: there is none
};

// The choices of the machine.
struct TexelCoding {
  std::uint64_t burst_bytes = 64;
  bool compressed = false, signs = false;

  bool any() const { return compressed || signs; }
};

// Codes the texels of a tile, plane by plane.
class TexelEncoder {
 public:
  TexelEncoder(const TexelFormat& format, const TexelCoding& how, IntRect texels);

  // Adds the codes of the next known plane: code(sample, texel), with texels counted row by row.
  template <class Code>
  void add_plane(const Code& code) {
    for (int sample = 0; sample < format_.samples; ++sample) {
      for (std::size_t texel = 0; texel < codes_.size(); ++texel) codes_[texel] = code(sample, texel);
      add_samples(sample);
    }
    ++plane_;
  }
  // All known planes must have been added.
  StoredTexels take();

 private:
  // Adds a sample of the current plane, whose codes are in codes_.
  void add_samples(int sample);
  void add_blocks(const BlockShape& shape);
  void add_raw_blocks(const BlockShape& shape);

  const TexelFormat& format_;
  TexelCoding how_;
  IntRect texels_;
  std::size_t plane_ = 0;
  std::vector<PixelCode> codes_, first_;  // of the current sample; of the first one
  StoredTexels out_;
};

}  // namespace tessera::tilecore

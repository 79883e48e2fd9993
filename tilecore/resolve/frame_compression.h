#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "base/round_up.h"
#include "base/vec.h"
#include "tilecore/resolve/frame_format.h"

namespace tessera::tilecore {

// Lossless compression of finished pixels on their way to memory, as in mobile GPUs (Arm's AFBC, Qualcomm's UBWC, AMD's
// DCC). The vendors do not publish their codes; this one follows their statements and Rasmusson, Hasselgren and
// Akenine-Moeller 2007, "Exact and error-bounded approximate color buffer compression and decompression": predict
// within a block, code the residuals at the least width that holds them, keep the block's place in memory so that it
// stays randomly accessible, and save bandwidth, not room. All sizes are [assumed].
//
// A block is 16x4, 8x8, 8x4 or 4x4 pixels (frame_format.h), row by row. Each channel of N bits is coded separately:
//   1. half floats -> an unsigned integer in the order of their values (negative ones below), 16 bits, one to one; integers of
//      16 bits (BlockShape::halves is false) stay as they are, and a channel of 0 bits takes no part;
//   2. residual = value - prediction modulo 2^N, zigzag (0, -1, 1, -2 ...). Prediction by one of four, that which
//      makes the channel shortest; the first pixel is predicted as 0;
//   3. stream: 2 bits of predictor; N bits, the first pixel's value; then for each 4x4 pixels 5 bits, the width W of
//      its widest residual, 0 to N, and its residuals at W bits each, the first pixel's left out.
// The streams of the channels follow each other, lowest bit first, rounded up to bursts. If the stream takes as many
// bursts as the pixels, the block is stored raw. Every block has a header in a separate array (as in AFBC and UBWC),
// which holds its number of bursts; 0 bursts: all bits are 0, as after a clear.
enum class Predictor : std::uint8_t {
  kLeft,
  kUp,
  kPlane,     // left + up - the pixel between them
  kGradient,  // kPlane clamped to the range of left and up (Weinberger et al. 2000, LOCO-I)
};
inline constexpr int kPredictorCount = 4;

inline constexpr std::size_t kBlockHeaderBytes = 1;  // [assumed] DCC's size for 256 bytes
inline constexpr std::size_t kLargestBlockPixels = 64;
inline constexpr std::size_t kLargestBlockBytes = kLargestBlockPixels * 8;

struct CompressedBlock {
  std::size_t payload_bytes = 0;  // in memory: whole bursts; a raw block takes the bytes of its pixels
  std::size_t stream_bits = 0;    // before it is rounded up; 0 when cleared, 8 * payload_bytes when raw
  bool raw = false;
  std::array<std::uint8_t, kLargestBlockBytes> payload{};
};

// The caller fills up a block that reaches beyond the frame; copies of the nearest pixels cost least.
//
// Shape of the blocks of a format: 256 bytes of pixels.
struct BlockShape {
  int width = 8, height = 4;
  ChannelBits bits{16, 16, 16, 16};
  bool halves = true;  // channels of 16 bits are half floats

  std::size_t pixels() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
  std::size_t pixel_bytes() const { return (std::size_t{bits[0]} + bits[1] + bits[2] + bits[3]) / 8; }
  std::size_t raw_bytes() const { return pixels() * pixel_bytes(); }
};
constexpr BlockShape stored_block(FrameFormat format) {
  return {8, frame_pixel_bytes(format) == 8 ? 4 : 8, channel_bits(format), true};
}

// `codes` are 4 * width * height, channel by channel of each pixel; width is 4, 8 or 16; height is 4, or 8 if width is
// at most 8; burst_bytes divides the raw bytes and is at least 8 (all checked).
//
// Invariants (cited by the tests):
//   FC1  decompress(compress(x)) == x for any bits: NaNs with their payload, infinities, -0, denormals.
//   FC2  payload_bytes is a multiple of the burst and never above the raw size.
//   FC3  A block of zero bits takes no payload; a block of one colour takes one burst of at least 16 bytes when 4x4.
CompressedBlock compress_block(std::span<const std::uint16_t> codes, const BlockShape& shape, std::size_t burst_bytes);
void decompress_block(const CompressedBlock& block, const BlockShape& shape, std::span<std::uint16_t> codes);

// Bytes of payload that compress_block() would give; writes none, for the ledger.
std::size_t compressed_block_bytes(std::span<const std::uint16_t> codes, const BlockShape& shape,
                                   std::size_t burst_bytes);
// For blocks of half floats, four rows high.
inline CompressedBlock compress_block(std::span<const std::uint16_t> halves, int width, int height,
                                      std::size_t burst_bytes) {
  return compress_block(halves, BlockShape{width, height}, burst_bytes);
}
inline void decompress_block(const CompressedBlock& block, int width, int height, std::span<std::uint16_t> halves) {
  decompress_block(block, BlockShape{width, height}, halves);
}
inline std::size_t compressed_block_bytes(std::span<const std::uint16_t> halves, int width, int height,
                                          std::size_t burst_bytes) {
  return compressed_block_bytes(halves, BlockShape{width, height}, burst_bytes);
}

// Bytes of headers of `blocks` blocks, rounded up to bursts.
constexpr std::size_t block_header_bytes(std::size_t blocks, std::size_t burst_bytes) {
  return round_up(blocks * kBlockHeaderBytes, burst_bytes);
}

// IEEE 754 binary16 bits of a float, rounded to nearest, ties to even; beyond 65519 infinity; NaN stays NaN, quiet.
std::uint16_t half_bits(float value);

// Rounds colours to the values of their halves: as_halves() of x has the half_bits() of x.
void as_halves(std::span<const Vec4> colors, Vec4* out);

// One pixel of the finished frame.
inline std::array<std::uint16_t, 4> half_bits(const Vec4& color) {
  return {half_bits(color.x), half_bits(color.y), half_bits(color.z), half_bits(color.w)};
}

}  // namespace tessera::tilecore

#include "tilecore/resolve/frame_compression.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/check.h"
#include "tilecore/resolve/bit_stream.h"

namespace tessera::tilecore {
namespace {

constexpr std::size_t kPredictorBits = 2, kWidthBits = 5;
constexpr unsigned kHalfBits = 16;

using Channel = std::array<std::uint16_t, kLargestBlockPixels>;  // one channel of a block, row by row

// Negative halves count down from 0x7fff, positive ones up from 0x8000: -0 and 0 are neighbours.
std::uint16_t ordered_code(std::uint16_t half) {
  return static_cast<std::uint16_t>(half & 0x8000 ? ~half : half | 0x8000);
}
std::uint16_t half_of_code(std::uint16_t code) {
  return static_cast<std::uint16_t>(code & 0x8000 ? code & 0x7fff : ~code);
}

// Whether a channel is coded in the order of half floats.
bool orders(const BlockShape& shape, std::size_t channel) { return shape.halves && shape.bits[channel] == kHalfBits; }

constexpr std::uint32_t mask_of(unsigned bits) { return (1u << bits) - 1; }

// Folds a residual modulo 2^bits into as many bits.
std::uint16_t zigzag(std::uint32_t residual, unsigned bits) {
  const std::uint32_t mask = mask_of(bits), r = residual & mask;
  return static_cast<std::uint16_t>(((r << 1) ^ (r >> (bits - 1) != 0 ? mask : 0)) & mask);
}
std::uint16_t unzigzag(std::uint16_t code) { return static_cast<std::uint16_t>((code >> 1) ^ (code & 1 ? 0xffff : 0)); }

// Predictions from the pixels to the left, above, and above the left one. All arithmetic is modulo 2^16.
template <Predictor kPredictor>
std::uint16_t predicted(std::uint16_t left, std::uint16_t up, std::uint16_t corner) {
  if constexpr (kPredictor == Predictor::kLeft) return left;
  if constexpr (kPredictor == Predictor::kUp) return up;
  if constexpr (kPredictor == Predictor::kPlane) return static_cast<std::uint16_t>(left + up - corner);
  return static_cast<std::uint16_t>(std::clamp(left + up - corner, int{std::min(left, up)}, int{std::max(left, up)}));
}

std::uint16_t prediction(const Channel& codes, int width, int x, int y, Predictor predictor) {
  const auto at = [&](int i, int j) { return codes[static_cast<std::size_t>(j * width + i)]; };
  if (y == 0) return x == 0 ? std::uint16_t{0} : at(x - 1, 0);
  if (x == 0) return at(0, y - 1);
  const std::uint16_t left = at(x - 1, y), up = at(x, y - 1), corner = at(x - 1, y - 1);
  switch (predictor) {
    case Predictor::kLeft:
      return left;
    case Predictor::kUp:
      return up;
    case Predictor::kPlane:
      return predicted<Predictor::kPlane>(left, up, corner);
    case Predictor::kGradient:
      return predicted<Predictor::kGradient>(left, up, corner);
  }
  return 0;
}

// A channel's residuals with one predictor, and the widths of its groups of 4x4 pixels.
struct CodedChannel {
  Predictor predictor = Predictor::kLeft;
  Channel residual{};
  std::array<std::size_t, 4> width{};
  std::size_t bits = 0;
};

std::size_t pixels_coded(std::size_t group) { return group == 0 ? 15 : 16; }
std::size_t group_count(const BlockShape& shape) { return shape.pixels() / 16; }
std::size_t group_of(const BlockShape& shape, int x, int y) {
  return static_cast<std::size_t>(y / 4 * (shape.width / 4) + x / 4);
}

// By group, the residuals of each predictor, or'ed: how wide they are.
using Residuals = std::array<std::array<std::uint16_t, 4>, kPredictorCount>;

Residuals all_residuals(const Channel& codes, const BlockShape& shape, unsigned bits) {
  Residuals all{};
  const auto add = [&](std::size_t group, std::uint16_t code, const std::array<std::uint16_t, kPredictorCount>& guess) {
    for (std::size_t p = 0; p < kPredictorCount; ++p)
      all[p][group] |= zigzag(static_cast<std::uint32_t>(code - guess[p]), bits);
  };
  for (int y = 0; y < shape.height; ++y) {
    const std::uint16_t* row = &codes[static_cast<std::size_t>(y * shape.width)];
    for (int x = 0; x < shape.width; ++x) {
      const std::size_t group = group_of(shape, x, y);
      if (x > 0 && y > 0) {
        const std::uint16_t left = row[x - 1], up = row[x - shape.width], corner = row[x - 1 - shape.width];
        add(group, row[x],
            {predicted<Predictor::kLeft>(left, up, corner), predicted<Predictor::kUp>(left, up, corner),
             predicted<Predictor::kPlane>(left, up, corner), predicted<Predictor::kGradient>(left, up, corner)});
      } else if (x > 0 || y > 0) {
        const std::uint16_t before = x > 0 ? row[x - 1] : row[x - shape.width];
        add(group, row[x], {before, before, before, before});
      }
    }
  }
  return all;
}

CodedChannel shortest_code(std::span<const std::uint16_t> pixels, const BlockShape& shape, std::size_t channel,
                           Channel& codes) {
  const unsigned bits = shape.bits[channel];
  if (bits == 0) return {};
  for (std::size_t i = 0; i < shape.pixels(); ++i)
    codes[i] = orders(shape, channel) ? ordered_code(pixels[4 * i + channel]) : pixels[4 * i + channel];
  const Residuals all = all_residuals(codes, shape, bits);
  CodedChannel best;
  for (std::uint8_t p = 0; p < kPredictorCount; ++p) {
    std::array<std::size_t, 4> width{};
    std::size_t length = kPredictorBits + bits;
    for (std::size_t g = 0; g < group_count(shape); ++g) {
      width[g] = static_cast<std::size_t>(std::bit_width(all[p][g]));
      length += kWidthBits + pixels_coded(g) * width[g];
    }
    if (p == 0 || length < best.bits) best.predictor = Predictor{p}, best.width = width, best.bits = length;
  }
  for (int y = 0; y < shape.height; ++y)
    for (int x = 0; x < shape.width; ++x) {
      const auto i = static_cast<std::size_t>(y * shape.width + x);
      best.residual[i] =
          zigzag(static_cast<std::uint32_t>(codes[i] - prediction(codes, shape.width, x, y, best.predictor)), bits);
    }
  return best;
}

// Calls visit(pixel) for the pixels of a 4x4 group, row by row, but for the block's first.
template <class Visit>
void for_each_coded(const BlockShape& shape, std::size_t group, const Visit& visit) {
  const int columns = shape.width / 4, x0 = 4 * (static_cast<int>(group) % columns),
            y0 = 4 * (static_cast<int>(group) / columns);
  for (int y = y0; y < y0 + 4; ++y)
    for (int x = x0; x < x0 + 4; ++x)
      if (x + y != 0) visit(static_cast<std::size_t>(y * shape.width + x));
}

void write_channel(const CodedChannel& coded, std::uint16_t first, const BlockShape& shape, unsigned bits,
                   BitWriter& out) {
  out.write(static_cast<std::uint32_t>(coded.predictor), kPredictorBits);
  out.write(first, bits);
  for (std::size_t g = 0; g < group_count(shape); ++g) {
    out.write(static_cast<std::uint32_t>(coded.width[g]), kWidthBits);
    for_each_coded(shape, g, [&](std::size_t i) { out.write(coded.residual[i], coded.width[g]); });
  }
}

void read_channel(BitReader& in, const BlockShape& shape, unsigned bits, Channel& codes) {
  const auto predictor = static_cast<Predictor>(in.read(kPredictorBits));
  const auto first = static_cast<std::uint16_t>(in.read(bits));
  Channel residual{};
  for (std::size_t g = 0; g < group_count(shape); ++g) {
    const std::size_t width = in.read(kWidthBits);
    for_each_coded(shape, g, [&](std::size_t i) { residual[i] = static_cast<std::uint16_t>(in.read(width)); });
  }
  codes[0] = first;
  for (int y = 0; y < shape.height; ++y)
    for (int x = 0; x < shape.width; ++x) {
      const auto i = static_cast<std::size_t>(y * shape.width + x);
      if (i == 0) continue;
      const auto value =
          static_cast<std::uint32_t>(prediction(codes, shape.width, x, y, predictor)) + unzigzag(residual[i]);
      codes[i] = static_cast<std::uint16_t>(value & mask_of(bits));
    }
}

// Bytes of pixels, after checking the shape.
std::size_t raw_bytes(std::size_t codes, const BlockShape& shape, std::size_t burst_bytes) {
  TESSERA_CHECK((shape.width == 4 || shape.width == 8 || shape.width == 16) &&
                    (shape.height == 4 || (shape.height == 8 && shape.width <= 8)),
                "a block is 4, 8 or 16 pixels wide, and 4 or 8 high");
  TESSERA_CHECK(codes == 4 * shape.pixels(), "a block has four halves per pixel, or four codes");
  TESSERA_CHECK(burst_bytes >= 8 && shape.raw_bytes() % burst_bytes == 0, "a raw block is whole bursts");
  return shape.raw_bytes();
}

bool is_cleared(std::span<const std::uint16_t> halves) {
  return std::all_of(halves.begin(), halves.end(), [](std::uint16_t h) { return h == 0; });
}

std::size_t in_bursts(std::size_t bits, std::size_t burst_bytes) {
  return (bits + 8 * burst_bytes - 1) / (8 * burst_bytes) * burst_bytes;
}

}  // namespace

CompressedBlock compress_block(std::span<const std::uint16_t> codes, const BlockShape& shape, std::size_t burst_bytes) {
  const std::size_t raw = raw_bytes(codes.size(), shape, burst_bytes);
  CompressedBlock block;
  if (is_cleared(codes)) return block;
  std::array<CodedChannel, 4> coded;
  std::array<std::uint16_t, 4> first;
  for (std::size_t c = 0; c < 4; ++c) {
    Channel channel{};
    coded[c] = shortest_code(codes, shape, c, channel);
    first[c] = channel[0];
    block.stream_bits += coded[c].bits;
  }
  block.payload_bytes = in_bursts(block.stream_bits, burst_bytes);
  BitWriter out(block.payload);
  if (block.payload_bytes >= raw) {
    block.raw = true;
    block.payload_bytes = raw;
    block.stream_bits = 8 * raw;
    for (std::size_t i = 0; i < codes.size(); ++i) out.write(codes[i], shape.bits[i % 4]);
    return block;
  }
  for (std::size_t c = 0; c < 4; ++c)
    if (shape.bits[c] > 0) write_channel(coded[c], first[c], shape, shape.bits[c], out);
  return block;
}

void decompress_block(const CompressedBlock& block, const BlockShape& shape, std::span<std::uint16_t> codes) {
  raw_bytes(codes.size(), shape, 8);
  if (block.payload_bytes == 0) return std::fill(codes.begin(), codes.end(), std::uint16_t{0});
  BitReader in(std::span(block.payload).first(block.payload_bytes));
  if (block.raw) {
    for (std::size_t i = 0; i < codes.size(); ++i) codes[i] = static_cast<std::uint16_t>(in.read(shape.bits[i % 4]));
    return;
  }
  for (std::size_t c = 0; c < 4; ++c) {
    Channel channel{};
    if (shape.bits[c] > 0) read_channel(in, shape, shape.bits[c], channel);
    for (std::size_t i = 0; i < shape.pixels(); ++i)
      codes[4 * i + c] = orders(shape, c) ? half_of_code(channel[i]) : channel[i];
  }
}

std::size_t compressed_block_bytes(std::span<const std::uint16_t> codes, const BlockShape& shape,
                                   std::size_t burst_bytes) {
  const std::size_t raw = raw_bytes(codes.size(), shape, burst_bytes);
  if (is_cleared(codes)) return 0;
  std::size_t bits = 0;
  Channel channel;
  for (std::size_t c = 0; c < 4; ++c) bits += shortest_code(codes, shape, c, channel).bits;
  return std::min(raw, in_bursts(bits, burst_bytes));
}

std::uint16_t half_bits(float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  const std::uint32_t sign = bits >> 16 & 0x8000, magnitude = bits & 0x7fffffff;
  if (magnitude > 0x7f800000) return static_cast<std::uint16_t>(sign | 0x7e00 | (magnitude >> 13 & 0x1ff));
  if (magnitude >= 0x477ff000) return static_cast<std::uint16_t>(sign | 0x7c00);  // 65520 and above
  // Below 2^-14 a half counts 2^-24: adding 0.5 leaves those counts, rounded to even, in the lowest bits.
  if (magnitude < 0x38800000)
    return static_cast<std::uint16_t>(sign | (std::bit_cast<std::uint32_t>(std::bit_cast<float>(magnitude) + 0.5f) -
                                              std::bit_cast<std::uint32_t>(0.5f)));
  const std::uint32_t rebased = magnitude - (112u << 23);
  return static_cast<std::uint16_t>(sign | (rebased + 0xfff + (rebased >> 13 & 1)) >> 13);
}

void as_halves(std::span<const Vec4> colors, Vec4* out) {
  const float* const in = &colors.data()->x;
  float* const to = &out->x;
  // half_bits() without its branches, and back.
  for (std::size_t i = 0; i < 4 * colors.size(); ++i) {
    const auto bits = std::bit_cast<std::uint32_t>(in[i]);
    const std::uint32_t sign = bits & 0x80000000u, magnitude = bits & 0x7fffffffu;
    const std::uint32_t normal = (magnitude + 0xfff + (magnitude >> 13 & 1)) & ~0x1fffu,
                        small = std::bit_cast<std::uint32_t>((std::bit_cast<float>(magnitude) + 0.5f) - 0.5f),
                        large = magnitude > 0x7f800000u ? 0x7fc00000u | (magnitude & ~0x1fffu) : 0x7f800000u;
    const std::uint32_t rounded = magnitude < 0x38800000u ? small : magnitude >= 0x477ff000u ? large : normal;
    to[i] = std::bit_cast<float>(sign | rounded);
  }
}

}  // namespace tessera::tilecore

#include "tilecore/resolve/frame_compression.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/check.h"

namespace tessera::tilecore {
namespace {

constexpr int kBlockRows = 4;
constexpr std::size_t kPredictorBits = 2, kValueBits = 16, kWidthBits = 5;
constexpr std::size_t kChannelHeaderBits = kPredictorBits + kValueBits;

using Channel = std::array<std::uint16_t, kLargestBlockPixels>;  // one channel of a block, row by row

// Negative halves count down from 0x7fff, positive ones up from 0x8000: -0 and 0 are neighbours.
std::uint16_t ordered_code(std::uint16_t half) {
  return static_cast<std::uint16_t>(half & 0x8000 ? ~half : half | 0x8000);
}
std::uint16_t half_of_code(std::uint16_t code) {
  return static_cast<std::uint16_t>(code & 0x8000 ? code & 0x7fff : ~code);
}

std::uint16_t zigzag(std::uint16_t residual) {
  return static_cast<std::uint16_t>((residual << 1) ^ (residual & 0x8000 ? 0xffff : 0));
}
std::uint16_t unzigzag(std::uint16_t code) { return static_cast<std::uint16_t>((code >> 1) ^ (code & 1 ? 0xffff : 0)); }

// From pixels before (x, y) in row order. All arithmetic is modulo 2^16.
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
      return static_cast<std::uint16_t>(left + up - corner);
    case Predictor::kGradient:
      return static_cast<std::uint16_t>(
          std::clamp(left + up - corner, int{std::min(left, up)}, int{std::max(left, up)}));
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

CodedChannel code_channel(const Channel& codes, int width, Predictor predictor) {
  CodedChannel out;
  out.predictor = predictor;
  std::array<std::uint16_t, 4> all{};  // the residuals of a group, or'ed
  for (int y = 0; y < kBlockRows; ++y)
    for (int x = 0; x < width; ++x) {
      const auto i = static_cast<std::size_t>(y * width + x);
      out.residual[i] = zigzag(static_cast<std::uint16_t>(codes[i] - prediction(codes, width, x, y, predictor)));
      if (i != 0) all[static_cast<std::size_t>(x / 4)] |= out.residual[i];
    }
  out.bits = kChannelHeaderBits;
  for (std::size_t g = 0; g < static_cast<std::size_t>(width / 4); ++g) {
    out.width[g] = static_cast<std::size_t>(std::bit_width(all[g]));
    out.bits += kWidthBits + pixels_coded(g) * out.width[g];
  }
  return out;
}

CodedChannel shortest_code(std::span<const std::uint16_t> halves, int width, std::size_t channel, Channel& codes) {
  const auto pixels = static_cast<std::size_t>(width * kBlockRows);
  for (std::size_t i = 0; i < pixels; ++i) codes[i] = ordered_code(halves[4 * i + channel]);
  CodedChannel best = code_channel(codes, width, Predictor{0});
  for (std::uint8_t p = 1; p < kPredictorCount; ++p) {
    const CodedChannel other = code_channel(codes, width, Predictor{p});
    if (other.bits < best.bits) best = other;
  }
  return best;
}

// Bits of a stream, lowest first.
class BitWriter {
 public:
  explicit BitWriter(std::span<std::uint8_t> bytes) : bytes_(bytes) {}
  void write(std::uint32_t value, std::size_t bits) {
    for (std::size_t b = 0; b < bits; ++b, ++at_)
      bytes_[at_ / 8] = static_cast<std::uint8_t>(bytes_[at_ / 8] | (value >> b & 1u) << (at_ % 8));
  }

 private:
  std::span<std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

class BitReader {
 public:
  explicit BitReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  std::uint32_t read(std::size_t bits) {
    std::uint32_t value = 0;
    for (std::size_t b = 0; b < bits; ++b, ++at_) value |= (bytes_[at_ / 8] >> (at_ % 8) & 1u) << b;
    return value;
  }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

void write_channel(const CodedChannel& coded, std::uint16_t first, int width, BitWriter& out) {
  out.write(static_cast<std::uint32_t>(coded.predictor), kPredictorBits);
  out.write(first, kValueBits);
  for (int g = 0; g < width / 4; ++g) {
    const std::size_t bits = coded.width[static_cast<std::size_t>(g)];
    out.write(static_cast<std::uint32_t>(bits), kWidthBits);
    for (int y = 0; y < kBlockRows; ++y)
      for (int x = 4 * g; x < 4 * g + 4; ++x)
        if (x + y != 0) out.write(coded.residual[static_cast<std::size_t>(y * width + x)], bits);
  }
}

void read_channel(BitReader& in, int width, Channel& codes) {
  const auto predictor = static_cast<Predictor>(in.read(kPredictorBits));
  const auto first = static_cast<std::uint16_t>(in.read(kValueBits));
  Channel residual{};
  for (int g = 0; g < width / 4; ++g) {
    const std::size_t bits = in.read(kWidthBits);
    for (int y = 0; y < kBlockRows; ++y)
      for (int x = 4 * g; x < 4 * g + 4; ++x)
        if (x + y != 0) residual[static_cast<std::size_t>(y * width + x)] = static_cast<std::uint16_t>(in.read(bits));
  }
  codes[0] = first;
  for (int y = 0; y < kBlockRows; ++y)
    for (int x = 0; x < width; ++x) {
      const auto i = static_cast<std::size_t>(y * width + x);
      if (i != 0)
        codes[i] = static_cast<std::uint16_t>(prediction(codes, width, x, y, predictor) + unzigzag(residual[i]));
    }
}

// Bytes of pixels, after checking the shape.
std::size_t raw_bytes(std::size_t halves, int width, int height, std::size_t burst_bytes) {
  TESSERA_CHECK((width == 4 || width == 8 || width == 16) && height == kBlockRows,
                "a block is 4, 8 or 16 pixels wide and 4 high");
  TESSERA_CHECK(halves == static_cast<std::size_t>(4 * width * height), "a block has four halves per pixel");
  TESSERA_CHECK(burst_bytes >= 8 && 2 * halves % burst_bytes == 0, "a raw block is whole bursts");
  return 2 * halves;
}

bool is_cleared(std::span<const std::uint16_t> halves) {
  return std::all_of(halves.begin(), halves.end(), [](std::uint16_t h) { return h == 0; });
}

std::size_t in_bursts(std::size_t bits, std::size_t burst_bytes) {
  return (bits + 8 * burst_bytes - 1) / (8 * burst_bytes) * burst_bytes;
}

}  // namespace

CompressedBlock compress_block(std::span<const std::uint16_t> halves, int width, int height, std::size_t burst_bytes) {
  const std::size_t raw = raw_bytes(halves.size(), width, height, burst_bytes);
  CompressedBlock block;
  if (is_cleared(halves)) return block;
  std::array<CodedChannel, 4> coded;
  std::array<std::uint16_t, 4> first;
  for (std::size_t c = 0; c < 4; ++c) {
    Channel codes;
    coded[c] = shortest_code(halves, width, c, codes);
    first[c] = codes[0];
    block.stream_bits += coded[c].bits;
  }
  block.payload_bytes = in_bursts(block.stream_bits, burst_bytes);
  if (block.payload_bytes >= raw) {
    block.raw = true;
    block.payload_bytes = raw;
    block.stream_bits = 8 * raw;
    for (std::size_t i = 0; i < halves.size(); ++i) {
      block.payload[2 * i] = static_cast<std::uint8_t>(halves[i] & 0xff);
      block.payload[2 * i + 1] = static_cast<std::uint8_t>(halves[i] >> 8);
    }
    return block;
  }
  BitWriter out(std::span(block.payload).first(block.payload_bytes));
  for (std::size_t c = 0; c < 4; ++c) write_channel(coded[c], first[c], width, out);
  return block;
}

void decompress_block(const CompressedBlock& block, int width, int height, std::span<std::uint16_t> halves) {
  raw_bytes(halves.size(), width, height, 8);
  if (block.payload_bytes == 0) return std::fill(halves.begin(), halves.end(), std::uint16_t{0});
  if (block.raw) {
    for (std::size_t i = 0; i < halves.size(); ++i)
      halves[i] = static_cast<std::uint16_t>(block.payload[2 * i] | block.payload[2 * i + 1] << 8);
    return;
  }
  BitReader in(std::span(block.payload).first(block.payload_bytes));
  for (std::size_t c = 0; c < 4; ++c) {
    Channel codes;
    read_channel(in, width, codes);
    for (std::size_t i = 0; i < halves.size() / 4; ++i) halves[4 * i + c] = half_of_code(codes[i]);
  }
}

std::size_t compressed_block_bytes(std::span<const std::uint16_t> halves, int width, int height,
                                   std::size_t burst_bytes) {
  const std::size_t raw = raw_bytes(halves.size(), width, height, burst_bytes);
  if (is_cleared(halves)) return 0;
  std::size_t bits = 0;
  Channel codes;
  for (std::size_t c = 0; c < 4; ++c) bits += shortest_code(halves, width, c, codes).bits;
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

}  // namespace tessera::tilecore

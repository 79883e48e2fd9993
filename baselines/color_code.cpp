#include "baselines/color_code.h"

#include <algorithm>
#include <array>
#include <bit>

#include "base/check.h"
#include "baselines/bit_stream.h"

namespace tessera::baselines {
namespace {

constexpr std::uint8_t kConstant = 0, kDeltas = 1, kRaw = 2;

std::uint32_t channel_of(std::uint32_t color, std::size_t c) { return color >> (8 * c) & 255u; }

struct Ranges {
  std::array<std::uint32_t, 4> least, width;
  std::size_t bytes;  // of a block of deltas
};

Ranges ranges_of(std::span<const std::uint32_t> colors) {
  Ranges out{};
  std::size_t bits = 0;
  for (std::size_t c = 0; c < 4; ++c) {
    std::uint32_t least = 255, greatest = 0;
    for (const std::uint32_t color : colors) {
      least = std::min(least, channel_of(color, c));
      greatest = std::max(greatest, channel_of(color, c));
    }
    out.least[c] = least;
    out.width[c] = static_cast<std::uint32_t>(std::bit_width(greatest - least));
    bits += out.width[c];
  }
  out.bytes = 1 + 8 + (bits * colors.size() + 7) / 8;
  return out;
}

void put_word(std::uint32_t word, std::vector<std::uint8_t>& out) {
  for (std::size_t c = 0; c < 4; ++c) out.push_back(static_cast<std::uint8_t>(channel_of(word, c)));
}

std::uint32_t word_at(std::span<const std::uint8_t> bytes, std::size_t at) {
  std::uint32_t word = 0;
  for (std::size_t c = 0; c < 4; ++c) word |= static_cast<std::uint32_t>(bytes[at + c]) << (8 * c);
  return word;
}

bool is_constant(std::span<const std::uint32_t> colors) {
  return std::all_of(colors.begin(), colors.end(), [&](std::uint32_t color) { return color == colors[0]; });
}

}  // namespace

std::vector<std::uint8_t> encode_colors(std::span<const std::uint32_t> colors) {
  TESSERA_CHECK(!colors.empty(), "a block has colours");
  std::vector<std::uint8_t> out;
  if (is_constant(colors)) {
    out.push_back(kConstant);
    put_word(colors[0], out);
    return out;
  }
  const Ranges ranges = ranges_of(colors);
  if (ranges.bytes >= 1 + 4 * colors.size()) {
    out.push_back(kRaw);
    for (const std::uint32_t color : colors) put_word(color, out);
    return out;
  }
  out.push_back(kDeltas);
  for (const std::uint32_t least : ranges.least) out.push_back(static_cast<std::uint8_t>(least));
  for (const std::uint32_t width : ranges.width) out.push_back(static_cast<std::uint8_t>(width));
  BitWriter bits;
  for (const std::uint32_t color : colors)
    for (std::size_t c = 0; c < 4; ++c) bits.put(channel_of(color, c) - ranges.least[c], ranges.width[c]);
  out.insert(out.end(), bits.bytes().begin(), bits.bytes().end());
  return out;
}

std::size_t color_code_bytes(std::span<const std::uint32_t> colors) {
  if (is_constant(colors)) return 5;
  return std::min(ranges_of(colors).bytes, 1 + 4 * colors.size());
}

std::vector<std::uint32_t> decode_colors(std::span<const std::uint8_t> bytes, std::size_t count) {
  if (bytes[0] == kConstant) return std::vector<std::uint32_t>(count, word_at(bytes, 1));
  std::vector<std::uint32_t> colors(count, 0);
  if (bytes[0] == kRaw) {
    for (std::size_t k = 0; k < count; ++k) colors[k] = word_at(bytes, 1 + 4 * k);
    return colors;
  }
  BitReader bits(bytes.subspan(9));
  for (std::uint32_t& color : colors)
    for (std::size_t c = 0; c < 4; ++c) color |= (bytes[1 + c] + bits.get(bytes[5 + c])) << (8 * c);
  return colors;
}

}  // namespace tessera::baselines

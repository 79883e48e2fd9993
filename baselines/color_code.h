#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace tessera::baselines {

// A block of colours (RGBA8, red in the lowest byte), compressed without loss as delta colour compression does.
//
//   a byte, the kind: 0 constant, 1 deltas, 2 as they are
//   constant: the colour (4)
//   deltas: per channel the least value (1), per channel the width of what exceeds it (1, 0 to 8); then the colours, bit
//     by bit without a gap, each channel with its width
//   as they are: the colours (4 each)
std::vector<std::uint8_t> encode_colors(std::span<const std::uint32_t> colors);
std::vector<std::uint32_t> decode_colors(std::span<const std::uint8_t> bytes, std::size_t count);

// Length of encode_colors(colors).
std::size_t color_code_bytes(std::span<const std::uint32_t> colors);

}  // namespace tessera::baselines

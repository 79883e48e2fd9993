#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace tessera::baselines {

// Positions of a block's vertices, snapped and delta-coded without loss: x and y in units of 1/256 pixel, depth as the
// bits of its float; of moving vertices, further what each of the three gains from the first motion key to the second.
//
// Per component, of 3 or 6: a byte (bits 0..5 width, 6 the mode) and 4 bytes of base. Then the vertices, bit by bit
// without a gap: of each component `width` bits. Mode 0: what the component exceeds the base by, the least of the
// block. Mode 1: what it exceeds that of the vertex before by (of the first: the base), in zigzag. The mode is the one
// that takes fewer bits. All sums are modulo 2^32.
using PositionWords = std::array<std::uint32_t, 6>;
inline constexpr std::size_t kStillWords = 3, kMovingWords = 6;
inline constexpr std::uint64_t kRawPositionBytes = 12;  // x, y, depth as floats, at each key

// Six numbers: x, y, depth at both keys. Nothing when one is not on the grid, as with vertices that are not projected:
// such blocks keep floats.
std::optional<PositionWords> position_words(const std::array<float, 6>& position, std::size_t words);
std::array<float, 6> position_of(const PositionWords& words, std::size_t count);

std::vector<std::uint8_t> encode_positions(std::span<const PositionWords> vertices, std::size_t words);
std::vector<PositionWords> decode_positions(std::span<const std::uint8_t> bytes, std::size_t count, std::size_t words);

// Bytes that a block's positions take, from their first bytes.
std::size_t position_bytes(std::span<const std::uint8_t> bytes, std::size_t count, std::size_t words);

}  // namespace tessera::baselines

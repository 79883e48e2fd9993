#include "baselines/position_code.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "baselines/bit_stream.h"

namespace tessera::baselines {
namespace {

constexpr float kSnapsPerPixel = 256;
constexpr float kLargestPixel = 1 << 22;
constexpr std::uint32_t kDeltaMode = 64, kWidthMask = 63;
constexpr std::size_t kComponentBytes = 5;

struct Component {
  bool deltas = false;
  std::uint32_t width = 0, base = 0;
};

std::uint32_t delta_of(std::span<const PositionWords> vertices, std::size_t v, std::size_t c) {
  return zigzag(static_cast<std::int32_t>(vertices[v][c] - (v == 0 ? vertices[0][c] : vertices[v - 1][c])));
}

Component choose(std::span<const PositionWords> vertices, std::size_t c) {
  const auto is_less = [&](const PositionWords& a, const PositionWords& b) {
    return static_cast<std::int32_t>(a[c]) < static_cast<std::int32_t>(b[c]);
  };
  const std::uint32_t least = (*std::min_element(vertices.begin(), vertices.end(), is_less))[c];
  std::uint32_t offsets = 0, deltas = 0;
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    offsets |= vertices[v][c] - least;
    deltas |= delta_of(vertices, v, c);
  }
  const auto offset_bits = static_cast<std::uint32_t>(std::bit_width(offsets)),
             delta_bits = static_cast<std::uint32_t>(std::bit_width(deltas));
  if (delta_bits < offset_bits) return {true, delta_bits, vertices[0][c]};
  return {false, offset_bits, least};
}

Component component_at(std::span<const std::uint8_t> bytes, std::size_t c) {
  Component component;
  const std::uint32_t head = bytes[c * kComponentBytes];
  component.deltas = (head & kDeltaMode) != 0;
  component.width = head & kWidthMask;
  std::memcpy(&component.base, &bytes[c * kComponentBytes + 1], sizeof component.base);
  return component;
}

}  // namespace

std::optional<PositionWords> position_words(const std::array<float, 6>& position, std::size_t words) {
  PositionWords out{};
  for (std::size_t c = 0; c < words; ++c) {
    if (c % 3 == 2) {
      out[c] = std::bit_cast<std::uint32_t>(position[c]);
      continue;
    }
    const float snapped = position[c] * kSnapsPerPixel;
    if (!(std::abs(position[c]) < kLargestPixel) || snapped != std::floor(snapped) ||
        (position[c] == 0 && std::signbit(position[c])))
      return std::nullopt;
    out[c] = static_cast<std::uint32_t>(static_cast<std::int32_t>(snapped));
  }
  for (std::size_t c = 3; c < words; ++c) out[c] -= out[c - 3];
  return out;
}

std::array<float, 6> position_of(const PositionWords& words, std::size_t count) {
  std::array<float, 6> out{};
  for (std::size_t c = 0; c < count; ++c) {
    const std::uint32_t word = words[c] + (c < 3 ? 0 : words[c - 3]);
    out[c] =
        c % 3 == 2 ? std::bit_cast<float>(word) : static_cast<float>(static_cast<std::int32_t>(word)) / kSnapsPerPixel;
  }
  return out;
}

std::vector<std::uint8_t> encode_positions(std::span<const PositionWords> vertices, std::size_t words) {
  std::vector<std::uint8_t> out(words * kComponentBytes, 0);
  std::vector<Component> components;
  for (std::size_t c = 0; c < words; ++c) {
    const Component component = choose(vertices, c);
    out[c * kComponentBytes] = static_cast<std::uint8_t>(component.width | (component.deltas ? kDeltaMode : 0u));
    std::memcpy(&out[c * kComponentBytes + 1], &component.base, sizeof component.base);
    components.push_back(component);
  }
  BitWriter bits;
  for (std::size_t v = 0; v < vertices.size(); ++v)
    for (std::size_t c = 0; c < words; ++c)
      bits.put(components[c].deltas ? delta_of(vertices, v, c) : vertices[v][c] - components[c].base,
               components[c].width);
  out.insert(out.end(), bits.bytes().begin(), bits.bytes().end());
  return out;
}

std::vector<PositionWords> decode_positions(std::span<const std::uint8_t> bytes, std::size_t count, std::size_t words) {
  std::vector<Component> components;
  for (std::size_t c = 0; c < words; ++c) components.push_back(component_at(bytes, c));
  BitReader bits(bytes.subspan(words * kComponentBytes));
  std::vector<PositionWords> vertices(count, PositionWords{});
  for (std::size_t v = 0; v < count; ++v)
    for (std::size_t c = 0; c < words; ++c) {
      const std::uint32_t code = bits.get(components[c].width);
      const std::uint32_t before = v == 0 ? components[c].base : vertices[v - 1][c];
      vertices[v][c] =
          components[c].deltas ? before + static_cast<std::uint32_t>(unzigzag(code)) : components[c].base + code;
    }
  return vertices;
}

std::size_t position_bytes(std::span<const std::uint8_t> bytes, std::size_t count, std::size_t words) {
  std::size_t bits = 0;
  for (std::size_t c = 0; c < words; ++c) bits += component_at(bytes, c).width;
  return words * kComponentBytes + (bits * count + 7) / 8;
}

}  // namespace tessera::baselines

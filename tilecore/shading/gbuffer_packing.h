#pragma once

// A sample of the packed G-buffer: four words. The code is plain arithmetic without branches, as the shaders whose instructions
// are counted compile it, too.
//
//   word 0   square roots of the base colour, 8 bits each; occlusion, 8 bits
//   word 1   normal, octahedral (Meyer et al. 2010), 16 bits for each axis
//   word 2   metalness, roughness, 8 bits each; within its pixel, the sample whose invocation this one takes, 8 bits
//   word 3   emission: 9 bits for each channel under a shared exponent of 5 bits, as rgb9e5
//
// NaN becomes 0; values out of range become the nearest bound.

#include <array>
#include <bit>
#include <cstdint>

namespace tessera::tilecore {

using PackedGbuffer = std::array<std::uint32_t, 4>;

namespace packing {

inline float between(float value, float low, float high) { return __builtin_fminf(__builtin_fmaxf(value, low), high); }
// [0, 1] in 2^bits - 1 steps.
inline std::uint32_t to_steps(float value, float steps) {
  return static_cast<std::uint32_t>(static_cast<std::int32_t>(between(value, 0.0f, 1.0f) * steps + 0.5f));
}
inline std::uint32_t bits_of(std::uint32_t word, int from, int count) { return word >> from & ((1u << count) - 1); }
inline float from_steps(std::uint32_t value, float steps) { return static_cast<float>(value) * (1.0f / steps); }
inline float sign_of(float value) { return value < 0.0f ? -1.0f : 1.0f; }

inline constexpr int kMantissa = 9, kExponentBias = 15;

}  // namespace packing

// `values`: as GbufferPlanes, base colour to normal.
inline PackedGbuffer pack_gbuffer(const std::array<float, 12>& values, std::uint32_t leader) {
  using namespace packing;
  PackedGbuffer words{};
  for (int c = 0; c < 3; ++c)
    words[0] |= to_steps(__builtin_sqrtf(between(values[static_cast<std::size_t>(c)], 0.0f, 1.0f)), 255.0f) << (8 * c);
  words[0] |= to_steps(values[5], 255.0f) << 24;

  const float nx = values[9], ny = values[10], nz = values[11];
  const float norm = __builtin_fabsf(nx) + __builtin_fabsf(ny) + __builtin_fabsf(nz),
              share = 1.0f / __builtin_fmaxf(norm, 1e-20f), x = nx * share, y = ny * share;
  const bool below = nz < 0.0f;
  const float u = below ? (1.0f - __builtin_fabsf(y)) * sign_of(x) : x,
              v = below ? (1.0f - __builtin_fabsf(x)) * sign_of(y) : y;
  // An even number of steps: axes are exact.
  words[1] = to_steps(u * 0.5f + 0.5f, 65534.0f) | to_steps(v * 0.5f + 0.5f, 65534.0f) << 16;

  words[2] = to_steps(values[3], 255.0f) | to_steps(values[4], 255.0f) << 8 | leader << 16;

  constexpr float kMost = 65408.0f;
  const float r = between(values[6], 0.0f, kMost), g = between(values[7], 0.0f, kMost),
              b = between(values[8], 0.0f, kMost), most = __builtin_fmaxf(__builtin_fmaxf(r, g), b);
  // Its exponent, one larger where the mantissa would round up to 2^9.
  const std::uint32_t raised = std::bit_cast<std::uint32_t>(most * (512.0f / 511.5f));
  const std::int32_t whole = static_cast<std::int32_t>(raised >> 23) - 127 + 1, least = -kExponentBias,
                     exponent = whole > least ? whole : least;
  const float scale = std::bit_cast<float>(static_cast<std::uint32_t>(127 + kMantissa - exponent) << 23);
  const auto mantissa = [&](float value) {
    return static_cast<std::uint32_t>(static_cast<std::int32_t>(value * scale + 0.5f));
  };
  words[3] =
      mantissa(r) | mantissa(g) << 9 | mantissa(b) << 18 | static_cast<std::uint32_t>(exponent + kExponentBias) << 27;
  return words;
}

inline std::uint32_t leader_of(const PackedGbuffer& words) { return packing::bits_of(words[2], 16, 8); }

inline std::array<float, 12> unpack_gbuffer(const PackedGbuffer& words) {
  using namespace packing;
  std::array<float, 12> values{};
  for (int c = 0; c < 3; ++c) {
    const float root = from_steps(bits_of(words[0], 8 * c, 8), 255.0f);
    values[static_cast<std::size_t>(c)] = root * root;
  }
  values[5] = from_steps(words[0] >> 24, 255.0f);
  values[3] = from_steps(bits_of(words[2], 0, 8), 255.0f);
  values[4] = from_steps(bits_of(words[2], 8, 8), 255.0f);

  const float u = from_steps(bits_of(words[1], 0, 16), 32767.0f) - 1.0f,
              v = from_steps(words[1] >> 16, 32767.0f) - 1.0f, z = 1.0f - __builtin_fabsf(u) - __builtin_fabsf(v);
  const bool below = z < 0.0f;
  const float x = below ? (1.0f - __builtin_fabsf(v)) * sign_of(u) : u,
              y = below ? (1.0f - __builtin_fabsf(u)) * sign_of(v) : v,
              share = 1.0f / __builtin_sqrtf(x * x + y * y + z * z);
  values[9] = x * share, values[10] = y * share, values[11] = z * share;

  const std::uint32_t exponent = words[3] >> 27;
  const float scale = std::bit_cast<float>((127u - kExponentBias - kMantissa + exponent) << 23);
  for (int c = 0; c < 3; ++c)
    values[static_cast<std::size_t>(6 + c)] = static_cast<float>(bits_of(words[3], 9 * c, 9)) * scale;
  return values;
}

}  // namespace tessera::tilecore

#pragma once

#include <bit>
#include <cstdint>

namespace tessera {

// The nearest number of IEC 60559's binary16 (11 significant bits, exponents -14 to 15), as a float. Ties go to the
// even number, sizes of 65520 or more become infinite, and NaN stays NaN.
inline float round_to_half(float value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  const std::uint32_t size = bits & 0x7FFFFFFFu, sign = bits & 0x80000000u;
  if (size > 0x7F800000u) return value;
  if (size >= 0x477FF000u) return std::bit_cast<float>(sign | 0x7F800000u);
  if (size >= 0x38800000u) {  // normal: 13 bits of the fraction go
    const std::uint32_t rounded = size + 0xFFFu + (size >> 13 & 1u);
    return std::bit_cast<float>(sign | (rounded & ~0x1FFFu));
  }
  // Subnormal: multiples of 2^-24. Adding 0.5, whose last bit is 2^-24, rounds to them; subtracting it again is exact.
  const float magnitude = (std::bit_cast<float>(size) + 0.5f) - 0.5f;
  return std::bit_cast<float>(sign | std::bit_cast<std::uint32_t>(magnitude));
}

}  // namespace tessera

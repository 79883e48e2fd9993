#pragma once

#include <cstdint>
#include <cstring>

#include "base/vec.h"

namespace tessera::tilecore {

// A colour's four channels, or a row of a block. Element-wise arithmetic without fusing: the same bits with any
// instruction set.
using Channels [[gnu::vector_size(16)]] = float;

// Truth per element: all bits or none.
using ChannelMask [[gnu::vector_size(16)]] = std::int32_t;

inline Channels load(const float* four) {
  Channels c;
  std::memcpy(&c, four, sizeof c);
  return c;
}
inline Channels load(const Vec4* color) { return load(&color->x); }
inline void store(const Channels& c, Vec4* color) { std::memcpy(&color->x, &c, sizeof c); }

inline ChannelMask load(const std::uint32_t* four) {
  ChannelMask m;
  std::memcpy(&m, four, sizeof m);
  return m;
}

inline Channels magnitude(const Channels& c) { return (Channels)((ChannelMask)c & 0x7fffffff); }

inline bool none(const ChannelMask& m) {
  std::uint64_t bits[2];
  std::memcpy(bits, &m, sizeof bits);
  return (bits[0] | bits[1]) == 0;
}
inline bool all(const ChannelMask& m) { return none(~m); }

inline bool is_zero(const Channels& c) { return c[0] == 0.0f && c[1] == 0.0f && c[2] == 0.0f && c[3] == 0.0f; }

// x - x is +0 or NaN.
inline bool is_finite(const Channels& c) {
  const Channels zero = c - c;
  std::uint64_t bits[2];
  std::memcpy(bits, &zero, sizeof bits);
  return (bits[0] | bits[1]) == 0;
}

}  // namespace tessera::tilecore

#include "base/ktx2/astc_numbers.h"

#include <algorithm>
#include <cstdlib>

namespace tessera::ktx2 {
namespace {

using Digits = std::array<std::uint8_t, 5>;

constexpr std::uint8_t bit(unsigned value, unsigned at) { return static_cast<std::uint8_t>((value >> at) & 1u); }
constexpr std::uint8_t two_bits(unsigned value, unsigned at) { return static_cast<std::uint8_t>((value >> at) & 3u); }

// Five digits of base 3 in 8 bits.
constexpr Digits trits_of(unsigned packed) {
  Digits t{};
  unsigned rest = packed & 31u;
  if (((packed >> 2) & 7u) == 7) {
    rest = ((packed >> 5) << 2) | (packed & 3u);
    t[4] = t[3] = 2;
  } else if (two_bits(packed, 5) == 3) {
    t[4] = 2;
    t[3] = bit(packed, 7);
  } else {
    t[4] = bit(packed, 7);
    t[3] = two_bits(packed, 5);
  }
  if (two_bits(rest, 0) == 3) {
    t[2] = 2;
    t[1] = bit(rest, 4);
    t[0] = static_cast<std::uint8_t>(2 * bit(rest, 3) + (bit(rest, 2) & ~bit(rest, 3) & 1));
  } else if (two_bits(rest, 2) == 3) {
    t[2] = t[1] = 2;
    t[0] = two_bits(rest, 0);
  } else {
    t[2] = bit(rest, 4);
    t[1] = two_bits(rest, 2);
    t[0] = static_cast<std::uint8_t>(2 * bit(rest, 1) + (bit(rest, 0) & ~bit(rest, 1) & 1));
  }
  return t;
}

// Three digits of base 5 in 7 bits.
constexpr Digits quints_of(unsigned packed) {
  Digits q{};
  if (two_bits(packed, 1) == 3 && two_bits(packed, 5) == 0) {
    const int low = bit(packed, 0);
    q[2] = static_cast<std::uint8_t>(4 * low + 2 * (bit(packed, 4) & ~low & 1) + (bit(packed, 3) & ~low & 1));
    q[1] = q[0] = 4;
    return q;
  }
  unsigned rest = packed & 31u;
  if (two_bits(packed, 1) == 3) {
    q[2] = 4;
    rest = (packed & 0x18u) | ((~packed >> 4) & 6u) | (packed & 1u);
  } else {
    q[2] = two_bits(packed, 5);
  }
  if ((rest & 7u) == 5) {
    q[1] = 4;
    q[0] = two_bits(rest, 3);
  } else {
    q[1] = two_bits(rest, 3);
    q[0] = static_cast<std::uint8_t>(rest & 7u);
  }
  return q;
}

// The digits of every packed number, and the packed number of all digits, of which the first counts least. Where there
// are several, trits have the smallest and quints the greatest one, as Basis Universal's transcoder has it.
struct DigitTables {
  std::array<Digits, 256> trits{};
  std::array<Digits, 128> quints{};
  std::array<std::uint8_t, 243> packed_trits{};
  std::array<std::uint8_t, 125> packed_quints{};
};

constexpr DigitTables digit_tables() {
  DigitTables tables;
  for (unsigned packed = 256; packed-- > 0;) {
    const Digits t = tables.trits[packed] = trits_of(packed);
    tables.packed_trits[t[0] + 3u * (t[1] + 3u * (t[2] + 3u * (t[3] + 3u * t[4])))] = static_cast<std::uint8_t>(packed);
  }
  for (unsigned packed = 0; packed < 128; ++packed) {
    const Digits q = tables.quints[packed] = quints_of(packed);
    tables.packed_quints[q[0] + 5u * (q[1] + 5u * q[2])] = static_cast<std::uint8_t>(packed);
  }
  return tables;
}
constexpr DigitTables kDigits = digit_tables();

// How many bits of the packed digits follow each value's own bits.
constexpr std::array<unsigned, 5> kBitsWithTrits = {2, 2, 1, 2, 1};
constexpr std::array<unsigned, 3> kBitsWithQuints = {3, 2, 2};

std::span<const unsigned> bits_after(AstcRange range) {
  return range.base == 3 ? std::span<const unsigned>(kBitsWithTrits) : std::span<const unsigned>(kBitsWithQuints);
}

// Letters of a pattern, high bit first, stand for the bits of `value` from bit 1 (b) up; '0' for nothing.
unsigned spread_bits(const char* pattern, int value) {
  unsigned out = 0;
  for (; *pattern != '\0'; ++pattern)
    out = 2 * out + (*pattern == '0' ? 0u : bit(static_cast<unsigned>(value), static_cast<unsigned>(*pattern - 'a')));
  return out;
}

// Pattern that spreads the bits below a digit, and the factor of the digit (tables "Endpoint unquantization parameters"
// and "Weight unquantization parameters").
struct Spread {
  const char* pattern;
  unsigned factor;
};
Spread endpoint_spread(AstcRange range) {
  static constexpr Spread kTrit[] = {{"000000000", 204}, {"b000b0bb0", 93}, {"cb000cbcb", 44},
                                     {"dcb000dcb", 22},  {"edcb000ed", 11}, {"fedcb000f", 5}};
  static constexpr Spread kQuint[] = {
      {"000000000", 113}, {"b0000bb00", 54}, {"cb0000cbc", 26}, {"dcb0000dc", 13}, {"edcb0000e", 6}};
  return range.base == 3 ? kTrit[range.bits - 1] : kQuint[range.bits - 1];
}
Spread weight_spread(AstcRange range) {
  static constexpr Spread kTrit[] = {{"0000000", 50}, {"b000b0b", 23}, {"cb000cb", 11}};
  static constexpr Spread kQuint[] = {{"0000000", 28}, {"b0000b0", 13}};
  return range.base == 3 ? kTrit[range.bits - 1] : kQuint[range.bits - 1];
}

// `width` bits from the repeated bits of a value.
int repeated(int value, int bits, int width) {
  int out = 0;
  for (int left = width; left > 0; left -= bits) out |= left >= bits ? value << (left - bits) : value >> (bits - left);
  return out;
}

// hash52 of the specification.
std::uint32_t partition_hash(std::uint32_t p) {
  p ^= p >> 15;
  p -= p << 17;
  p += p << 7;
  p += p << 4;
  p ^= p >> 5;
  p += p << 16;
  p ^= p >> 7;
  p ^= p >> 3;
  p ^= p << 6;
  p ^= p >> 17;
  return p;
}

}  // namespace

int astc_endpoint(AstcRange range, int value) {
  if (range.base == 1) return repeated(value, range.bits, 8);
  const auto [pattern, factor] = endpoint_spread(range);
  const unsigned ones = (value & 1) != 0 ? 0x1FFu : 0u;
  const unsigned sum = (static_cast<unsigned>(value >> range.bits) * factor + spread_bits(pattern, value)) ^ ones;
  return static_cast<int>((ones & 0x80u) | (sum >> 2));
}

int astc_weight(AstcRange range, int value) {
  int weight = 0;
  if (range.base == 1) {
    weight = repeated(value, range.bits, 6);
  } else if (range.bits == 0) {
    static constexpr int kThirds[] = {0, 32, 63}, kFifths[] = {0, 16, 32, 47, 63};
    weight = range.base == 3 ? kThirds[value] : kFifths[value];
  } else {
    const auto [pattern, factor] = weight_spread(range);
    const unsigned ones = (value & 1) != 0 ? 0x7Fu : 0u;
    const unsigned sum = (static_cast<unsigned>(value >> range.bits) * factor + spread_bits(pattern, value)) ^ ones;
    weight = static_cast<int>((ones & 0x20u) | (sum >> 2));
  }
  return weight > 32 ? weight + 1 : weight;
}

int nearest_astc_endpoint(AstcRange range, int wanted) {
  int best = 0, best_distance = 1 << 20;
  for (int value = 0; value < range.levels(); ++value) {
    const int number = astc_endpoint(range, value),
              distance = 2 * std::abs(number - wanted) + (number > wanted ? 1 : 0);
    if (distance < best_distance) best = value, best_distance = distance;
  }
  return best;
}

std::uint32_t get_bits(const AstcBytes& bytes, unsigned at, unsigned count) {
  std::uint64_t window = 0;
  for (unsigned i = 0; i < 5 && at / 8 + i < bytes.size(); ++i)
    window |= static_cast<std::uint64_t>(bytes[at / 8 + i]) << (8 * i);
  return static_cast<std::uint32_t>((window >> (at % 8)) & ((std::uint64_t{1} << count) - 1));
}

void put_bits(AstcBytes& bytes, unsigned at, unsigned count, std::uint32_t value) {
  for (unsigned i = 0; i < count; ++i, ++at)
    bytes[at / 8] = static_cast<std::uint8_t>(bytes[at / 8] | (((value >> i) & 1u) << (at % 8)));
}

AstcBytes reversed_bits(const AstcBytes& bytes) {
  AstcBytes out{};
  for (unsigned at = 0; at < 128; ++at)
    out[at / 8] = static_cast<std::uint8_t>(out[at / 8] | (get_bits(bytes, 127 - at, 1) << (at % 8)));
  return out;
}

void put_sequence(AstcBytes& bytes, unsigned at, AstcRange range, std::span<const std::uint8_t> values) {
  const unsigned end = at + range.sequence_bits(static_cast<unsigned>(values.size()));
  const auto bits = static_cast<unsigned>(range.bits);
  if (range.base == 1) {
    for (std::size_t i = 0; i < values.size(); ++i, at += bits) put_bits(bytes, at, bits, values[i]);
    return;
  }
  const std::span<const unsigned> after = bits_after(range);
  for (std::size_t first = 0; first < values.size(); first += after.size()) {
    const std::span<const std::uint8_t> group = values.subspan(first, std::min(after.size(), values.size() - first));
    unsigned digits = 0;
    for (std::size_t i = group.size(); i-- > 0;)
      digits = digits * static_cast<unsigned>(range.base) + (static_cast<unsigned>(group[i]) >> bits);
    unsigned packed = range.base == 3 ? kDigits.packed_trits[digits] : kDigits.packed_quints[digits];
    for (std::size_t i = 0; i < after.size() && at < end; ++i) {
      if (i < group.size()) {
        put_bits(bytes, at, bits, group[i] & ((1u << bits) - 1));
        at += bits;
      }
      const unsigned count = std::min(after[i], end - at);
      put_bits(bytes, at, count, packed);
      packed >>= after[i];
      at += count;
    }
  }
}

void get_sequence(const AstcBytes& bytes, unsigned at, AstcRange range, std::span<std::uint8_t> values) {
  const unsigned end = at + range.sequence_bits(static_cast<unsigned>(values.size()));
  const auto bits = static_cast<unsigned>(range.bits);
  if (range.base == 1) {
    for (std::size_t i = 0; i < values.size(); ++i, at += bits)
      values[i] = static_cast<std::uint8_t>(get_bits(bytes, at, bits));
    return;
  }
  const std::span<const unsigned> after = bits_after(range);
  for (std::size_t first = 0; first < values.size(); first += after.size()) {
    const std::span<std::uint8_t> group = values.subspan(first, std::min(after.size(), values.size() - first));
    unsigned packed = 0, place = 0;
    for (std::size_t i = 0; i < group.size(); ++i) {
      group[i] = static_cast<std::uint8_t>(get_bits(bytes, at, bits));
      at += bits;
      const unsigned count = std::min(after[i], end - at);
      packed |= get_bits(bytes, at, count) << place;
      place += count;
      at += count;
    }
    const Digits& digits = range.base == 3 ? kDigits.trits[packed] : kDigits.quints[packed];
    for (std::size_t i = 0; i < group.size(); ++i) group[i] = static_cast<std::uint8_t>(group[i] | (digits[i] << bits));
  }
}

std::array<std::uint8_t, 16> astc_partition(std::uint32_t seed, int subsets) {
  std::array<std::uint8_t, 16> pattern{};
  if (subsets < 2) return pattern;
  const std::uint32_t number = partition_hash(seed + 1024u * static_cast<std::uint32_t>(subsets - 1));
  // Slopes of three planes: squares of four bits each, reduced by the seed; a texel belongs to the highest plane.
  // The third dimension and a fourth plane are of no account here.
  const unsigned by_seed = (seed & 2u) != 0 ? 4 : 5, by_subsets = subsets == 3 ? 6 : 5;
  const unsigned odd = (seed & 1u) != 0 ? by_seed : by_subsets, even = (seed & 1u) != 0 ? by_subsets : by_seed;
  const auto slope = [&](unsigned at) {
    const std::uint32_t root = (number >> (4 * at)) & 15u;
    return (root * root) >> (at % 2 == 0 ? odd : even);
  };
  static constexpr std::array<unsigned, 3> kOffsetAt = {14, 10, 6};
  for (unsigned texel = 0; texel < 16; ++texel) {
    // Coordinates of blocks with fewer than 31 texels count twice.
    const unsigned x = texel % 4 * 2, y = texel / 4 * 2;
    unsigned highest = 0;
    for (unsigned plane = 0; plane < static_cast<unsigned>(subsets); ++plane) {
      const unsigned height = (slope(2 * plane) * x + slope(2 * plane + 1) * y + (number >> kOffsetAt[plane])) & 63u;
      // Between equal heights the first plane gets the texel.
      if (plane == 0 || height > highest) highest = height, pattern[texel] = static_cast<std::uint8_t>(plane);
    }
  }
  return pattern;
}

}  // namespace tessera::ktx2

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>

namespace tessera {

// CRC-64 as in ECMA-182, reflected, all ones before and after (CRC-64/XZ): any error of up to 64 bits in a row is
// found, of other changes all but one in 2^64.
class Crc64 {
 public:
  void add(std::span<const std::byte> bytes) {
    const Tables& tables = kTables;
    std::size_t i = 0;
    for (; i + 8 <= bytes.size(); i += 8) {
      std::uint64_t word = 0;
      for (std::size_t k = 0; k < 8; ++k) word |= std::to_integer<std::uint64_t>(bytes[i + k]) << (8 * k);
      word ^= state_;
      state_ = 0;
      for (std::size_t k = 0; k < 8; ++k) state_ ^= tables[7 - k][word >> (8 * k) & 0xff];
    }
    for (; i < bytes.size(); ++i)
      state_ = state_ >> 8 ^ tables[0][(state_ ^ std::to_integer<std::uint64_t>(bytes[i])) & 0xff];
  }
  // The bytes of numbers, in the host's order. Types with holes between members are refused.
  template <class T>
  void add_values(std::span<const T> values) {
    static_assert(std::is_trivially_copyable_v<T>);
    static_assert(std::has_unique_object_representations_v<T> || std::is_floating_point_v<T>);
    add(std::as_bytes(values));
  }
  template <class T>
  void add_value(const T& value) {
    add_values(std::span<const T>(&value, 1));
  }

  std::uint64_t value() const { return ~state_; }

 private:
  using Tables = std::array<std::array<std::uint64_t, 256>, 8>;
  static constexpr Tables make_tables() {
    Tables tables{};
    for (std::size_t byte = 0; byte < 256; ++byte) {
      std::uint64_t crc = byte;
      for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ ((crc & 1) != 0 ? 0xC96C5795D7870F42u : 0u);
      tables[0][byte] = crc;
    }
    for (std::size_t k = 1; k < 8; ++k)
      for (std::size_t byte = 0; byte < 256; ++byte)
        tables[k][byte] = tables[k - 1][byte] >> 8 ^ tables[0][tables[k - 1][byte] & 0xff];
    return tables;
  }
  static const Tables kTables;

  std::uint64_t state_ = ~std::uint64_t{0};
};

inline constexpr Crc64::Tables Crc64::kTables = Crc64::make_tables();

}  // namespace tessera

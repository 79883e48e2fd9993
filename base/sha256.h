#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace tessera {

// SHA-256 (FIPS 180-4) of bytes that come in pieces of any length. Results are named by the hash of their inputs.
class Sha256 {
 public:
  void add(std::span<const std::uint8_t> bytes);
  void add(std::string_view text) { add(std::span(reinterpret_cast<const std::uint8_t*>(text.data()), text.size())); }

  // 64 lower-case hexadecimal digits. Nothing may be added after it.
  std::string finish();

 private:
  void mix_block(const std::uint8_t* block);

  std::array<std::uint32_t, 8> state_{0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                                      0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
  std::array<std::uint8_t, 64> block_{};
  std::uint64_t length_ = 0;  // bytes so far; length_ % 64 of them wait in block_
};

std::string sha256_hex(std::string_view text);

// The first 32 of these digits of the hash of `text`: the name of a file that depends on `text` alone.
std::string sha256_name(std::string_view text);

}  // namespace tessera

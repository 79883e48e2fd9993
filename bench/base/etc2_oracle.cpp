// Compares ETC2 blocks as Tessera and Mesa (OSMesa) decode them, bit by bit: random bytes, with every mode equally often.
//
//   tessera_etc2_oracle   prints the number of compared texels and blocks; fails where one differs
#include <array>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <random>
#include <span>
#include <vector>

#include "base/ktx2/etc2_block.h"
#include "bench/support/osmesa_context.h"
#include "bench/support/osmesa_objects.h"

namespace tessera::bench {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr int kBlocksAcross = 256, kSide = 4 * kBlocksAcross;

// kBlocksAcross^2 blocks as Mesa decodes them: RGBA8, rows from the first on.
Bytes by_mesa(const Bytes& blocks, GLenum format) {
  const GLuint name = texture(GL_TEXTURE_2D);
  glCompressedTexImage2D(GL_TEXTURE_2D, 0, format, kSide, kSide, 0, static_cast<GLsizei>(blocks.size()), blocks.data());
  Bytes texels(std::size_t{4} * kSide * kSide);
  glGetTexImage(GL_TEXTURE_2D, 0, GL_RGBA, GL_UNSIGNED_BYTE, texels.data());
  expect_no_error();
  glDeleteTextures(1, &name);
  return texels;
}

Bytes by_us(const Bytes& blocks, std::size_t block_bytes) {
  Bytes texels(std::size_t{4} * kSide * kSide);
  for (std::size_t block = 0; block < std::size_t{kBlocksAcross} * kBlocksAcross; ++block) {
    const std::uint8_t* bytes = &blocks[block * block_bytes];
    ktx2::TexelBlock decoded;
    decoded.fill({0, 0, 0, 255});
    if (block_bytes == 16) ktx2::decode_eac_alpha(std::span<const std::uint8_t, 8>(bytes, 8), decoded);
    ktx2::decode_etc2_rgb(std::span<const std::uint8_t, 8>(bytes + block_bytes - 8, 8), decoded);
    const std::size_t x = 4 * (block % kBlocksAcross), y = 4 * (block / kBlocksAcross);
    for (std::size_t t = 0; t < 16; ++t)
      for (std::size_t c = 0; c < 4; ++c) texels[4 * ((y + t / 4) * kSide + x + t % 4) + c] = decoded[t][c];
  }
  return texels;
}

// Bit `number` of a block's word, the first byte being the highest.
void set_bit(std::uint8_t* block, unsigned number, bool value) {
  std::uint8_t& byte = block[7 - number / 8];
  byte = static_cast<std::uint8_t>((byte & ~(1u << number % 8)) | (value ? 1u : 0u) << number % 8);
}

// Sets one of the modes individual, differential, T, H and planar: by the differential bit, and by the first channel
// whose sum of base and difference overflows.
void choose_mode(std::uint8_t* block, unsigned mode, std::mt19937& random) {
  constexpr std::array<unsigned, 3> kBaseAt = {59, 51, 43};
  set_bit(block, 33, mode != 0);
  if (mode == 0) return;
  for (unsigned channel = 0; channel < 3; ++channel) {
    const bool overflows = channel + 2 == mode;
    unsigned base = 0, difference = 0;
    do {
      base = random() % 32, difference = random() % 8;
    } while ((base + (difference ^ 4u) - 4 > 31) != overflows);
    for (unsigned bit = 0; bit < 5; ++bit) set_bit(block, kBaseAt[channel] + bit, (base >> bit & 1) != 0);
    for (unsigned bit = 0; bit < 3; ++bit) set_bit(block, kBaseAt[channel] - 3 + bit, (difference >> bit & 1) != 0);
    if (overflows) return;  // later channels keep their bits
  }
}

std::size_t different(const Bytes& a, const Bytes& b) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) count += a[i] != b[i] ? 1 : 0;
  return count;
}

int compare() {
  const OsMesaContext context(1);
  std::mt19937 random(20);
  std::size_t wrong = 0, texels = 0, twin = 0;
  for (const std::size_t block_bytes : {8u, 16u}) {
    const GLenum format = block_bytes == 8 ? GL_COMPRESSED_RGB8_ETC2 : GL_COMPRESSED_RGBA8_ETC2_EAC;
    for (int round = 0; round < 4; ++round) {
      Bytes blocks(block_bytes * kBlocksAcross * kBlocksAcross);
      for (std::uint8_t& byte : blocks) byte = static_cast<std::uint8_t>(random());
      if (round > 0)
        for (std::size_t block = 0; block < std::size_t{kBlocksAcross} * kBlocksAcross; ++block)
          choose_mode(&blocks[block * block_bytes + block_bytes - 8], block % 5, random);
      const Bytes mesa = by_mesa(blocks, format);
      wrong += different(mesa, by_us(blocks, block_bytes));
      texels += mesa.size() / 4;
      // The twin: another bit must give another image.
      for (std::size_t at = block_bytes - 1; at < blocks.size(); at += block_bytes) blocks[at] ^= 1;
      twin += different(mesa, by_us(blocks, block_bytes));
    }
  }
  std::printf("%zu texels of blocks of ETC2 by Tessera and by Mesa (%s): %zu bytes differ; %zu where a bit is wrong\n",
              texels, context.renderer().c_str(), wrong, twin);
  return wrong == 0 && twin > texels / 100 ? 0 : 1;
}

}  // namespace
}  // namespace tessera::bench

int main() try { return tessera::bench::compare(); } catch (const std::exception& error) {
  std::fprintf(stderr, "tessera_etc2_oracle: %s\n", error.what());
  return 1;
}

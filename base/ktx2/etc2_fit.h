#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "base/ktx2/etc2_block.h"

// Search for blocks of ETC2 and EAC near given texels, in whole numbers: the same bits on every host.
namespace tessera::ktx2 {

// Returns the block of ETC2 RGB with the least squared error among the tried ones, for the colours of 16 texels. It
// tries both splits into halves with 4 and with 5 bits, T, H and planar. Each starts from the texels' means or least
// squares and moves as long as the error falls.
EtcBytes fit_etc2_rgb(const TexelBlock& texels);

// Returns the block of EAC nearest to 16 values, among the tried ones. Exact where all values are equal.
//
// Invariants (cited by the tests):
//   EA1  A block of texels with equal alpha is encoded without error.
EacValues fit_eac(std::span<const std::uint8_t, 16> values);

// Encodes 16 texels to a block of bytes.size() bytes: 8 hold their colours; of 16, the first 8 hold their alpha as EAC.
// Replaces the encoded channels of `texels` by their decoded values.
void encode_etc2(const TexelBlock& wanted, std::span<std::uint8_t> bytes, TexelBlock& texels);

}  // namespace tessera::ktx2

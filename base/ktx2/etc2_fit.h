#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "base/ktx2/etc2_block.h"

// Blocks of ETC2 and EAC near given texels, by search in whole numbers: the same bits everywhere.
namespace tessera::ktx2 {

// The block of ETC2 RGB for the colours of 16 texels, of least squared error among what is tried: halves either way
// with 4 and with 5 bits, T, H and planar, each from the texels' means or least squares and moved as long as that
// helps.
EtcBytes fit_etc2_rgb(const TexelBlock& texels);

// The block of EAC nearest to 16 values, among what is tried. Exact where all values are the same.
//
// Invariants (cited by the tests):
//   EA1  A block of one alpha comes back as it was.
EacValues fit_eac(std::span<const std::uint8_t, 16> values);

// A block for 16 texels, `bytes` of it: 8 for their colours, or 16, of which the first 8 are EAC's for their alpha.
// Replaces those channels of `texels` by what it decodes to.
void encode_etc2(const TexelBlock& wanted, std::span<std::uint8_t> bytes, TexelBlock& texels);

}  // namespace tessera::ktx2

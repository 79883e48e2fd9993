#pragma once

#include <cstdint>

#include "base/ktx2/astc_block.h"

namespace tessera::ktx2 {

// A block of these texels, of one subset: one colour exactly; else of the modes with one line of colours, 4 to 32 steps
// on it, and for alpha a line of its own, the one of least squared error. Ends start at the extremes along the principal
// axis and move by least squares. Hints for ETC1 and EAC say what costs a transcoder least, those for BC1 are off.
//
// Invariants (cited by the tests):
//   UE1  Texels of one colour come back exactly; opaque greys, whatever they are, within half a step of 16 levels, 8.5
//        of 255, and rounding, as root of the mean square.
//   UE2  Every block is one that read_uastc() reads.
//   UE3  The same texels give the same bytes.
AstcBytes encode_uastc(const TexelBlock& texels);

}  // namespace tessera::ktx2

#pragma once

#include <span>
#include <string>
#include <vector>

#include "base/ktx2/ktx2_writer.h"

namespace tessera::ktx2 {

// BasisLZ (KTX 2.0, appendices "BasisLZ Global Data" and "BasisLZ/ETC1S Bitstream"), as read_basis_lz() and
// read_etc1s_slice() read it.
struct BasisLzFile {
  std::string global_data;
  std::vector<std::string> levels;  // slices of each: colour, then alpha
};

// Texels become the blocks of fit_etc1s(); alpha those of a grey image of its own.
//
// Invariants (cited by the tests):
//   EB1  A file decodes to the colours of the fit's blocks, whatever the size of the levels.
//   EB2  The same texels give the same bytes.
BasisLzFile encode_basis_lz(std::span<const LevelToWrite> levels, bool alpha);

}  // namespace tessera::ktx2

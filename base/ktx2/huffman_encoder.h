#pragma once

#include <cstdint>
#include <vector>

#include "base/ktx2/bit_writer.h"

namespace tessera::ktx2 {

// A Huffman code made from how often symbols occur, of the kind that HuffmanCode reads.
//
// Invariants (cited by the tests):
//   HE1  What it writes HuffmanCode reads back: the table, then every symbol that occurs.
//   HE2  No code is longer than 16 bits, whatever the counts.
class HuffmanEncoder {
 public:
  // `counts` by symbol, at most HuffmanCode::kMaxSymbols. Where none occurs symbol 0 gets a code: readers of BasisLZ
  // want one in each table.
  explicit HuffmanEncoder(std::vector<std::uint64_t> counts);

  // The table, as HuffmanCode::read() wants it.
  void write_table(BitWriter& writer) const;
  // A symbol that occurs.
  void write(std::uint32_t symbol, BitWriter& writer) const;

 private:
  std::vector<std::uint8_t> lengths_;
  std::vector<std::uint16_t> codes_;  // the first bit of a code is its lowest
};

}  // namespace tessera::ktx2

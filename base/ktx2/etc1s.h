#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/ktx2/huffman.h"

// BasisLZ (KTX 2.0, appendices "BasisLZ Global Data" and "BasisLZ/ETC1S Bitstream"): textures of ETC1S blocks, each a
// reference to one of the file's endpoints and one of its selectors.
namespace tessera::ktx2 {

// A block's base colour, 5 bits a channel, and its row of kEtc1Modifiers.
struct Etc1sEndpoint {
  std::uint8_t red, green, blue, table;
};

// Four rows of four texels, 2 bits each, the left one in the low bits: 0 darkest to 3 lightest.
struct Etc1sSelector {
  std::array<std::uint8_t, 4> rows;

  unsigned at(unsigned x, unsigned y) const { return (rows[y] >> (2 * x)) & 3u; }
};

struct Etc1sBlock {
  std::uint16_t endpoint, selector;
};

// The data that all slices of a file share.
//
// Invariants (cited by the tests):
//   BL1  Every block that read_etc1s_slice() gives names an endpoint and a selector that exist.
struct Etc1sCodebooks {
  std::vector<Etc1sEndpoint> endpoints;
  std::vector<Etc1sSelector> selectors;
  HuffmanCode predictions, endpoint_deltas, selector_symbols, selector_runs;
  std::uint32_t history_size = 0;  // number of last used selectors that are remembered; up to 8191
};

// Reads the three sections of the global data. The counts are numbers of entries, 1 to 65535. Returns false with
// `fault` set where a section is malformed or ends early.
[[nodiscard]] bool read_etc1s_codebooks(std::uint32_t endpoint_count, std::span<const std::uint8_t> endpoint_section,
                                        std::uint32_t selector_count, std::span<const std::uint8_t> selector_section,
                                        std::span<const std::uint8_t> table_section, Etc1sCodebooks& books,
                                        std::string& fault);

// Reads one slice of columns x rows blocks, row by row. `blocks` has columns * rows entries. Returns false with `fault`
// set.
[[nodiscard]] bool read_etc1s_slice(const Etc1sCodebooks& books, std::span<const std::uint8_t> slice,
                                    std::uint32_t columns, std::uint32_t rows, std::span<Etc1sBlock> blocks,
                                    std::string& fault);

// Colours of an endpoint's four selectors, RGB, darkest first.
std::array<std::array<std::uint8_t, 3>, 4> etc1s_colors(const Etc1sEndpoint& endpoint);

}  // namespace tessera::ktx2

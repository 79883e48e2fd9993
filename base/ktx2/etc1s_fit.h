#pragma once

#include <span>
#include <vector>

#include "base/ktx2/etc1s.h"
#include "base/ktx2/texel_block.h"

// Codebooks of endpoints and selectors for the blocks of a texture, and the blocks that refer to them.
namespace tessera::ktx2 {

// [assumed] as many as the reference encoder's middle quality makes of a large image
inline constexpr std::size_t kMaxEndpoints = 4096, kMaxSelectors = 4096;

struct Etc1sFit {
  std::vector<Etc1sEndpoint> endpoints;  // by lightness
  std::vector<Etc1sSelector> selectors;
  std::vector<Etc1sBlock> blocks;  // as they came
};

// Each block by itself gets an endpoint: for each table the base goes from the mean of the texels to the mean of what
// the table's steps leave of them; the least squared error wins. Then endpoints, and with those the selectors, are
// clustered by median cut until there are no more than kMaxEndpoints and kMaxSelectors.
//
// Invariants (cited by the tests):
//   EF1  Of grey blocks by themselves the squared error is, in sum, at most a quarter more than that of the best grey
//        endpoints.
//   EF2  Every block names an endpoint and a selector that exist. The same texels give the same fit.
Etc1sFit fit_etc1s(std::span<const TexelBlock> blocks);

}  // namespace tessera::ktx2

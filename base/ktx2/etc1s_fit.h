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

// Each block by itself gets the endpoint of least squared error that descends finds; then endpoints, and with those the
// selectors, are clustered by median cut until there are no more than kMaxEndpoints and kMaxSelectors.
//
// Invariants (cited by the tests):
//   EF1  Blocks of one colour that an endpoint has exactly come back exactly, as long as nothing is clustered.
//   EF2  Every block names an endpoint and a selector that exist. The same texels give the same fit.
Etc1sFit fit_etc1s(std::span<const TexelBlock> blocks);

}  // namespace tessera::ktx2

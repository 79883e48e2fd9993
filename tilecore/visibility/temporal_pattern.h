#pragma once

#include <cstdint>
#include <vector>

namespace tessera::tilecore {

// Ranks 0 .. n*n-1 of the cells of an n x n torus, in an order that keeps every prefix evenly spread (void and cluster,
// Ulichney 1993): neighbouring pixels get times far apart, and any run of ranks is blue noise. Row by row.
std::vector<std::uint16_t> void_and_cluster_ranks(int n);

}  // namespace tessera::tilecore

#pragma once

#include <filesystem>

namespace tessera::bench {

// What a viewer sees flicker that full shading does not: per pair of frames in a row, FLIP (Andersson et al. 2020) between
// the change from one to the next and the change that full shading shows, 1/2 + (b - a)/2 of displayed values, as mean over
// pixels and pairs. Comparing changes is the temporal loss of Chaitanya et al. 2017 ("Interactive reconstruction of Monte
// Carlo image sequences using a recurrent denoising autoencoder", section 4): its L1 is measured beside.
// Adaptive desampling by thresholds and splits beside checkerboard; shimmer.csv, and the ratio at checkerboard's savings.
void shimmer(const std::filesystem::path& folder);

// Rates, splits and sizes of blocks, one at a time, against full shading; splits.csv.
void splits(const std::filesystem::path& folder);

// Half pixels at edges, against what supersampling stands for: an invocation for every sample; supersampling.csv.
void supersampling(const std::filesystem::path& folder);

}  // namespace tessera::bench

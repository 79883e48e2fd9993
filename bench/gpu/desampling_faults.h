#pragma once

#include <filesystem>

namespace tessera::bench {

// Scenes that desampling once got wrong (tests/replay/resolve_faults_test.cpp), as crops of 64x48 pixels enlarged four times,
// side by side: fault_*.png. Where a setting gives the former behaviour: before, after, fully shaded; elsewhere: after, fully
// shaded, their difference 16 times. The crop is where the first of them is worst; where nothing differs, where most is to be seen.
void desampling_faults(const std::filesystem::path& folder);

}  // namespace tessera::bench

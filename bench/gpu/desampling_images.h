#pragma once

#include <filesystem>

namespace tessera::bench {

// Images of what desampling does to frames of stroll and serpent, with eight frames before them as history: rates and
// edges; for one of them where pixels come from, before, after and their difference.
void desampling_images(const std::filesystem::path& folder);

}  // namespace tessera::bench

#pragma once

#include <filesystem>

namespace tessera::bench {

// Pictures of what desampling does to a frame of stroll and one of serpent, with the frames before them as history: rates and edges, where
// pixels come from, before, after, difference; and for stroll how the rates follow the camera.
void desampling_pictures(const std::filesystem::path& folder);

}  // namespace tessera::bench

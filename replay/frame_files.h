#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tilecore/tile_core.h"

namespace tessera::replay {

// Auxiliary layers that a replay can add to its EXR files.
const std::vector<std::string>& auxiliary_layers();

// "frame_0007"
std::string frame_name(int frame);

// Those of them that only a frame with desampling has.
bool is_resolve_layer(const std::string& layer);

// Writes frame_NNNN.exr (linear, half float; auxiliary layers as channels of their own) and frame_NNNN.png (exposed,
// tone mapped, sRGB) into `folder`, each whole or not at all. `view` "right": frame_NNNN.right.exr and .png.
void write_frame(const std::filesystem::path& folder, int frame, const tilecore::FrameTargets& targets,
                 const std::vector<std::string>& auxiliary, float exposure, const std::string& view = "");

}  // namespace tessera::replay

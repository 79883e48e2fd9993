#pragma once

#include <cstdint>

#include "gpu/device.h"

namespace tessera::gpu {

// Host memory that the images of a request may take: colour, its encoded copies, auxiliary layers, two histories, the frame
// before where tiles are eliminated; once more for a right eye. And what is behind surfaces that transmit, if any may.
std::uint64_t image_bytes(const RenderRequest& request, const RunSettings& settings, const GpuConfiguration& gpu,
                          const scene::Capture& capture);

}  // namespace tessera::gpu

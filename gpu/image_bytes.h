#pragma once

#include <cstdint>

#include "gpu/device.h"

namespace tessera::gpu {

// Host memory that the images of a request may take: colour, its encoded copies, auxiliary layers, two histories, and
// the previous frame if tiles are eliminated; twice for a stereo pair; and the scene-color image if a surface may
// transmit.
std::uint64_t image_bytes(const RenderRequest& request, const RunSettings& settings, const GpuConfiguration& gpu,
                          const scene::Capture& capture);

}  // namespace tessera::gpu

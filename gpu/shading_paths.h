#pragma once

#include "gpu/configuration.h"
#include "gpu/settings.h"

namespace tessera::gpu {

// Throws UsageError where the machine does not shade along settings.shading.path; the message names what does not go together.
// `transmits`: what is behind surfaces of the capture is rendered first.
void check_shading_path(const GpuConfiguration& gpu, const RunSettings& settings, bool transmits);

}  // namespace tessera::gpu

#pragma once

#include "gpu/configuration.h"
#include "gpu/settings.h"

namespace tessera::gpu {

// Throws UsageError if the machine does not shade along settings.shading.path; the message names the settings that exclude each
// other. `transmits`: the capture has surfaces that transmit, and the scene behind them is rendered first.
void check_shading_path(const GpuConfiguration& gpu, const RunSettings& settings, bool transmits);

}  // namespace tessera::gpu

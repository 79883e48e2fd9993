#pragma once

#include "gpu/configuration.h"
#include "gpu/settings.h"
#include "scene/capture.h"

namespace tessera::gpu {

// Returns the settings with the shading path, and the packed G-buffer's bits, that the passes of a capture name: a pass with the
// shader `depth` is a prepass; colours that a subpass with the shader `gbuffer` writes are a G-buffer, lit by a subpass
// `light` of the same pass on chip, or of a later pass. A capture that names none leaves the settings as they are. Throws
// UsageError if the settings ask for another path than `visibility` and that one.
RunSettings follow_passes(const scene::Capture& capture, RunSettings settings);

// Throws UsageError if the machine does not shade along settings.shading.path; the message names the settings that exclude each
// other, or a width of the G-buffer that is no multiple of 32 bits. `transmits`: the capture has surfaces that transmit, and the scene behind them is rendered first.
void check_shading_path(const GpuConfiguration& gpu, const RunSettings& settings, bool transmits);

}  // namespace tessera::gpu

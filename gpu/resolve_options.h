#pragma once

#include "gpu/settings.h"
#include "tilecore/resolve/resolve_settings.h"

namespace tessera::gpu {

// What the settings ask of the resolve unit, for frames of width x height pixels.
// Throws UsageError when thresholds or radii are out of order.
tilecore::ResolveSettings resolve_settings(const RunSettings& settings, int width, int height);

}  // namespace tessera::gpu

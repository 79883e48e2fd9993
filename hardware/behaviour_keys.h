#pragma once

#include <vector>

#include "hardware/configuration.h"

namespace tessera::hardware {

// Rows of gpu_keys() for what the machine does; how fast and at what cost is in machine_keys().
Keys<GpuConfiguration> behaviour_keys();

}  // namespace tessera::hardware

#pragma once

#include <vector>

#include "hardware/configuration.h"

namespace tessera::hardware {

// Rows of gpu_keys() for the members of MachineNumbers.
Keys<GpuConfiguration> machine_keys();

}  // namespace tessera::hardware

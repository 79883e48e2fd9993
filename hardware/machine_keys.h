#pragma once

#include <vector>

#include "hardware/configuration.h"

namespace tessera::hardware {

// Rows of gpu_keys() for the members of MachineNumbers.
std::vector<Key<GpuConfiguration>> machine_keys();

}  // namespace tessera::hardware

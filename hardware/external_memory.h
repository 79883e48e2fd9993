#pragma once

#include "hardware/machine.h"
#include "memory/dram_spec.h"

namespace tessera::hardware {

// The memory of memory.model=banks: memory.channels channels of memory.type. They move a burst at a time; a line of the caches
// lies in one channel.
memory::DramSpec external_memory(const Machine& gpu);

}  // namespace tessera::hardware

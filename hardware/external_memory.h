#pragma once

#include "hardware/machine.h"
#include "memory/dram_spec.h"

namespace tessera::hardware {

// The memory of memory.model=banks: memory.channels channels of memory.type. Each request moves one burst; a cache
// line lies in one channel.
memory::DramSpec external_memory(const Machine& gpu);

}  // namespace tessera::hardware

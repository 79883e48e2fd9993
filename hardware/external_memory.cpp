#include "hardware/external_memory.h"

namespace tessera::hardware {

memory::DramSpec external_memory(const Machine& gpu) {
  memory::DramSpec spec = memory::dram_spec(word(gpu.memory.type));
  spec.channels = static_cast<std::uint32_t>(gpu.memory.channels);
  spec.transaction_bytes = spec.burst_bytes();
  spec.interleave_bytes = static_cast<std::uint32_t>(gpu.line_bytes());
  return spec;
}

}  // namespace tessera::hardware

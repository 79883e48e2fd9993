#include "memory/dram_trace.h"

#include <cmath>
#include <iterator>

#include <fmt/format.h>

namespace tessera::memory {

DramTrace::DramTrace(const std::filesystem::path& file) : file_(file), ramulator_(file.extension() == ".ramulator") {}

void DramTrace::add(std::span<const Burst> bursts, double frame_cycles) {
  fmt::memory_buffer text;
  for (const Burst& burst : bursts) {
    if (ramulator_)
      fmt::format_to(std::back_inserter(text), "{} 0x{:x}\n", burst.write ? "ST" : "LD", burst.address);
    else
      fmt::format_to(std::back_inserter(text), "0x{:x} {} {}\n", burst.address, burst.write ? "WRITE" : "READ",
                     start_ + burst.cycle);
  }
  file_.write({text.data(), text.size()});
  start_ += static_cast<std::uint64_t>(std::ceil(frame_cycles));
}

void DramTrace::commit() { file_.commit(); }

}  // namespace tessera::memory

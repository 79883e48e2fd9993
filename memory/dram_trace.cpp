#include "memory/dram_trace.h"

#include <cmath>
#include <iterator>

#include <fmt/format.h>

#include "base/error.h"

namespace tessera::memory {

DramTrace::DramTrace(const std::filesystem::path& file)
    : file_(file), stream_(file_.temporary(), std::ios::binary), ramulator_(file.extension() == ".ramulator") {
  if (!stream_) throw SystemError(fmt::format("cannot write {}", file.string()));
}

void DramTrace::add(std::span<const Burst> bursts, double frame_cycles) {
  fmt::memory_buffer text;
  for (const Burst& burst : bursts) {
    if (ramulator_)
      fmt::format_to(std::back_inserter(text), "{} 0x{:x}\n", burst.write ? "ST" : "LD", burst.address);
    else
      fmt::format_to(std::back_inserter(text), "0x{:x} {} {}\n", burst.address, burst.write ? "WRITE" : "READ",
                     start_ + burst.cycle);
  }
  stream_.write(text.data(), static_cast<std::streamsize>(text.size()));
  start_ += static_cast<std::uint64_t>(std::ceil(frame_cycles));
}

void DramTrace::commit() {
  stream_.close();
  if (!stream_) throw SystemError("cannot write the DRAM trace: the disk may be full");
  file_.commit();
}

}  // namespace tessera::memory

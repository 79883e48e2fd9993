#pragma once

#include <cstdint>
#include <filesystem>
#include <span>

#include "base/output_file.h"

namespace tessera::memory {

// One burst over the external memory interface.
struct Burst {
  std::uint64_t cycle = 0, address = 0;
  bool write = false;
};

// `--dram-trace`: bursts as text, a line each. Form of DRAMsim3: "0xADDRESS READ|WRITE CYCLE"; where the file's name
// ends in .ramulator that of Ramulator 2's LoadStoreTrace: "LD|ST 0xADDRESS". Cycles are those of the GPU's clock;
// frames follow each other without a gap. Throws WriteError.
class DramTrace {
 public:
  explicit DramTrace(const std::filesystem::path& file);

  // The bursts of a frame, in the order of their cycles, and the cycles that it takes.
  void add(std::span<const Burst> bursts, double frame_cycles);
  void commit();

 private:
  OutputFile file_;
  std::uint64_t start_ = 0;
  bool ramulator_;
};

}  // namespace tessera::memory

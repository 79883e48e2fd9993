#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <vector>

#include "base/atomic_file.h"
#include "hardware/address_map.h"
#include "replay/frame_renderer.h"

namespace tessera::replay {

// One burst over the external memory interface.
struct Burst {
  std::uint64_t cycle = 0, address = 0;
  bool write = false;
};

// Bursts of a frame in the order of their cycles, which count from the start of the frame: those of each phase spread
// evenly over the time that the timing model gives it, what the tile cores do at the same time interleaved.
//
// Invariants (cited by the tests):
//   DT1  As many bursts as the frame's ledger has bytes over burst_bytes, reads and writes apart.
//   DT2  Cycles never fall.
std::vector<Burst> frame_bursts(const MachineModel& model, const hardware::AddressMap& map, std::uint64_t burst_bytes);

// Where a frame's buffers lie.
hardware::AddressMap address_map(const FrameRenderer& renderer, const hardware::GpuConfiguration& gpu,
                                 const RunSettings& settings, const RenderRequest& request);

// `--dram-trace`: bursts as text, a line each. Form of DRAMsim3: "0xADDRESS READ|WRITE CYCLE"; where the file's name
// ends in .ramulator that of Ramulator 2's LoadStoreTrace: "LD|ST 0xADDRESS". Cycles are those of the GPU's clock;
// frames follow each other without a gap. The file appears whole, at commit(). Throws SystemError.
class DramTrace {
 public:
  DramTrace(const std::filesystem::path& file, const hardware::AddressMap& map, std::uint64_t burst_bytes);

  void add(const MachineModel& model);
  void commit();

 private:
  AtomicFile file_;
  std::ofstream stream_;
  hardware::AddressMap map_;
  std::uint64_t burst_bytes_, start_ = 0;
  bool ramulator_;
};

}  // namespace tessera::replay

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "base/output_file.h"
#include "gpu/device.h"

namespace tessera::gpu {

// `--trace`: the schedule of the timing model as a Chrome / Perfetto JSON trace, one event a line.
//
// Tracks: front end, binner, DRAM, one for each tile core; counters for DRAM bandwidth (GB/s) and live queue memory
// (bytes). A core works on more than one tile at a time. Its track shows the oldest of them: "tile" from when the tile
// before was stored until this one is, and in it the stage that it waits for: fetch, tessellate, BVH, sample, shade,
// resolve, store each last from the end of the stage before to the end of the tile's last item in that stage. What was
// done while the tile before was still the oldest is not shown; "begun" in the arguments says when the tile was taken.
//
// Time: model cycles scaled to microseconds by clock.mhz, rounded down to 1/1024 (exact in binary, so that sums of a
// begin and a duration are, too). Frames follow each other without a gap.
//
// Invariants (cited by the tests):
//   TL1  Slices of a track are disjoint or one holds the other.
//   TL2  The file is JSON, whatever the frames.
class Timeline {
 public:
  struct Limits {
    std::uint32_t first_tile = 0,
                  last_tile = ~std::uint32_t{0};  // numbers of the tiles that get slices; last is not shown
  };
  Timeline(const std::filesystem::path& file, const GpuConfiguration& gpu, Limits limits);

  void add(int frame, const MachineModel& model);
  // Finishes the file. Throws WriteError, as add() does.
  void commit();

 private:
  void add_geometry(int frame, const MachineModel& model);
  void add_cores(int frame, const MachineModel& model);
  void add_tile(const MachineModel& model, const timing::TileSchedule& tile, double from);
  void add_memory(int frame, const MachineModel& model);
  void add_queues(const MachineModel& model);

  void track(int number, const std::string& name);
  void slice(int track, const std::string& name, double begin, double end, const std::string& arguments = "");
  void counter(const std::string& name, const std::string& unit, double at, double value);
  void event(const std::string& text);
  double microseconds(double cycle) const;

  OutputFile file_;
  GpuConfiguration gpu_;
  Limits limits_;
  double start_ = 0;  // cycle at which the frame in hand begins
  bool first_ = true;
};

}  // namespace tessera::gpu

#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "gpu/device.h"
#include "gpu/frame_timeline.h"
#include "gpu/render_stages.h"
#include "gpu/trace_file.h"

namespace tessera::gpu {

// `--trace`: the schedule of the timing model for Perfetto (gpu/trace_file.h has the forms).
//
// Tracks: front end, binner, DRAM, the queues of render stages, and one for each tile that each core can hold. A queue has
// a slice for each pass that has the stage (gpu/render_stages.h): Binning on the vertex queue, LoadColor, LoadDepth,
// Render, StoreColor and StoreDepth on rows of the fragment queue. Passes that overlap have rows of their own. A tile
// is a slice of its slot from the time its core took it until it is stored; slices inside it show its activities
// (Activity). Its arguments give its place, its content and the causes of its waits. Counters: DRAM bandwidth (GB/s),
// live list memory (bytes), working tiles and waiting tiles by cause, and the load of each unit (%).
//
// Time: model cycles scaled to microseconds by clock.mhz, rounded down to 1/1024 (exact in binary, so that sums of a
// begin and a duration are, too). Frames follow each other without a gap.
//
// Invariants (cited by the tests):
//   TL1  Slices of a track are disjoint or one holds the other.
//   TL2  The file is JSON, whatever the frames; both forms hold the same slices and counters.
class Timeline {
 public:
  struct Limits {
    std::uint32_t first_tile = 0,
                  last_tile = ~std::uint32_t{0};  // numbers of the tiles that get slices; last is not shown
  };
  // `depth_pass`: as render_stages() takes it.
  Timeline(const std::filesystem::path& file, const GpuConfiguration& gpu, Limits limits, std::string depth_pass = "");

  // Adds a frame that has a machine model.
  void add(const FrameResult& result);
  // Finishes the file. Throws WriteError, as add() does.
  void commit() { file_->commit(); }

 private:
  void add_geometry(const MachineModel& model, const FrameTimeline& frame);
  void add_stages(const FrameResult& result, const FrameTimeline& frame);
  void add_tile(const MachineModel& model, const TileTrack& tile, int columns);
  void add_memory(const FrameTimeline& frame);
  void add_waits(const FrameTimeline& frame);
  void add_units(const FrameTimeline& frame);

  void slice(int track, std::string_view name, double begin, double end,
             std::span<const TraceFile::Argument> arguments = {});
  void counter(std::string_view name, std::string_view unit, double at, double value);
  void track(int number, const std::string& name);
  double microseconds(double cycle) const;

  std::unique_ptr<TraceFile> file_;
  GpuConfiguration gpu_;
  Limits limits_;
  std::string depth_pass_;
  double start_ = 0;                                   // cycle at which the current frame begins
  std::vector<std::uint32_t> slots_;                   // by core: slots that have a track
  std::array<std::size_t, kRenderStageCount> rows_{};  // by stage: rows that have a track
};

}  // namespace tessera::gpu

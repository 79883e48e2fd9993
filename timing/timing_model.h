#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "timing/bound.h"
#include "timing/events/simulation_counts.h"
#include "timing/work.h"

namespace tessera::timing {

// When a tile was in which phase; cycles from the start of the frame.
struct TileSchedule {
  struct Span {
    double begin = 0;  // its unit took the tile
    double flow = 0;   // the first data were there
    double end = 0;
  };
  std::uint32_t round = 0, index = 0;  // FrameWork::rounds[round].tiles[index]
  std::uint32_t core = 0;
  std::array<Span, kPhaseCount> phases;
  PathTime path;  // what its cycles went to, where simulate_events() recorded it: else nothing
};

// The whole frame as the discrete-event simulation ran it.
struct Schedule {
  struct Span {
    double begin = 0, end = 0;
  };
  std::vector<Span> geometry;       // per round; with machine.overlap=frames the first is the next frame's
  std::vector<TileSchedule> tiles;  // round by round, in the order of the tile scheduler
  Span other;                       // what the rounds do not hold
  double cycles = 0;
};

// Simulates one frame (docs/timing_model.md has the equations). Rounds follow each other, or wait for what they need only
// (RoundQueues): the front end and the binner
// run as a pipeline, then the tile scheduler gives tiles, in their order, to the cores: to the one with the fewest
// tiles in work, the first of equals. A core works on as many tiles at once as its memory holds, each in a phase of its
// own. With machine.overlap=frames the front end and the binner work on the next frame, taken to be like this one, while
// the last round's tiles are rendered. Within a phase units are pipelined; phases that move data share the memory, and none gets more of it than it can
// use (max-min fairness).
//
// Sequential and in a fixed order: the same bits on every host.
//
// Invariants (cited by the tests):
//   TM1  A phase takes at least the cycles of each of its units, and a core has one tile in a phase at a time: no unit
//        is busy for longer than the frame.
//   TM2  Together the phases never move more than memory_rate() bytes a clock.
//   TM3  Every tile passes every phase once, in order, on one core.
Schedule schedule_frame(const hardware::Machine& gpu, const FrameWork& work);

// Cycles from the start of a phase's flow to the moment at which each of its units has done its last item, for a memory
// that never keeps them waiting: n equal items in a pipeline. The last element is the length of the phase.
std::vector<double> pipeline_ends(std::span<const double> cycles, std::uint64_t items);

// The memory of a core, which holds what the samples of its tiles see: as many tiles are in work as fit, 1 to 8.
class TileMemory {
 public:
  TileMemory(const hardware::Machine& gpu, const FrameWork& work)
      : bytes_(static_cast<std::uint64_t>(gpu.cores.memory_bytes)), state_bytes_(work.tile_state_bytes) {}

  std::uint64_t tiles() const { return tiles_; }
  bool has_room(const TileWork& tile) const {
    return tiles_ == 0 || (state_bytes_ > 0 && tiles_ < kMaxTiles && used_ + bytes_of(tile) <= bytes_);
  }
  void take(const TileWork& tile) { ++tiles_, used_ += bytes_of(tile); }
  void free(const TileWork& tile) { --tiles_, used_ -= bytes_of(tile); }

 private:
  static constexpr std::uint64_t kMaxTiles = 8;
  std::uint64_t bytes_of(const TileWork& tile) const { return state_bytes_ + tile.extra_bytes; }

  std::uint64_t bytes_, state_bytes_, used_ = 0, tiles_ = 0;
};

// Units of each phase, in order; and of the geometry.
std::span<const Stage> phase_stages(Phase phase);
std::span<const Stage> geometry_stages();

// A phase of a tile as a pipeline: cycles of phase_stages(phase), then for the store phase those of the memory, which
// takes a block of pixels as soon as it is resolved; and how many items pass.
struct PhaseCycles {
  std::vector<double> cycles;
  std::uint64_t items = 1;
};
PhaseCycles phase_cycles(const hardware::Machine& gpu, const TileWork& work, Phase phase);

// From the first geometry of a pass to its last pixel.
struct PassTime {
  std::string name;
  double begin = 0, end = 0;
};

struct FrameTiming {
  double cycles = 0;              // from the frame before to this one
  double latency = 0;             // from the frame's first patch to its last pixel; a sum over frames
  StageCycles busy{};             // per instance: the mean over the cores for what each core has
  double cores_busy = 0;          // mean over the cores of the cycles in which a tile was in work
  double tiles_busy = 0;          // the same, each tile by itself: over cores_busy, the tiles in flight of a core
  double memory_waits = 0;        // waits_for_tile_memory()
  std::optional<Bound> bound_by;  // what the frame hangs on most (timing/bound.h); none where nothing was done
  double bound_cycles = 0;        // what twice as much of it saves
  double coarse_cycles = 0;       // of TimingModel::kEvents: what TimingModel::kPhases says of the same work
  std::vector<PassTime> passes;   // of a single frame, as FrameWork::passes; of the left eye

  double utilisation(Stage stage) const { return cycles > 0 ? busy[static_cast<std::size_t>(stage)] / cycles : 0; }
  void bind(const BoundGain& gain);
  // Joins a further frame; bound_by becomes what bounds the frames with most cycles to save.
  void accumulate(const FrameTiming& frame);

  std::array<double, kBoundCount> bound_total{};  // bound_cycles by what bounds, over frames
  std::optional<SimulationCounts> events;         // of TimingModel::kEvents
};
FrameTiming time_frame(const hardware::Machine& gpu, const FrameWork& work, const Schedule& schedule);

// Fills in cores_busy, tiles_busy, memory_waits and passes.
void count_tiles(const hardware::Machine& gpu, const FrameWork& work, const Schedule& schedule, FrameTiming& timing);
// Mean over the cores of the cycles in which a tile was in work.
double cores_busy(const hardware::Machine& gpu, const Schedule& schedule);
inline bool overlaps(const hardware::Machine& gpu) { return gpu.queues.overlap == hardware::FrameOverlap::kFrames; }
// With machine.overlap=frames a frame waits for the one before after it is binned.
double latency(const hardware::Machine& gpu, const Schedule& schedule);
// Cycles in which tiles are in work; what they would be fewer if all cores ended together; and those in which a core
// could have tested a tile if its memory had had room for it, of the core with most.
double tile_time(const Schedule& schedule);
double imbalance(const hardware::Machine& gpu, const Schedule& schedule);
double waits_for_tile_memory(const hardware::Machine& gpu, const Schedule& schedule);

}  // namespace tessera::timing

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

// Times at which a tile was in each phase, in cycles from the start of the frame.
struct TileSchedule {
  struct Span {
    double begin = 0;  // the phase's unit took the tile
    double flow = 0;   // the first data arrived
    double end = 0;
  };
  std::uint32_t round = 0, index = 0;  // FrameWork::rounds[round].tiles[index]
  std::uint32_t core = 0;
  std::array<Span, kPhaseCount> phases;
  PathTime path;  // parts of its cycles, if simulate_events() recorded them
};

// The schedule of a whole frame.
struct Schedule {
  struct Span {
    double begin = 0, end = 0;
  };
  std::vector<Span> geometry;       // per round; with machine.overlap=frames the first is the next frame's
  std::vector<TileSchedule> tiles;  // round by round, in the order of the tile scheduler
  Span other;                       // traffic that belongs to no round
  double cycles = 0;
};

// Simulates one frame (docs/timing_model.md has the equations). Rounds follow each other, or wait only for the rounds
// that they need (RoundQueues). In a round the front end and the binner run as a pipeline; then the tile scheduler
// gives tiles, in their order, to the core with the fewest tiles in progress, the first of equals. A core works on as
// many tiles at once as its memory holds, each in a phase of its own. With machine.overlap=frames the front end and the
// binner work on the next frame, assumed to equal this one, while the last round's tiles are rendered. Within a phase
// units are pipelined. Phases that move data share the memory by max-min fairness: none gets more than it can use.
//
// The simulation is sequential and in a fixed order: the same bits on every host.
//
// Invariants (cited by the tests):
//   TM1  A phase takes at least the cycles of each of its units, and a core has one tile in a phase at a time: no unit
//        is busy for longer than the frame.
//   TM2  Together the phases never move more than memory_rate() bytes a clock.
//   TM3  Every tile passes every phase once, in order, on one core.
Schedule schedule_frame(const hardware::Machine& gpu, const FrameWork& work);

// For each unit, the cycles from the start of a phase's flow until it has done its last item, with n equal items in a
// pipeline and a memory that never delays them. The last element is the length of the phase.
std::vector<double> pipeline_ends(std::span<const double> cycles, std::uint64_t items);

// A core's memory for the samples of its tiles: the core works on as many tiles as fit, 1 to 8.
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

// Units of each phase, and of the geometry, in order.
std::span<const Stage> phase_stages(Phase phase);
std::span<const Stage> geometry_stages();

// A phase of a tile as a pipeline: cycles of phase_stages(phase), in the store phase followed by the memory's, which
// takes a block of pixels as soon as it is resolved; and the number of items.
struct PhaseCycles {
  std::vector<double> cycles;
  std::uint64_t items = 1;
};
PhaseCycles phase_cycles(const hardware::Machine& gpu, const TileWork& work, Phase phase);

// Time from the first geometry of a pass to its last pixel.
struct PassTime {
  std::string name;
  double begin = 0, end = 0;
};

struct FrameTiming {
  double cycles = 0;        // from the end of the frame before to the end of this one
  double latency = 0;       // from the frame's first patch to its last pixel; a sum over frames
  StageCycles busy{};       // per instance: the mean over the cores for a unit that each core has
  double cores_busy = 0;    // cycles with a tile in progress, mean over the cores
  double tiles_busy = 0;    // the same, summed over tiles; divided by cores_busy, the mean number of tiles in a core
  double memory_waits = 0;  // waits_for_tile_memory()
  std::optional<Bound> bound_by;  // the frame's limit (timing/bound.h); none if the frame has no work
  double bound_cycles = 0;        // cycles that doubling it saves
  double coarse_cycles = 0;       // with TimingModel::kEvents: cycles of TimingModel::kPhases for the same work
  std::vector<PassTime> passes;   // for a single frame: the left eye's passes, as in FrameWork::passes

  double utilisation(Stage stage) const { return cycles > 0 ? busy[static_cast<std::size_t>(stage)] / cycles : 0; }
  void bind(const BoundGain& gain);
  // Adds a frame; bound_by becomes the bound whose frames have most cycles to save.
  void accumulate(const FrameTiming& frame);

  std::array<double, kBoundCount> bound_total{};  // sum of bound_cycles over frames, by bound
  std::optional<SimulationCounts> events;         // with TimingModel::kEvents
};
FrameTiming time_frame(const hardware::Machine& gpu, const FrameWork& work, const Schedule& schedule);

// Fills in cores_busy, tiles_busy, memory_waits and passes.
void count_tiles(const hardware::Machine& gpu, const FrameWork& work, const Schedule& schedule, FrameTiming& timing);
// Cycles in which a core has a tile in progress, mean over the cores.
double cores_busy(const hardware::Machine& gpu, const Schedule& schedule);
inline bool overlaps(const hardware::Machine& gpu) { return gpu.queues.overlap == hardware::FrameOverlap::kFrames; }
// Cycles from the frame's first patch to its last pixel. With machine.overlap=frames a binned frame waits for the one before.
double latency(const hardware::Machine& gpu, const Schedule& schedule);
// tile_time(): cycles in which tiles are in progress. imbalance(): cycles that would be saved if all cores ended together.
// waits_for_tile_memory(): cycles in which a core could have tested a tile if its memory had had room, of the core with most.
double tile_time(const Schedule& schedule);
double imbalance(const hardware::Machine& gpu, const Schedule& schedule);
double waits_for_tile_memory(const hardware::Machine& gpu, const Schedule& schedule);

}  // namespace tessera::timing

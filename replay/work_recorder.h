#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "binner/binner.h"
#include "frontend/front_end.h"
#include "hardware/ledger.h"
#include "hardware/line_cache.h"
#include "hardware/work.h"
#include "replay/displacement_memory.h"
#include "tilecore/tile_core.h"

namespace tessera::replay {

// Lines that the texture caches of all cores and the tessellators asked of the shared L2.
struct L2Counters {
  std::uint64_t requests = 0;
  std::uint64_t misses = 0;
};

// What was recorded of a frame beside its counters: the work that the timing and the energy model read and, for traces,
// every transfer.
struct FrameRecord {
  hardware::FrameWork work;
  hardware::Traffic other;  // work.other_bytes
  // Only when transfers are recorded; as work.rounds. `tiles` and the phases of a tile as there.
  struct RoundAccesses {
    std::vector<hardware::Access> geometry;
    std::vector<std::vector<hardware::Access>> tiles;
  };
  std::vector<RoundAccesses> accesses;
};

// Takes the counters of tile cores tile by tile, simulates what tiles share (the L2) in emulated order, and puts
// together the FrameRecord of a frame. One for each run of the machine.
//
// Call order: front_end(); then for each run of the binner: begin_round(), begin_tile() .. end_tile() for its tiles on
// any thread, share() tile by tile, end_round(). finish() last.
class WorkRecorder {
 public:
  // `heights`: null where textures are not modelled.
  WorkRecorder(const hardware::GpuConfiguration& gpu, const DisplacementMemory* heights, bool record_accesses);

  // Events since the last call; before the binner runs on them.
  void front_end(const frontend::FrameGeometry& frame, const frontend::FrontEndResult& result);

  // The sampling controller's sparse pass; before the first round.
  void sparse_pass(const tilecore::ParameterMaps& maps);

  // After the binner's run. The queues of the round are complete.
  void begin_round(const binner::Binner& binner);
  // Where the binner's transfers go while it runs; null when they are not recorded.
  hardware::AccessLog* binner_log() { return record_accesses_ ? &geometry_log_ : nullptr; }

  // The log of a tile, for what is charged on its behalf; null when transfers are not recorded.
  hardware::AccessLog* begin_tile(std::size_t tile, tilecore::TileCore& core);
  // Between the tile's last entries and its shading.
  void begin_shading(std::size_t tile, tilecore::TileCore& core);
  // `finished`: its pixels are written, it is not stored for a further round. What the core counted for the tile.
  tilecore::CoreCounters end_tile(std::size_t tile, const tilecore::TileJob& job, tilecore::TileCore& core,
                                  bool finished);

  // A tile's use of what is shared, in emulated order: takes its requests to the tessellation cache, then its lines to
  // the L2.
  void share(std::size_t tile, std::span<const tilecore::TessellationRequest> requests,
             tilecore::TessellationCache& cache);
  void end_round();

  // What end_tile() took from the cores, and the L2's account. Before finish().
  struct Sums {
    tilecore::CoreCounters core;
    L2Counters l2;
    hardware::Ledger ledger;
  };
  Sums take_sums();

  // `ledger`: of the whole frame; what no round holds of it becomes other_bytes.
  FrameRecord finish(const tilecore::TileJob& job, const hardware::Ledger& ledger);

 private:
  struct Slot {
    bool used = false;
    hardware::TileWork work;
    std::vector<std::uint32_t> lines;     // that the core's texture cache missed
    std::size_t shading_lines = 0;        // position of the first that shading asked for
    std::uint64_t visibility_texels = 0;  // before shading
    hardware::AccessLog log;
  };
  void share_lines(Slot& slot);
  void share_line(Slot& slot, std::uint32_t line, hardware::Phase phase);
  // Adds what a ledger moved since `seen` to rounds_; bytes of it.
  std::uint64_t since(const hardware::Ledger& ledger, hardware::Traffic& seen);

  const hardware::GpuConfiguration& gpu_;
  const DisplacementMemory* heights_;
  const frontend::FrameGeometry* frame_ = nullptr;
  std::vector<std::uint32_t> height_lines_;
  bool record_accesses_;
  std::uint64_t line_bytes_;
  hardware::LineCache l2_;
  L2Counters l2_counters_;
  hardware::Ledger l2_ledger_;
  PerThread<Sums> sums_;
  std::vector<Slot> slots_;  // by tile
  hardware::AccessLog geometry_log_;
  std::vector<std::uint64_t> patch_offsets_;  // of the records in their memory, when transfers are recorded
  frontend::FrontendCounters front_end_;
  binner::BinnerCounters binner_;
  hardware::Traffic front_end_traffic_, binner_traffic_;  // seen so far
  hardware::Traffic rounds_;                              // of all that went to a round
  std::uint64_t geometry_bytes_ = 0;                      // of the front end, for the round to come
  hardware::GeometryWork geometry_;
  FrameRecord record_;
};

}  // namespace tessera::replay

namespace tessera::hardware {

template <>
inline constexpr bool kAbsentWhenIdle<replay::L2Counters> = true;

template <>
inline constexpr auto kCounterFields<replay::L2Counters> = std::to_array<CounterField<replay::L2Counters>>({
    {"l2.requests", &replay::L2Counters::requests, Combine::kSum, "lines",
     "Lines that texture caches and, for displacement maps, tessellators asked of the L2.",
     "MaliL2CacheRdLookup; V3D L2T-total-cache-hit and -miss together"},
    {"l2.misses", &replay::L2Counters::misses, Combine::kSum, "lines", "Of these, fetched from memory.",
     "MaliL2CacheRdMissRate (times look-ups); Adreno % Texture L2 miss; V3D L2T-total-cache-miss"},
});
TESSERA_COUNTERS_COVER(replay::L2Counters);

}  // namespace tessera::hardware

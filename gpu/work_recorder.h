#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "base/parallel.h"
#include "binner/binner.h"
#include "binner/record_cache.h"
#include "frontend/front_end.h"
#include "gpu/configuration.h"
#include "gpu/displacement_memory.h"
#include "gpu/observed_work.h"
#include "gpu/patch_table.h"
#include "hardware/shader_costs.h"
#include "memory/l2.h"
#include "memory/ledger.h"
#include "memory/line_cache.h"
#include "tilecore/tile_core.h"
#include "timing/work.h"

namespace tessera::gpu {

// What the front end and the binner counted of a frame so far.
struct GeometryCounters {
  frontend::FrontendCounters frontend;
  frontend::InstanceCounters instances;
  frontend::PatchGroupCounters groups;
  frontend::PreviousDepthCounters previous_depth;
  tilecore::SamplingCounters procedures;  // of the sparse pass
  binner::BinnerCounters binner;
};

// The record of a frame beside its counters: the work that the timing and the energy model read and, where it is asked
// for, every transfer.
struct FrameRecord {
  timing::FrameWork work;
  memory::Traffic other;  // work.other_bytes
  // Only when transfers are recorded; as work.rounds. `tiles` and the phases of a tile as there.
  struct RoundAccesses {
    std::vector<memory::Access> geometry;
    std::vector<std::vector<memory::Access>> tiles;
  };
  std::vector<RoundAccesses> accesses;
};

// What a tile moved over the external memory interface, by purpose.
using TileTraffic = std::array<memory::Traffic, memory::kPurposeCount>;

// An array in memory of which each tile has a piece, one behind the other in the machine's order: a burst moves with the
// first tile that needs it.
struct TileArray {
  memory::Unit unit;
  memory::Purpose purpose;
  bool write = false;
  std::uint64_t base = 0;   // of it within its purpose
  std::uint64_t moved = 0;  // up to here, from `base` on
};

// Requests of a tile to units that all tiles share.
struct SharedRequests {
  std::vector<std::uint32_t> records;  // of the sub-patch table, in the order of its lists
  std::vector<tilecore::TessellationRequest> tessellations;
  std::vector<tilecore::SubPatchName> hidden;  // what its list names beside these
  std::vector<tilecore::CellsDrawn> cells;
  bool began = false;     // this round was the first to render it
  bool finished = false;  // no further round renders it
  bool stored = false;    // its pixels were written into the frame
};
// The units that a round has for them, besides the L2.
struct SharedCaches {
  binner::RecordCache& records;
  tilecore::TessellationCache& tessellations;
};

// Where a round belongs: to the pass of that name, a further one of the pass at hand.
struct RoundPlace {
  std::string_view pass;
  bool waits = true;  // its geometry waits until all rounds before are stored, as where it reuses their lists' memory
};

// Takes the events of a run of the machine where they happen, simulates what tiles share (the L2) in emulated order, and
// puts together the FrameRecord of a frame. One for each run.
//
// A round is an object, and so is a tile's part of it: what was counted belongs to the round that lives.
class WorkRecorder {
 public:
  class Round;
  class Tile;

  // `heights`: null where textures are not modelled. Both must outlive the recorder. `keep_items`: of every sub-patch and
  // warp, for machine.timing=events.
  // `maps`: the lines of depth maps among those of textures.
  WorkRecorder(const GpuConfiguration& gpu, const PatchTable& records, const DisplacementMemory* heights,
               bool record_accesses, bool keep_items = false, memory::LineRange maps = {});

  // Begins a view: everything up to end_view() belongs to it, and it has a front end, lists and tiles of its own. The
  // recorder keeps textures and traffic of tiles of the last view alone. `first_tile`: the number that the record gives the
  // view's first tile.
  void begin_view(std::uint32_t first_tile = 0);
  // Ends the view: the recorder notes how much of their cores' memories the tiles of its rounds take.
  void end_view(const tilecore::TileJob& job);
  // Events of the front end since the last call; they go to the round that begins next.
  void front_end(const scene::FrameGeometry& frame, const frontend::FrontEndResult& result);
  // The sampling controller's sparse pass, likewise. `maps` must outlive the rounds.
  void sparse_pass(const tilecore::ParameterMaps& maps);
  // Bytes that the binner hashed, likewise.
  void hashed(std::uint64_t bytes) { geometry_.events[timing::Event::kHashedInputs] += bytes; }
  // Where the binner's transfers go; null when they are not recorded.
  memory::AccessLog* binner_log() { return record_accesses_ ? &geometry_log_ : nullptr; }

  // After the binner's run, when the lists are complete. One round at a time.
  [[nodiscard]] Round begin_round(const binner::Binner& binner, const tilecore::TileOrder& order,
                                  const RoundPlace& place);

  // What tiles took from their cores, and the L2's account, since the last call.
  struct Sums {
    tilecore::CoreCounters core;
    memory::L2Counters l2;
    memory::Ledger ledger;
  };
  Sums take_sums();

  // The frame stores these lines before it reads them.
  void stored(const memory::LineRange& lines) { record_.work.stored_lines.push_back(lines); }

  // By tile, of the whole frame.
  std::vector<TextureUse> take_textures() { return std::exchange(textures_, {}); }

  std::vector<TileTraffic> take_traffic() { return std::exchange(traffic_, {}); }

  // `ledger`: of the whole frame; what no round holds of it becomes other_bytes. Ends the recording, after the last view.
  FrameRecord finish(const memory::Ledger& ledger);

 private:
  struct Slot {
    bool used = false;
    timing::TileWork work;
    timing::TileItems items;  // when items are kept
    // From the tile's result:
    std::vector<std::uint32_t> texture_misses, patches_read, history_lines;
    std::size_t visibility_misses = 0;
    bool light_records = false;
    memory::AccessLog log;
  };
  std::uint64_t share(binner::TileIndex tile, const SharedRequests& use, SharedCaches caches);
  std::uint64_t move(binner::TileIndex tile, TileArray& array, std::uint64_t offset, std::uint64_t bytes);
  // Bytes fetched.
  std::uint64_t share_records(Slot& slot, std::span<const std::uint32_t> records, binner::RecordCache& cache);
  // What the front end read since the last call, `bytes` in all.
  void log_front_end(const frontend::FrontEndResult& result, std::uint64_t bytes);
  // Events of the geometry since `before`.
  void count_geometry(const GeometryCounters& before);
  // Lines of tables since the last call, of which `missed` bytes were fetched.
  void keep_table_lines(const frontend::FrontEndResult& result, std::uint64_t missed);
  // And of depths and what they hid.
  void log_coarse_depth(const memory::Traffic& more);
  // Vertices of a sub-patch that the tessellation cache lacks, and lines that making them fetches. `item`: of the
  // sub-patch; nullptr without items.
  void share_tessellation(Slot& slot, binner::TileIndex tile, const tilecore::TessellationRequest& request,
                          tilecore::TessellationCache& cache, timing::SubPatchItem* item);
  // Lines of a tessellation: records, then heights; the number of these, and elements of the records that are decoded.
  struct Fetched {
    std::uint32_t height_lines = 0;
    std::uint64_t elements = 0;
  };
  Fetched share_records_and_heights(Slot& slot, const tilecore::TessellationRequest& request);
  void share_lines(Slot& slot, const PatchTable::Lines& lines, timing::Phase phase, memory::Purpose purpose);
  // Leaves those of record_lines_ from `first` on that the texture cache lacks.
  void keep_misses(std::size_t first);
  // Lines that drawing cells of procedures fetches: numbers of pieces, and cells.
  void share_cells(Slot& slot, const tilecore::CellsDrawn& cells, std::size_t& next_item);
  // Lines that the tile's texture unit missed before and while shading, and records that its pixel shader reads.
  void share_shading(Slot& slot);
  // What its resolve unit reads of the previous frame. With items it takes its time as what bypasses the L2 does.
  void share_history(Slot& slot);
  // False: it was fetched.
  bool share_line(Slot& slot, std::uint32_t line, timing::Phase phase,
                  memory::Purpose purpose = memory::Purpose::kTexture);
  // A vertex's own shader.
  const hardware::ShaderCost& domain_cost(const tilecore::TessellationRequest& request) const;
  // What an item of a tile that tessellates or reads asks of the L2.
  void keep_lines(Slot& slot, const PatchTable::Lines& lines);
  void end_round();
  // Adds what a ledger moved since `seen` to rounds_; bytes of it.
  std::uint64_t since(const memory::Ledger& ledger, memory::Traffic& seen);

  const GpuConfiguration& gpu_;
  const PatchTable& records_;
  const DisplacementMemory* heights_;
  const scene::FrameGeometry* frame_ = nullptr;
  const tilecore::ParameterMaps* procedures_ = nullptr;
  std::vector<std::uint32_t> height_lines_;
  std::vector<PatchTable::Lines> record_lines_;
  memory::LineCache image_cache_;           // a core's texture cache, where geometry images are read through it
  tilecore::TextureCounters image_counts_;  // of it
  std::array<std::array<hardware::ShaderCost, 3>, 3> domain_costs_;  // by ShaderFeatures::Surface, Motion
  bool record_accesses_, keep_items_;
  memory::LineRange maps_;
  std::vector<std::uint64_t> state_bytes_;  // of a tile, by round
  memory::L2 l2_;
  PerThread<Sums> sums_;
  std::vector<Slot> slots_;  // by tile
  std::vector<TextureUse> textures_;
  std::vector<TileTraffic> traffic_;
  const tilecore::TileOrder* order_ = nullptr;
  bool waits_ = true;  // RoundPlace::waits
  std::uint32_t first_tile_ = 0;
  memory::AccessLog geometry_log_;
  GeometryCounters counted_;                            // what was counted up to the round before
  memory::Traffic front_end_traffic_, binner_traffic_;  // seen so far
  std::uint64_t front_end_tables_ = 0;
  std::size_t front_end_lines_ = 0, front_end_records_ = 0;
  std::vector<std::uint32_t> geometry_lines_;
  memory::Traffic coarse_depth_;      // of the front end, seen so far
  memory::Ledger arrays_;             // of tiles: what they moved of a TileArray
  memory::Traffic rounds_;            // of all that went to a round
  std::uint64_t geometry_bytes_ = 0;  // of the front end, for the round to come
  timing::GeometryWork geometry_;
  FrameRecord record_;
};

// A tile in the hands of a core, on the thread that renders it.
class WorkRecorder::Tile {
 public:
  // The log for what is charged on the tile's behalf; null when transfers are not recorded.
  memory::AccessLog* log() { return recorder_.record_accesses_ ? &slot_.log : nullptr; }
  // Takes what its core did for the tile, but for the requests to shared units; the core's counters are left.
  // `finished`: its pixels are written, it is not stored for a further round.
  void end(const tilecore::TileJob& job, tilecore::TileResult& result, bool finished);

 private:
  friend class Round;
  Tile(WorkRecorder& recorder, std::size_t tile);
  Tile(WorkRecorder& recorder, std::size_t tile, tilecore::TileCore& core);
  void take_items(tilecore::TileResult& result);

  WorkRecorder& recorder_;
  Slot& slot_;
  std::size_t tile_;
};

// A binner's run and the tiles that it leads to; it ends with the object.
class WorkRecorder::Round {
 public:
  ~Round() { recorder_.end_round(); }
  Round(const Round&) = delete;
  Round& operator=(const Round&) = delete;

  // Tiles of a round may be recorded by any threads at once, each tile once.
  [[nodiscard]] Tile tile(std::size_t number, tilecore::TileCore& core) { return {recorder_, number, core}; }

  // Without a core: its work was done before, and its log is put in its place.
  [[nodiscard]] Tile tile(std::size_t number) { return {recorder_, number}; }
  // A tile's lookups of textures and attributes, likewise without the rest of what it shares; in emulated order.
  void share_lookups(binner::TileIndex tile) { recorder_.share_shading(recorder_.slots_[tile]); }

  // A tile's use of what is shared; tile by tile in emulated order, when they are rendered: takes its records to their
  // cache, its requests to the tessellation cache, then its lines to the L2. Bytes of the sub-patch table fetched.
  std::uint64_t share(binner::TileIndex tile, const SharedRequests& use, SharedCaches caches) {
    return recorder_.share(tile, use, caches);
  }

  // A tile's piece of an array, in emulated order. Bytes on the bus.
  std::uint64_t move(binner::TileIndex tile, TileArray& array, std::uint64_t offset, std::uint64_t bytes) {
    return recorder_.move(tile, array, offset, bytes);
  }

 private:
  friend class WorkRecorder;
  explicit Round(WorkRecorder& recorder) : recorder_(recorder) {}

  WorkRecorder& recorder_;
};

}  // namespace tessera::gpu

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

// Counters of the front end and the binner for a frame so far.
struct GeometryCounters {
  frontend::FrontendCounters frontend;
  frontend::InstanceCounters instances;
  frontend::PatchGroupCounters groups;
  frontend::PreviousDepthCounters previous_depth;
  tilecore::SamplingCounters procedures;  // of the sparse pass
  binner::BinnerCounters binner;
};

// The record of a frame beside its counters: the work that the timing and the energy model read and, on request, every
// transfer.
struct FrameRecord {
  timing::FrameWork work;
  memory::Traffic other;  // work.other_bytes
  // Only if transfers are recorded; `tiles` and the phases of a tile correspond to work.rounds.
  struct RoundAccesses {
    std::vector<memory::Access> geometry;
    std::vector<std::vector<memory::Access>> tiles;
  };
  std::vector<RoundAccesses> accesses;
};

// Traffic of a tile over the external memory interface, by purpose.
using TileTraffic = std::array<memory::Traffic, memory::kPurposeCount>;

// An array in memory with a piece for each tile, back to back in the machine's order: a burst moves with the first tile
// that needs it.
struct TileArray {
  memory::Unit unit;
  memory::Purpose purpose;
  bool write = false;
  std::uint64_t base = 0;   // base address within its purpose
  std::uint64_t moved = 0;  // bytes from `base` on that have moved
};

// Requests of a tile to units that all tiles share.
struct SharedRequests {
  std::vector<std::uint32_t> records;  // of the sub-patch table, in the order of its lists
  std::vector<tilecore::TessellationRequest> tessellations;
  std::vector<tilecore::SubPatchName> hidden;  // hidden sub-patches of its list
  std::vector<tilecore::CellsDrawn> cells;
  bool began = false;     // this round was the first to render it
  bool finished = false;  // no further round renders it
  bool stored = false;    // its pixels were written into the frame
};
// Caches for these requests in a round, besides the L2.
struct SharedCaches {
  binner::RecordCache& records;
  tilecore::TessellationCache& tessellations;
};

// Name of the pass that a round belongs to.
struct RoundPlace {
  std::string_view pass;
  bool waits = true;  // its geometry waits until all rounds before are stored, for example to reuse their lists' memory
};

// Takes the events of a run of the machine at their source, simulates the shared unit (the L2) in emulated order, and
// puts together the FrameRecord of a frame. One for each run.
//
// A round is an object, and so is a tile's part of it: counts belong to the round that exists.
class WorkRecorder {
 public:
  class Round;
  class Tile;

  // `heights`: nullptr if textures are not modelled. All must outlive the recorder. `keep_items`: keeps every sub-patch
  // and warp, for machine.timing=events. `maps`: the lines of depth maps among the lines of textures.
  WorkRecorder(const GpuConfiguration& gpu, const PatchTable& records, const DisplacementMemory* heights,
               bool record_accesses, bool keep_items = false, memory::LineRange maps = {});

  // Begins a view with its own front end, lists and tiles; everything up to end_view() belongs to it. The recorder
  // keeps textures and traffic of tiles of the last view alone. `first_tile`: the number that the record gives the
  // view's first tile.
  void begin_view(std::uint32_t first_tile = 0);
  // Ends the view: the recorder notes how much of their cores' memories the tiles of its rounds take.
  void end_view(const tilecore::TileJob& job);
  // Adds the events of the front end since the last call; they go to the round that begins next.
  void front_end(const scene::FrameGeometry& frame, const frontend::FrontEndResult& result);
  // Adds the events of the sampling controller's sparse pass, likewise. `maps` must outlive the rounds.
  void sparse_pass(const tilecore::ParameterMaps& maps);
  // Adds the bytes that the binner hashed, likewise.
  void hashed(std::uint64_t bytes) { geometry_.events[timing::Event::kHashedInputs] += bytes; }
  // The log for the binner's transfers; nullptr if they are not recorded.
  memory::AccessLog* binner_log() { return record_accesses_ ? &geometry_log_ : nullptr; }

  // Begins a round. Call it after the binner's run, when the lists are complete. One round at a time.
  [[nodiscard]] Round begin_round(const binner::Binner& binner, const tilecore::TileOrder& order,
                                  const RoundPlace& place);

  // Counters of the tiles' cores, and the L2's counters and ledger, since the last call.
  struct Sums {
    tilecore::CoreCounters core;
    memory::L2Counters l2;
    memory::Ledger ledger;
  };
  Sums take_sums();

  // Notes that the frame stores these lines before it reads them.
  void stored(const memory::LineRange& lines) { record_.work.stored_lines.push_back(lines); }

  // Rounds that have ended, of all views.
  std::span<const timing::WorkRound> rounds() const { return record_.work.rounds; }

  // By tile, for the last view.
  std::vector<TextureUse> take_textures() { return std::exchange(textures_, {}); }

  std::vector<TileTraffic> take_traffic() { return std::exchange(traffic_, {}); }

  // `ledger`: the ledger of the whole frame; its bytes outside of rounds become other_bytes. Ends the recording, after
  // the last view.
  FrameRecord finish(const memory::Ledger& ledger);

 private:
  struct Slot {
    bool used = false;
    timing::TileWork work;
    timing::TileItems items;  // if items are kept
    // From the tile's result:
    std::vector<std::uint32_t> texture_misses, patches_read, history_lines;
    std::size_t visibility_misses = 0;
    bool light_records = false;
    memory::AccessLog log;
  };
  std::uint64_t share(binner::TileIndex tile, const SharedRequests& use, SharedCaches caches);
  std::uint64_t move(binner::TileIndex tile, TileArray& array, std::uint64_t offset, std::uint64_t bytes);
  // Returns the bytes fetched.
  std::uint64_t share_records(Slot& slot, std::span<const std::uint32_t> records, binner::RecordCache& cache);
  // Logs the front end's reads since the last call, `bytes` in all.
  void log_front_end(const frontend::FrontEndResult& result, std::uint64_t bytes);
  // Adds the events of the geometry since `before`.
  void count_geometry(const GeometryCounters& before);
  // Keeps the lines of tables since the last call, of which `missed` bytes were fetched.
  void keep_table_lines(const frontend::FrontEndResult& result, std::uint64_t missed);
  // Logs the transfers of depths and of the candidates they hid.
  void log_coarse_depth(const memory::Traffic& more);
  // Makes the vertices of a sub-patch that the tessellation cache lacks, and reads the lines they need. `item`: the
  // sub-patch's item; nullptr without items.
  void share_tessellation(Slot& slot, binner::TileIndex tile, const tilecore::TessellationRequest& request,
                          tilecore::TessellationCache& cache, timing::SubPatchItem* item);
  // Reads the lines of a tessellation, records, then heights. Returns the number of height lines, and of decoded
  // elements of the records.
  struct Fetched {
    std::uint32_t height_lines = 0;
    std::uint64_t elements = 0;
  };
  Fetched share_records_and_heights(Slot& slot, const tilecore::TessellationRequest& request);
  void share_lines(Slot& slot, const PatchTable::Lines& lines, timing::Phase phase, memory::Purpose purpose);
  // Keeps, from `first` on, only the lines of record_lines_ that the texture cache lacks.
  void keep_misses(std::size_t first);
  // Reads the lines that drawing cells of procedures needs: numbers of pieces, and cells.
  void share_cells(Slot& slot, const tilecore::CellsDrawn& cells, std::size_t& next_item);
  // Reads the lines that the tile's texture unit missed before and while shading, and the records that its pixel shader
  // reads.
  void share_shading(Slot& slot);
  // Reads the previous frame's lines for the tile's resolve unit. With items these reads are timed as accesses that
  // bypass the L2.
  void share_history(Slot& slot);
  // Returns false if the line was fetched.
  bool share_line(Slot& slot, std::uint32_t line, timing::Phase phase,
                  memory::Purpose purpose = memory::Purpose::kTexture);
  // The cost of a vertex's own shader.
  const hardware::ShaderCost& domain_cost(const tilecore::TessellationRequest& request) const;
  // Keeps the lines that an item of a tessellating or reading tile asks of the L2.
  void keep_lines(Slot& slot, const PatchTable::Lines& lines);
  void end_round();
  // Adds the traffic of a ledger since `seen` to rounds_; returns its bytes.
  std::uint64_t since(const memory::Ledger& ledger, memory::Traffic& seen);

  const GpuConfiguration& gpu_;
  const PatchTable& records_;
  const DisplacementMemory* heights_;
  const scene::FrameGeometry* frame_ = nullptr;
  const tilecore::ParameterMaps* procedures_ = nullptr;
  std::vector<std::uint32_t> height_lines_;
  std::vector<PatchTable::Lines> record_lines_;
  memory::LineCache image_cache_;           // a core's texture cache, if geometry images are read through it
  tilecore::TextureCounters image_counts_;  // of image_cache_
  std::array<std::array<hardware::ShaderCost, 3>, 3> domain_costs_;  // by ShaderFeatures::Surface, Motion
  bool record_accesses_, keep_items_;
  memory::LineRange maps_;
  std::vector<std::uint8_t> maps_read_;     // by line of maps_: 1 if the frame has looked it up
  std::vector<std::uint64_t> state_bytes_;  // bytes of a tile, by round
  memory::L2 l2_;
  PerThread<Sums> sums_;
  std::vector<Slot> slots_;  // by tile
  std::vector<TextureUse> textures_;
  std::vector<TileTraffic> traffic_;
  const tilecore::TileOrder* order_ = nullptr;
  bool waits_ = true;  // RoundPlace::waits
  std::uint32_t first_tile_ = 0;
  memory::AccessLog geometry_log_;
  GeometryCounters counted_;                            // counters up to the previous round
  memory::Traffic front_end_traffic_, binner_traffic_;  // seen so far
  std::uint64_t front_end_tables_ = 0;
  std::size_t front_end_lines_ = 0, front_end_records_ = 0;
  std::vector<std::uint32_t> geometry_lines_;
  memory::Traffic coarse_depth_;      // of the front end, seen so far
  memory::Ledger arrays_;             // of tiles: traffic of each TileArray
  memory::Traffic rounds_;            // of all transfers that went to a round
  std::uint64_t geometry_bytes_ = 0;  // of the front end, for the next round
  timing::GeometryWork geometry_;
  FrameRecord record_;
};

// A tile in a core, on the thread that renders it.
class WorkRecorder::Tile {
 public:
  // The log for transfers charged on the tile's behalf; nullptr if they are not recorded.
  memory::AccessLog* log() { return recorder_.record_accesses_ ? &slot_.log : nullptr; }
  // Takes the core's results for the tile, except for the requests to shared units; the core's counters stay.
  // `finished`: its pixels are written and no further round renders it.
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

// A run of the binner and the tiles that follow from it; the round ends with the object.
class WorkRecorder::Round {
 public:
  ~Round() { recorder_.end_round(); }
  Round(const Round&) = delete;
  Round& operator=(const Round&) = delete;

  // Tiles of a round may be recorded by any threads at once, each tile once.
  [[nodiscard]] Tile tile(std::size_t number, tilecore::TileCore& core) { return {recorder_, number, core}; }

  // Without a core: its work was done before, and its log is put in its place.
  [[nodiscard]] Tile tile(std::size_t number) { return {recorder_, number}; }
  // A tile's lookups of textures and attributes, likewise without its other shared requests; in emulated order.
  void share_lookups(binner::TileIndex tile) { recorder_.share_shading(recorder_.slots_[tile]); }

  // Replays a tile's requests to shared units; tile by tile in emulated order, after rendering: its records go to their
  // cache, its tessellations to the tessellation cache, then its lines to the L2. Returns the fetched bytes of the
  // sub-patch table.
  std::uint64_t share(binner::TileIndex tile, const SharedRequests& use, SharedCaches caches) {
    return recorder_.share(tile, use, caches);
  }

  // Moves a tile's piece of an array, in emulated order. Returns the bytes on the bus.
  std::uint64_t move(binner::TileIndex tile, TileArray& array, std::uint64_t offset, std::uint64_t bytes) {
    return recorder_.move(tile, array, offset, bytes);
  }

 private:
  friend class WorkRecorder;
  explicit Round(WorkRecorder& recorder) : recorder_(recorder) {}

  WorkRecorder& recorder_;
};

}  // namespace tessera::gpu

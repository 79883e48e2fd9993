#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include "base/parallel.h"
#include "binner/binner.h"
#include "frontend/front_end.h"
#include "gpu/frame_graph.h"
#include "gpu/frame_result.h"
#include "gpu/input_signatures.h"
#include "gpu/observed_work.h"
#include "gpu/stored_arrays.h"
#include "gpu/work_progress.h"
#include "gpu/work_recorder.h"
#include "tilecore/tessellation/tessellation_cache.h"
#include "tilecore/tile_core.h"

namespace tessera::gpu {

// A run of the machine over one view: the scheduler's inputs and outputs.
struct ViewRun {
  const GpuConfiguration& gpu;
  const tilecore::TileJob& job;
  WorkRecorder& recorder;
  FrameResult& result;
  ObservedWork* record;  // of the pass that gives colours; nullptr if no observer is set
  WorkProgress* progress = nullptr;
  InputSignatures* inputs = nullptr;  // rendering elimination; nullptr: all tiles are rendered
  std::string_view pass = "main";     // name of its last pass that draws, or only one
  std::uint32_t first_tile = 0;       // WorkRecorder::begin_view()
  bool waits = true;                  // the geometry of its first pass waits for the tiles of all passes before
  std::span<const CopyPass> copies{};
  const Taa* taa = nullptr;           // before the bloom; nullptr: none
  TaaHistory* taa_history = nullptr;  // with `taa`
  const Bloom* bloom = nullptr;       // before the copies; nullptr: none
  float bloom_strength = 0;
  StoredArrays* arrays = nullptr;  // of texels beside colours that passes store; nullptr: no pass stores any
  // Names of the other pass of a path with two: one that stores depths alone, one that lights a stored G-buffer.
  std::string_view prepass = "prepass", light = "light";
  // With `record`: takes the work of the pass that draws before, a prepass or the scene behind surfaces that transmit.
  ObservedWork* record_before = nullptr;
};

// The tiles of a view in the machine's order, which is also the order of their pieces of arrays.
struct OrderedTiles {
  const tilecore::TileOrder& order;
  const binner::TileGrid& grid;

  // Every tile has a piece of `bytes(pixels)` bytes in an array, back to back; tiles with `moves(tile)` move their
  // pieces.
  // Returns the bytes on the bus.
  template <class Bytes, class Moves>
  std::uint64_t move(WorkRecorder::Round& round, TileArray array, const Bytes& bytes, const Moves& moves) const {
    std::uint64_t offset = 0, moved = 0;
    for (const binner::TileIndex tile : order.tiles()) {
      const std::uint64_t piece = bytes(grid.pixels(tile));
      if (moves(tile)) moved += round.move(tile, array, offset, piece);
      offset += piece;
    }
    return moved;
  }
};

// A pass that draws: the binner fills the parameter buffer, tiles render the entries of their lists and are finished.
struct GeometryPass {
  std::string_view name;
  std::span<const frontend::BoundedSubPatch> sub_patches;
  std::vector<bool> only{};  // the tiles that are rendered; empty: all
  std::vector<bool> open{};  // tiles that store scene color and stay unfinished for transmissive surfaces; empty: none
  bool binned = false;       // the lists hold all sub-patches already
  bool waits = true;         // its geometry waits for the tiles of earlier passes
  bool depths_only = false;  // a prepass: tiles store the depths of opaque surfaces alone

  // Whether the pass that gives colours comes after it.
  bool comes_before() const { return depths_only || !open.empty(); }
  ObservedWork* record_of(const ViewRun& run) const { return comes_before() ? run.record_before : run.record; }
};

// A pass over the tiles of an image, without lists.
struct ImagePass {
  std::string_view name;
  const char* stage;  // of StageTimer
  bool waits = true;
  const CopyPass* copy = nullptr;  // the copy of its tiles; it omits tiles that rendering elimination omits
  const tilecore::ColorAttachment* loads = nullptr;  // attachment to load; nullptr: none, or the source of `copy`
  std::function<void()> begin{};                     // on the host, before any tile
  std::function<void(tilecore::TileCore&, binner::TileIndex)> work{};
  std::function<void(WorkRecorder::Round&)> share{};  // arrays that tiles share, after the last one
};

// Gives tiles to the tile cores, in rounds. If the parameter buffer is too small, a round of partial renders precedes a
// further round.
//
// Tiles go to any thread and begin in the machine's order (tilecore.tile_order). Counters and images do not depend on
// the threads: tiles use shared units in that order, while later tiles are rendered.
class TileScheduler {
 public:
  // Called with the name of a pass when the pass ends.
  using PassEnd = std::function<void(std::string_view)>;
  TileScheduler(const ViewRun& run, PerThread<tilecore::TileCore>& cores, binner::Binner& binner,
                const tilecore::TileOrder& order, tilecore::TessellationCache& cache, PassEnd pass_end);

  void render(const GeometryPass& pass);
  void render(const ImagePass& pass);
  // With a G-buffer in memory, behind the pass that stored it: loads and lights it, and stores the pixels.
  void light();

  OrderedTiles tiles() const { return {order_, binner_.grid()}; }

  // Empties the lists of all tiles, and the sub-patch table.
  void empty_lists();

  // Bytes of the depths that tile cores store for the next frame: 2 bytes a block, tile by tile in the machine's order.
  std::uint64_t depth_bytes() const { return tile_depth_bytes() * binner_.grid().tile_count(); }

 private:
  struct Round;
  // The work of light() for a tile, which its core does right after it has filled the tile's part of the G-buffer.
  struct Lit {
    bool there = false;
    tilecore::TileResult result;
    memory::AccessLog log;
  };
  void light_tile(std::size_t tile, tilecore::TileState& state);
  // Codes what a finished tile stores beside its colours.
  void store_texels(const GeometryPass& pass, std::size_t tile, const tilecore::TileState& state);
  // Charges tiles for the depths of a prepass, or for a G-buffer and its depths.
  void move_depths(WorkRecorder::Round& round, std::span<const SharedRequests> tiles, bool write) const;
  void move_gbuffer(WorkRecorder::Round& round, std::span<const SharedRequests> tiles, bool write) const;
  // Returns false if the tile will be rendered again with the transmissive surfaces.
  bool finish_tile(const Round& round, std::size_t tile, tilecore::TileState& state);
  void render_tile(Round& round, std::size_t tile);
  // The tiles that need no rendering; empty: all tiles need it. `complete`: the lists hold all sub-patches.
  std::vector<bool> compare_inputs(bool complete);
  std::uint64_t tile_depth_bytes() const;
  SignatureMemory signature_memory() const;
  // Shares the flags of a shadow map's tiles.
  void share_flags(Round& round);
  // Charges the tiles of an ended pass for storing attachments, for headers and for signatures of colours.
  void share_stores(WorkRecorder::Round& round, std::span<const SharedRequests> tiles,
                    const tilecore::AttachmentActions& actions);
  // `place`: of the signatures that belong to `store`.
  void share_signatures(WorkRecorder::Round& round, std::span<const SharedRequests> tiles,
                        const tilecore::FrameStore& store, std::uint64_t place);
  // Charges the tiles that stored an attachment (`write`), or the tiles that began, which load it: for its pixels or, if it
  // is compressed, for its headers.
  void move_attachment(WorkRecorder::Round& round, std::span<const SharedRequests> tiles,
                       const tilecore::ColorAttachment& attachment, bool write);
  // Replays a rendered tile's requests to the units that all tiles share. Called tile by tile, in emulated order.
  void share(Round& round, binner::TileIndex tile);

  const ViewRun& run_;
  PerThread<tilecore::TileCore>& cores_;
  binner::Binner& binner_;
  const tilecore::TileOrder& order_;
  tilecore::TessellationCache& cache_;
  PassEnd pass_end_;
  bool first_pass_ = true;
  std::vector<Lit> lit_;                     // by tile; empty: no G-buffer is stored
  std::vector<std::vector<float>> prepass_;  // depths of its samples, by tile; empty: no prepass was before
  std::vector<bool> unchanged_;              // tiles that rendering elimination omitted; empty: none
  std::uint32_t records_before_ = 0;         // number of records in the emptied sub-patch tables
};

}  // namespace tessera::gpu

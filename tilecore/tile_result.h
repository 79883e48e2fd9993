#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "memory/ledger.h"
#include "tilecore/core_counters.h"
#include "tilecore/drawable_counts.h"
#include "tilecore/procedural/sampling_controller.h"
#include "tilecore/tessellation/tessellation_cache.h"
#include "timing/items.h"

namespace tessera::tilecore {

// Cells of procedures that were drawn at once.
struct CellsDrawn {
  std::uint32_t requests_before = 0;  // TileResult::tessellations before them
  std::vector<SamplingController::CellRead> reads;
};

// All results of a core for a tile: counts, and requests to units that tiles share, in the order in which the core made
// them. Shared units take them in emulated order.
struct TileResult {
  CoreCounters counters;
  memory::Ledger ledger;
  std::vector<TessellationRequest> tessellations;
  std::vector<SubPatchName> hidden;  // in lists, but behind all surfaces that the tile sees
  std::vector<CellsDrawn> cells;
  std::vector<std::uint32_t> patches_read;    // base patches whose attributes were read, each once, by number
  std::vector<std::uint32_t> texture_misses;  // lines that the core's texture cache lacked
  std::size_t visibility_misses = 0;          // number of these that came before shading
  std::uint64_t visibility_texels = 0;        // lookups before shading
  std::vector<std::uint32_t> history_lines;   // lines of previous frames, as ResolveUnit::take_lines()
  // Bytes of blended layers, tables of triangles, vertices and listed lights that the tile kept.
  std::uint64_t extra_bytes = 0;
  bool light_records = false;        // it read the records of the frame's lights
  bool stored = false;               // its pixels were written
  std::uint64_t single_samples = 0;  // samples beyond the first of each pixel that were stored or resolved apart
  // Filled only with items (TileCore::keep_items()):
  std::vector<timing::SubPatchItem> sub_patches;
  std::vector<timing::WarpItem> warps;
  std::vector<std::uint32_t> texture_requests;  // lines
};

// Totals of a core over all tiles of a frame.
struct CoreTotals {
  std::vector<DrawableCounts> drawables;  // by number; as long as the longest list of drawables
  double resolve_seconds = 0;             // processor time of the resolve unit, without the plain multisample resolve
};

}  // namespace tessera::tilecore

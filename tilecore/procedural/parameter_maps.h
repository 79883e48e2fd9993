#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/counter.h"
#include "binner/tile_grid.h"
#include "frontend/bounds/procedure_bounds.h"
#include "memory/ledger.h"
#include "scene/frame_geometry.h"
#include "tilecore/procedural/procedure_settings.h"

namespace tessera::tilecore {

struct SamplingCounters {
  std::uint64_t objects = 0;
  std::uint64_t sparse_evaluations = 0;
  std::uint64_t sparse_operations = 0;
  std::uint64_t interval_evaluations = 0;
  std::uint64_t cells = 0;
  std::uint64_t cells_outside = 0;
  std::uint64_t cells_culled_backface = 0;
  std::uint64_t rates_clamped = 0;
  std::uint64_t tags = 0;
  std::uint64_t map_entries = 0;
  std::uint64_t cells_culled_occlusion = 0;
  std::uint64_t samples = 0;
  std::uint64_t array_slots = 0;
  std::uint64_t operations = 0;
  std::uint64_t samples_outside_tile = 0;
  std::uint64_t samples_behind = 0;
  std::uint64_t samples_backfacing = 0;
  std::uint64_t samples_not_finite = 0;
  std::uint64_t footprint_tests = 0;
  std::uint64_t writes = 0;
  std::uint64_t drawn_lines = 0;
  std::uint64_t holes_suspected = 0;
  std::uint64_t holes_refilled = 0;
};

// A cell of a piece's parameter domain that may be seen: an entry of the rate map.
struct ParameterCell {
  std::uint32_t drawable = 0, piece = 0;
  float u0 = 0, v0 = 0, u1 = 0, v1 = 0;    // of the piece
  std::uint16_t steps_u = 1, steps_v = 1;  // samples along each parameter
  float x0 = 0, y0 = 0, x1 = 0, y1 = 0;    // pixels: where it may be seen, over the whole shutter and lens
  float near_z = 0;
  std::uint8_t slack = kLeastSlack;  // 1/256 pixel, by which footprints are wider than their parallelograms
  // What a smooth surface bends within half a step, and rounding.
  static constexpr std::uint8_t kLeastSlack = 1;
};

// The result of the sparse pass over one frame: tag map (tiles with cells), parameter map (cells per tile) and rate map
// (steps per cell). Immutable once built.
//
// Invariants of interval maps (cited by the tests):
//   PM1  Every visible point of a procedure lies in a tile whose list holds the point's cell: recall of tag and
//        parameter map is 1.
//   PM2  Half a step to each side moves a sample's image by at most `spacing` sub-pixels along x and along y, unless
//        rates_clamped counts the cell.
//   PM3  The footprints of neighbouring samples of a cell leave no gap between them, kinks of the surface included:
//        where there are any, what the derivative varies within the cell is the footprints' slack, up to half of
//        `spacing`.
class ParameterMaps {
 public:
  static constexpr std::uint16_t kMaxSteps = 128;
  // With Style::kLines: pixels beyond a cell's bounds that its lines may reach. Cells are listed for every tile that
  // they reach so.
  static constexpr float kLineReach = 1;

  // `side`: sub-pixels along each side of a pixel, which the spacing refers to.
  ParameterMaps(const scene::FrameGeometry& frame, const binner::TileGrid& grid, const ProcedureSettings& settings,
                int side, std::uint64_t burst_bytes);

  const ProcedureSettings& settings() const { return settings_; }
  const std::vector<ParameterCell>& cells() const { return cells_; }
  // Cells that may be seen in a tile, lines included, in ascending order.
  std::span<const std::uint32_t> of_tile(binner::TileIndex tile) const {
    return std::span(tile_cells_).subspan(tile_first_[tile], tile_first_[tile + 1] - tile_first_[tile]);
  }
  // Operations of one sample of a piece: point, tangents and view.
  std::uint64_t operations(std::uint32_t drawable, std::uint32_t piece) const { return operations_[drawable][piece]; }
  const SamplingCounters& counters() const { return counters_; }
  const memory::Ledger& ledger() const { return ledger_; }

  // [spec: the published rate map has a radius per parameter] A cell in memory: its place in the domain, two rates, its
  // depth, its slack.
  static constexpr std::uint64_t kCellBytes = 13;
  // An entry of a tile's list: the number of a cell.
  static constexpr std::uint64_t kEntryBytes = 4;

 private:
  void sort_into_tiles(const binner::TileGrid& grid);

  ProcedureSettings settings_;
  std::vector<ParameterCell> cells_;
  std::vector<std::vector<std::uint64_t>> operations_;  // by drawable and piece
  std::vector<std::uint32_t> tile_first_, tile_cells_;
  SamplingCounters counters_;
  memory::Ledger ledger_;
};

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr auto kCounterFields<tilecore::SamplingCounters> =
    std::to_array<CounterField<tilecore::SamplingCounters>>({
        {"sampling.objects", &tilecore::SamplingCounters::objects, Combine::kSum, "objects",
         "Procedures that the sampling controller draws.", ""},
        {"sampling.sparse_evaluations", &tilecore::SamplingCounters::sparse_evaluations, Combine::kSum, "samples",
         "Parameter tuples evaluated by the sparse pass of procedures.maps=published.", ""},
        {"sampling.sparse_operations", &tilecore::SamplingCounters::sparse_operations, Combine::kSum, "operations",
         "Arithmetic of these tuples: point, tangents and view.", ""},
        {"sampling.interval_evaluations", &tilecore::SamplingCounters::interval_evaluations, Combine::kSum, "cells",
         "Cells of the parameter domain bounded by interval evaluation, kept or not, by the sparse pass of "
         "procedures.maps=interval.",
         ""},
        {"sampling.cells", &tilecore::SamplingCounters::cells, Combine::kSum, "cells",
         "Cells in the rate map: those that may be seen.", ""},
        {"sampling.cells_outside", &tilecore::SamplingCounters::cells_outside, Combine::kSum, "cells",
         "Cells dropped because they lie outside the frame or its depth range.", ""},
        {"sampling.cells_culled_backface", &tilecore::SamplingCounters::cells_culled_backface, Combine::kSum, "cells",
         "Cells dropped because all of them faces away.", ""},
        {"sampling.rates_clamped", &tilecore::SamplingCounters::rates_clamped, Combine::kSum, "cells",
         "Cells whose rate is unknown or beyond the most steps that a cell may have.", ""},
        {"sampling.tags", &tilecore::SamplingCounters::tags, Combine::kSum, "tiles",
         "Pairs of an object and a tile in the tag map.", ""},
        {"sampling.map_entries", &tilecore::SamplingCounters::map_entries, Combine::kSum, "entries",
         "Pairs of a cell and a tile in the parameter map.", ""},
        {"sampling.cells_culled_occlusion", &tilecore::SamplingCounters::cells_culled_occlusion, Combine::kSum,
         "entries", "Entries of the parameter map skipped because every sample of the tile sees something nearer.", ""},
        {"sampling.samples", &tilecore::SamplingCounters::samples, Combine::kSum, "samples",
         "Parameter tuples evaluated by the render pass.", ""},
        {"sampling.array_slots", &tilecore::SamplingCounters::array_slots, Combine::kSum, "slots",
         "Lanes that the emulated SIMD array issued for them and for lines, idle ones included.", ""},
        {"sampling.operations", &tilecore::SamplingCounters::operations, Combine::kSum, "operations",
         "Arithmetic of these lanes: point, tangents and view of a sample; the tone of lines apart.", ""},
        {"sampling.samples_outside_tile", &tilecore::SamplingCounters::samples_outside_tile, Combine::kSum, "samples",
         "Samples that reached no sample point of their tile's pixels.", ""},
        {"sampling.samples_behind", &tilecore::SamplingCounters::samples_behind, Combine::kSum, "samples",
         "Samples in front of the near plane or behind the far one; dropped before the division counts.", ""},
        {"sampling.samples_backfacing", &tilecore::SamplingCounters::samples_backfacing, Combine::kSum, "samples",
         "Samples dropped because the surface faces away there.", ""},
        {"sampling.samples_not_finite", &tilecore::SamplingCounters::samples_not_finite, Combine::kSum, "samples",
         "Samples whose procedure gave infinity or no number; skipped.", ""},
        {"sampling.footprint_tests", &tilecore::SamplingCounters::footprint_tests, Combine::kSum, "tests",
         "Sample points of the tile buffer tested against footprints.", ""},
        {"sampling.writes", &tilecore::SamplingCounters::writes, Combine::kSum, "writes",
         "Sample points of the tile buffer that passed the depth test and were written.", ""},
        {"sampling.strokes", &tilecore::SamplingCounters::drawn_lines, Combine::kSum, "samples",
         "Samples along parameter lines, of procedures.style=lines.", ""},
        {"sampling.holes_suspected", &tilecore::SamplingCounters::holes_suspected, Combine::kSum, "samples",
         "Sample points of the tile buffer that see something farther than two opposite neighbours, which see one "
         "surface. With procedures.refill.",
         ""},
        {"sampling.holes_refilled", &tilecore::SamplingCounters::holes_refilled, Combine::kSum, "samples",
         "Of those, the ones where the surface was found by solving for its parameters.", ""},
    });
TESSERA_COUNTERS_COVER(tilecore::SamplingCounters);
template <>
inline constexpr bool kAbsentWhenIdle<tilecore::SamplingCounters> = true;

}  // namespace tessera

#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "base/counter.h"
#include "base/rect.h"
#include "base/vec.h"
#include "frontend/bounds/procedure_bounds.h"
#include "frontend/patch_splitter.h"
#include "memory/ledger.h"
#include "scene/frame_geometry.h"
#include "tilecore/procedural/cell_steps.h"
#include "tilecore/procedural/procedure_settings.h"

namespace tessera::tilecore {

struct SamplingCounters {
  std::uint64_t sparse_evaluations = 0;
  std::uint64_t sparse_operations = 0;
  std::uint64_t interval_evaluations = 0;
  std::uint64_t cells = 0;
  std::uint64_t rates_clamped = 0;
  std::uint64_t tags = 0;
  std::uint64_t map_entries = 0;
  std::uint64_t samples = 0;
  std::uint64_t array_slots = 0;
  std::uint64_t operations = 0;
  std::uint64_t samples_outside_tile = 0;
  std::uint64_t samples_behind = 0;
  std::uint64_t samples_backfacing = 0;
  std::uint64_t samples_not_finite = 0;
  std::uint64_t footprint_tests = 0;
  std::uint64_t writes = 0;
  std::uint64_t layers_merged = 0;
  std::uint64_t drawn_lines = 0;
};

// A possibly visible cell of a piece's parameter domain: an entry of the rate map.
struct ParameterCell {
  std::uint32_t drawable = 0, piece = 0;
  float u0 = 0, v0 = 0, u1 = 0, v1 = 0;  // in the piece's parameters
  CellSteps steps, line_steps;           // of its surface, and along its lines
  float x0 = 0, y0 = 0, x1 = 0, y1 = 0;  // pixels: bounds on screen, over the whole shutter and lens
  float near_z = 0;
  std::uint8_t slack = kLeastSlack;  // 1/256 pixel, by which footprints are wider than their parallelograms
  // Allowance for a smooth surface's curvature within half a step, and for rounding.
  static constexpr std::uint8_t kLeastSlack = 1;
  // ProcedureCellBounds::Image, rounded outwards.
  struct Image {
    float x = 0, y = 0, x_u = 0, y_u = 0, x_v = 0, y_v = 0;
    float off = std::numeric_limits<float>::infinity(), off_u = 0, off_v = 0;
    bool known() const { return off < std::numeric_limits<float>::infinity(); }
  };
  Image image;

  // Whether its surface may appear in `pixels`.
  bool touches(const IntRect& pixels) const {
    return !(x1 < static_cast<float>(pixels.x0) || y1 < static_cast<float>(pixels.y0) ||
             x0 > static_cast<float>(pixels.x1) || y0 > static_cast<float>(pixels.y1));
  }
  // Whether the footprint of sample (i, j) may reach a pixel of `pixels`; false only if it certainly does not. Uses the
  // image alone and does not evaluate the sample.
  bool may_reach(int i, int j, const IntRect& pixels) const;
};

// The result of the sparse pass over one frame: its rate map, and the sub-patches that stand for its cells in the tile
// lists. Immutable once built.
//
// Invariants of interval maps (cited by the tests):
//   PM1  Every visible point of a procedure lies in a tile whose list has the point's cell as an entry, at its time.
//   PM2  Half a step to each side moves a sample's image by at most `spacing` sub-pixels along x and along y, unless
//        rates_clamped counts the cell.
//   PM3  The footprints of neighbouring samples of a cell leave no gap between them, kinks of the surface included:
//        a footprint's slack is CellSteps::bend(), and at kinks the variation of the derivative within
//        the cell, up to half a sub-pixel.
class ParameterMaps {
 public:
  // With Style::kLines: pixels beyond a cell's bounds that its lines may reach. A cell is listed for every tile within
  // this reach.
  static constexpr float kLineReach = 1;
  // Lines lie a little in front of their surface: at this share of its depth.
  static constexpr float kLineDepth = 1.0f - 1.0f / 256;
  // Most cells of a frame: their numbers, which take the place of a sub-patch's range, and the emulator's memory have
  // no room for more.
  static constexpr std::size_t kMaxCells = std::size_t{1} << 22;

  // `side`: sub-pixels along each side of a pixel, to which the spacing refers. Throws LimitError if there are more
  // than kMaxCells cells.
  ParameterMaps(const scene::FrameGeometry& frame, const IntRect& region, const ProcedureSettings& settings, int side,
                std::uint64_t burst_bytes);

  const ProcedureSettings& settings() const { return settings_; }
  const std::vector<ParameterCell>& cells() const { return cells_; }
  // The binner's input: a sub-patch for each cell, in their order. Its base patch belongs to the cell's drawable, and
  // its range encodes the cell's number.
  const std::vector<frontend::BoundedSubPatch>& sub_patches() const { return sub_patches_; }
  static scene::CellRange range_of(std::uint32_t cell);
  static std::uint32_t cell_of(const scene::CellRange& range);
  // Operations of one sample of a piece: point, tangents and view.
  std::uint64_t operations(std::uint32_t drawable, std::uint32_t piece) const { return operations_[drawable][piece]; }
  const SamplingCounters& counters() const { return counters_; }
  const memory::Ledger& ledger() const { return ledger_; }
  // Drops the images of steps, so that a tile evaluates all of them.
  void forget_images() {
    for (ParameterCell& cell : cells_) cell.image = {};
  }

  // A cell in memory [assumed]: its piece (4), its place in the domain (5), steps (4), slack (1), rectangle on screen
  // (8), and the image of its steps (10).
  static constexpr std::uint64_t kCellBytes = 32;

 private:
  ProcedureSettings settings_;
  std::vector<ParameterCell> cells_;
  std::vector<frontend::BoundedSubPatch> sub_patches_;
  std::vector<std::vector<std::uint64_t>> operations_;  // by drawable and piece
  SamplingCounters counters_;
  memory::Ledger ledger_;
};

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr auto kCounterFields<tilecore::SamplingCounters> = std::to_array<
    CounterField<tilecore::SamplingCounters>>({
    {"procedures.sparse_evaluations", &tilecore::SamplingCounters::sparse_evaluations, Combine::kSum, "samples",
     "Parameter tuples evaluated by the sparse pass of procedures.mode=published.", ""},
    {"procedures.sparse_operations", &tilecore::SamplingCounters::sparse_operations, Combine::kSum, "operations",
     "Arithmetic of these tuples: point, tangents and view.", ""},
    {"procedures.interval_evaluations", &tilecore::SamplingCounters::interval_evaluations, Combine::kSum, "cells",
     "Cells of the parameter domain bounded by interval evaluation, kept or not, by the sparse pass of "
     "procedures.mode=interval.",
     ""},
    {"procedures.cells", &tilecore::SamplingCounters::cells, Combine::kSum, "cells",
     "Cells in the rate map, which holds the cells that may be visible.", ""},
    {"procedures.rates_clamped", &tilecore::SamplingCounters::rates_clamped, Combine::kSum, "cells",
     "Cells whose rate is unknown or beyond the most steps that a cell may have.", ""},
    {"procedures.tags", &tilecore::SamplingCounters::tags, Combine::kSum, "tiles",
     "Pairs of a procedure and a tile whose list has cells of it.", ""},
    {"procedures.map_entries", &tilecore::SamplingCounters::map_entries, Combine::kSum, "entries",
     "Entries of tile lists that are cells; part of tilecore.entries_fetched.", ""},
    {"procedures.samples", &tilecore::SamplingCounters::samples, Combine::kSum, "samples",
     "Parameter tuples evaluated by the render pass.", ""},
    {"procedures.array_slots", &tilecore::SamplingCounters::array_slots, Combine::kSum, "slots",
     "Lanes that the emulated SIMD array issued for them and for lines, idle ones included.", ""},
    {"procedures.operations", &tilecore::SamplingCounters::operations, Combine::kSum, "operations",
     "Arithmetic of these lanes: point, tangents and view of a sample; the tone of lines apart.", ""},
    {"procedures.samples_outside_tile", &tilecore::SamplingCounters::samples_outside_tile, Combine::kSum, "samples",
     "Samples that reached no sample point of their tile's pixels.", ""},
    {"procedures.samples_behind", &tilecore::SamplingCounters::samples_behind, Combine::kSum, "samples",
     "Samples in front of the near plane or behind the far one; dropped before the division counts.", ""},
    {"procedures.samples_backfacing", &tilecore::SamplingCounters::samples_backfacing, Combine::kSum, "samples",
     "Samples dropped because the surface faces away there.", ""},
    {"procedures.samples_not_finite", &tilecore::SamplingCounters::samples_not_finite, Combine::kSum, "samples",
     "Samples whose procedure gave infinity or no number; skipped.", ""},
    {"procedures.footprint_tests", &tilecore::SamplingCounters::footprint_tests, Combine::kSum, "tests",
     "Sample points of the tile buffer tested against footprints.", ""},
    {"procedures.writes", &tilecore::SamplingCounters::writes, Combine::kSum, "writes",
     "Sample points of the tile buffer that passed the depth test and were written, or got a layer.", ""},
    {"procedures.layers_merged", &tilecore::SamplingCounters::layers_merged, Combine::kSum, "layers",
     "Layers that a neighbouring footprint of the same surface had left as well: dropped when the tile is finished.",
     ""},
    {"procedures.strokes", &tilecore::SamplingCounters::drawn_lines, Combine::kSum, "samples",
     "Samples along parameter lines, of procedures.style=lines.", ""},
});
TESSERA_COUNTERS_COVER(tilecore::SamplingCounters);
template <>
inline constexpr bool kAbsentWhenIdle<tilecore::SamplingCounters> = true;

}  // namespace tessera

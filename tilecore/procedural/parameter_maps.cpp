#include "tilecore/procedural/parameter_maps.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "base/parallel.h"
#include "frontend/front_end.h"
#include "shaders_cpp/procedures/operation_count.h"
#include "tilecore/procedural/sparse_pass.h"

namespace tessera::tilecore {
namespace {

using frontend::ParameterBox;
using frontend::ProcedureCellBounds;
using scene::FrameGeometry;
using scene::PosedDrawable;
using scene::Procedure;

constexpr int kMaxHalvings = 20;
// Of cells without a bounded derivative, where halving rarely helps, and of cells across the near plane, which stay
// large on screen.
constexpr int kMaxHalvingsUnknown = 8, kMaxHalvingsNear = 13;
constexpr std::uint16_t kUnknownSteps = 16, kMaxStepsNear = 24;

// Steps that a cell is sampled with along one parameter.
std::uint16_t whole_steps(double wanted, bool& clamped) {
  const double steps = std::ceil(wanted);
  if (steps <= ParameterMaps::kMaxSteps) return static_cast<std::uint16_t>(std::max(steps, 1.0));
  clamped = true;
  return std::isfinite(steps) ? ParameterMaps::kMaxSteps : kUnknownSteps;
}

float line_reach(const ProcedureSettings& settings) {
  return settings.style == ProcedureSettings::Style::kLines ? ParameterMaps::kLineReach : 0.0f;
}

// Bounds one piece's cells by intervals, halving those that are large on screen.
class IntervalPass {
 public:
  IntervalPass(const FrameGeometry& frame, const IntRect& region, const ProcedureSettings& settings, int side,
               SparseResult& out)
      : frame_(frame),
        region_(region),
        settings_(settings),
        reach_(settings.spacing / side),
        margin_(static_cast<double>(line_reach(settings))),
        out_(out) {}

  void run(std::uint32_t drawable, std::uint32_t piece) {
    drawable_ = drawable;
    piece_ = piece;
    visit({0, 0, 1, 1}, 0);
  }

 private:
  void visit(const ParameterBox& box, int halvings) {
    const PosedDrawable& drawable = frame_.drawables[drawable_];
    ++out_.counters.interval_evaluations;
    const ProcedureCellBounds b = bound_procedure_cell(frame_, drawable, drawable.procedure->pieces[piece_], box);
    // Negated: bounds that are no numbers keep the cell.
    if (b.outside || b.x1 < region_.x0 - margin_ || b.y1 < region_.y0 - margin_ || b.x0 > region_.x1 + margin_ ||
        b.y0 > region_.y1 + margin_) {
      ++out_.counters.cells_outside;
      return;
    }
    if (b.faces_away) {
      ++out_.counters.cells_culled_backface;
      return;
    }
    const double side = 2 * std::max(b.reach_u, b.reach_v);
    const int most = !std::isfinite(side) ? kMaxHalvingsUnknown : b.crosses_near ? kMaxHalvingsNear : kMaxHalvings;
    if (!(side <= settings_.cell_pixels) && halvings < most) {
      // The longer side; where both are unknown, each in turn.
      const bool along_u = b.reach_u == b.reach_v ? halvings % 2 == 0 : b.reach_u > b.reach_v;
      const double u = (box.u0 + box.u1) / 2, v = (box.v0 + box.v1) / 2;
      visit(along_u ? ParameterBox{box.u0, box.v0, u, box.v1} : ParameterBox{box.u0, box.v0, box.u1, v}, halvings + 1);
      visit(along_u ? ParameterBox{u, box.v0, box.u1, box.v1} : ParameterBox{box.u0, v, box.u1, box.v1}, halvings + 1);
      return;
    }
    keep(box, b);
  }

  void keep(const ParameterBox& box, const ProcedureCellBounds& b) {
    ParameterCell cell;
    cell.drawable = drawable_;
    cell.piece = piece_;
    // Halves of halves: floats hold them exactly.
    cell.u0 = static_cast<float>(box.u0), cell.v0 = static_cast<float>(box.v0), cell.u1 = static_cast<float>(box.u1),
    cell.v1 = static_cast<float>(box.v1);
    bool clamped = false;
    const Procedure& procedure = *frame_.drawables[drawable_].procedure;
    if (procedure.rates_program) {
      const double inputs[] = {
          (box.u0 + box.u1) / 2, (box.v0 + box.v1) / 2, box.u1 - box.u0, box.v1 - box.v0, b.reach_u, b.reach_v, reach_};
      const auto asked = shaders::program_rates(*procedure.rates_program, procedure.rates_constants.data(), inputs);
      cell.steps_u = whole_steps(asked[0], clamped);
      cell.steps_v = whole_steps(asked[1], clamped);
    } else {
      cell.steps_u = sample_steps(b.reach_u, reach_, clamped);
      cell.steps_v = sample_steps(b.reach_v, reach_, clamped);
    }
    // Blurred and across the near plane, a sample may sweep the whole image: few of those.
    if (b.crosses_near && (frame_.drawables[drawable_].moving || frame_.projection.lens_scale != 0)) {
      clamped = clamped || cell.steps_u > kMaxStepsNear || cell.steps_v > kMaxStepsNear;
      cell.steps_u = std::min(cell.steps_u, kMaxStepsNear);
      cell.steps_v = std::min(cell.steps_v, kMaxStepsNear);
    }
    out_.counters.rates_clamped += clamped ? 1 : 0;
    // Smooth surfaces bend by less than the least slack within half a step.
    if (procedure.declaration().kinks) {
      const double bend = std::min(b.bend_u / cell.steps_u + b.bend_v / cell.steps_v, reach_ / 2);
      cell.slack = static_cast<std::uint8_t>(
          std::clamp(std::ceil(bend * 256), static_cast<double>(ParameterCell::kLeastSlack), 255.0));
    }
    // Bounds have a margin of 2^-8, which outlasts the rounding to float inside any frame.
    cell.x0 = static_cast<float>(b.x0), cell.y0 = static_cast<float>(b.y0), cell.x1 = static_cast<float>(b.x1),
    cell.y1 = static_cast<float>(b.y1);
    cell.near_z = static_cast<float>(b.near_z * (1 - 0x1p-20));
    out_.cells.push_back(cell);
  }

  const FrameGeometry& frame_;
  const IntRect& region_;
  const ProcedureSettings& settings_;
  const double reach_, margin_;  // pixels
  SparseResult& out_;
  std::uint32_t drawable_ = 0, piece_ = 0;
};

}  // namespace

std::uint16_t sample_steps(double reach, double max_reach, bool& clamped) {
  // Both parameters share the reach: each takes half of it.
  return whole_steps(2 * reach / max_reach, clamped);
}

ParameterMaps::ParameterMaps(const FrameGeometry& frame, const binner::TileGrid& grid,
                             const ProcedureSettings& settings, int side, std::uint64_t burst_bytes)
    : settings_(settings) {
  struct Task {
    std::uint32_t drawable, piece;
  };
  std::vector<Task> tasks;
  operations_.resize(frame.drawables.size());
  for (std::size_t d = 0; d < frame.drawables.size(); ++d) {
    const Procedure* procedure = frame.drawables[d].procedure;
    if (procedure == nullptr || !frame.drawables[d].visible) continue;
    ++counters_.objects;
    ledger_.read(memory::Unit::kSampling, memory::Purpose::kPatchData,
                 memory::burst_bytes(0, frontend::patch_record_bytes(frame, frame.drawables[d].drawable->first_patch),
                                     burst_bytes));
    for (std::size_t p = 0; p < procedure->pieces.size(); ++p) {
      tasks.push_back({static_cast<std::uint32_t>(d), static_cast<std::uint32_t>(p)});
      operations_[d].push_back(shaders::count_geometry(procedure->shape, procedure->pieces[p].input).total() +
                               shaders::count_view().total());
    }
  }
  // Pieces on any thread, joined in order.
  std::vector<SparseResult> results(tasks.size());
  PerThread<std::unique_ptr<SampleRegisters>> registers;
  parallel_for(tasks.size(), [&](std::size_t k) {
    if (settings_.maps == ProcedureSettings::Maps::kInterval) {
      IntervalPass(frame, grid.region(), settings_, side, results[k]).run(tasks[k].drawable, tasks[k].piece);
    } else {
      std::unique_ptr<SampleRegisters>& own = registers.local();
      if (own == nullptr) own = std::make_unique<SampleRegisters>();
      run_published_pass(frame, grid.region(), settings_, side, tasks[k].drawable, tasks[k].piece, *own, results[k]);
    }
  });
  for (std::size_t k = 0; k < tasks.size(); ++k) {
    cells_.insert(cells_.end(), results[k].cells.begin(), results[k].cells.end());
    results[k].counters.sparse_operations =
        results[k].counters.sparse_evaluations * operations(tasks[k].drawable, tasks[k].piece);
    tessera::merge(counters_, results[k].counters);
  }
  counters_.cells = cells_.size();
  sort_into_tiles(grid);
  const auto write = [&](std::uint64_t bytes) {
    ledger_.write(memory::Unit::kSampling, memory::Purpose::kSamplingMaps, memory::burst_bytes(0, bytes, burst_bytes));
  };
  write(cells_.size() * kCellBytes);
  write(tile_cells_.size() * kEntryBytes);
}

void ParameterMaps::sort_into_tiles(const binner::TileGrid& grid) {
  const float reach = line_reach(settings_);
  const auto covered = [&](const ParameterCell& cell) {
    return grid.covered(frontend::ScreenBounds{cell.x0 - reach, cell.y0 - reach, cell.x1 + reach, cell.y1 + reach, 0,
                                               cell.near_z, cell.near_z, false});
  };
  tile_first_.assign(grid.tile_count() + 1, 0);
  const auto each_tile = [&](const ParameterCell& cell, const auto& visit) {
    const IntRect tiles = covered(cell);
    for (int row = tiles.y0; row < tiles.y1; ++row)
      for (int column = tiles.x0; column < tiles.x1; ++column) visit(grid.index(column, row));
  };
  for (const ParameterCell& cell : cells_) each_tile(cell, [&](binner::TileIndex t) { ++tile_first_[t + 1]; });
  for (std::size_t t = 1; t < tile_first_.size(); ++t) tile_first_[t] += tile_first_[t - 1];
  tile_cells_.resize(tile_first_.back());
  std::vector<std::uint32_t> next(tile_first_.begin(), tile_first_.end() - 1),
      last_object(grid.tile_count(), 0xFFFFFFFFu);
  for (std::uint32_t c = 0; c < cells_.size(); ++c)
    each_tile(cells_[c], [&](binner::TileIndex t) {
      tile_cells_[next[t]++] = c;
      if (last_object[t] != cells_[c].drawable) ++counters_.tags;  // cells come object by object
      last_object[t] = cells_[c].drawable;
    });
  counters_.map_entries = tile_cells_.size();
}

}  // namespace tessera::tilecore

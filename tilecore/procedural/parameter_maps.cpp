#include "tilecore/procedural/parameter_maps.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <tuple>

#include <fmt/format.h>

#include "base/error.h"
#include "base/parallel.h"
#include "frontend/front_end.h"
#include "frontend/sub_patch_effects.h"
#include "scene/procedure_patch.h"
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
// Limits for cells without a bounded derivative, where halving rarely helps, and for cells across the near plane, which
// stay large on screen.
constexpr int kMaxHalvingsUnknown = 8, kMaxHalvingsNear = 13;
constexpr std::uint16_t kMaxStepsNear = 24;

// Pixels for the rounding of projected corners and footprints, beyond ProcedureCellBounds::rounding.
constexpr double kGrowMargin = 0x1p-5;

LimitError too_many_cells() {
  return LimitError(fmt::format("procedures have more than {} cells in a frame: raise procedures.cell_pixels",
                                ParameterMaps::kMaxCells));
}

// Number of steps along one parameter with which a cell is sampled.
std::uint16_t whole_steps(double wanted, bool& clamped) {
  const double steps = std::ceil(wanted);
  if (steps <= CellSteps::kMax) return static_cast<std::uint16_t>(std::max(steps, 1.0));
  clamped = true;
  return std::isfinite(steps) ? CellSteps::kMax : CellSteps::kUnknown;
}

float line_reach(const ProcedureSettings& settings) {
  return settings.style == ProcedureSettings::Style::kLines ? ParameterMaps::kLineReach : 0.0f;
}

// Bounds one piece's cells by intervals, halving the cells that are large on screen.
class IntervalPass {
 public:
  IntervalPass(const FrameGeometry& frame, const IntRect& region, const ProcedureSettings& settings, int side,
               SparseResult& out)
      : frame_(frame),
        region_(region),
        settings_(settings),
        side_(side),
        margin_(static_cast<double>(line_reach(settings))),
        out_(out) {}

  void run(std::uint32_t drawable, std::uint32_t piece) {
    drawable_ = drawable;
    piece_ = piece;
    kinks_ = frame_.drawables[drawable].procedure->declaration().kinks;
    visit({0, 0, 1, 1}, 0);
  }

 private:
  void visit(const ParameterBox& box, int halvings) {
    const PosedDrawable& drawable = frame_.drawables[drawable_];
    ++out_.counters.interval_evaluations;
    const ProcedureCellBounds b = bound_procedure_cell(frame_, drawable, piece_, box);
    // Negated, so that bounds of NaN keep the cell.
    if (b.outside || b.x1 < region_.x0 - margin_ || b.y1 < region_.y0 - margin_ || b.x0 > region_.x1 + margin_ ||
        b.y0 > region_.y1 + margin_ || b.faces_away)
      return;
    const double side = 2 * std::max(b.reach_u, b.reach_v);
    const int most = !std::isfinite(side) ? kMaxHalvingsUnknown : b.crosses_near ? kMaxHalvingsNear : kMaxHalvings;
    if (!(side <= settings_.cell_pixels) && halvings < most) {
      // Halves the longer side; if both are unknown, each in turn.
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
    // The bounds are multiples of negative powers of two, which floats hold exactly.
    cell.u0 = static_cast<float>(box.u0), cell.v0 = static_cast<float>(box.v0), cell.u1 = static_cast<float>(box.u1),
    cell.v1 = static_cast<float>(box.v1);
    bool clamped = false;
    cell.steps = steps_of(box, b, clamped);
    cell.line_steps = line_steps_of(b);
    // A blurred sample across the near plane may sweep the whole image: few of those are allowed.
    if (b.crosses_near && (frame_.drawables[drawable_].moving || frame_.projection.lens_scale != 0)) {
      clamped = clamped || cell.steps.u > kMaxStepsNear || cell.steps.v > kMaxStepsNear;
      cell.steps.u = std::min(cell.steps.u, kMaxStepsNear);
      cell.steps.v = std::min(cell.steps.v, kMaxStepsNear);
    }
    out_.counters.rates_clamped += clamped ? 1 : 0;
    cell.slack = slack_of(cell.steps, b);
    cell.image = image_of(b.image);
    // Bounds have a margin of 2^-8, which exceeds the rounding to float inside any frame.
    cell.x0 = static_cast<float>(b.x0), cell.y0 = static_cast<float>(b.y0), cell.x1 = static_cast<float>(b.x1),
    cell.y1 = static_cast<float>(b.y1);
    cell.near_z = static_cast<float>(b.near_z * (1 - 0x1p-20));
    // A footprint's middle lies in the box's projection, moved by the lens. The footprint reaches at most half a step
    // and its slack from there, whatever its linear form omits.
    const double grow = kGrowMargin + b.rounding + lens_reach(b) + cell.slack * (1.0 / 256) + b.reach_u / cell.steps.u +
                        b.reach_v / cell.steps.v;
    keep_cell(frame_, settings_, cell, static_cast<float>(b.far_z), b.crosses_near,
              std::isfinite(grow) ? &b.box : nullptr, grow, out_);
  }

  static CellReach reach_of(const ProcedureCellBounds& b) {
    return {b.reach_x_u, b.reach_y_u, b.reach_x_v, b.reach_y_v, b.bend_u, b.bend_v};
  }

  CellSteps steps_of(const ParameterBox& box, const ProcedureCellBounds& b, bool& clamped) const {
    const Procedure& procedure = *frame_.drawables[drawable_].procedure;
    if (procedure.rates_program) {
      const double inputs[] = {
          (box.u0 + box.u1) / 2,    (box.v0 + box.v1) / 2, box.u1 - box.u0, box.v1 - box.v0, b.reach_u, b.reach_v,
          settings_.spacing / side_};
      const auto asked = shaders::program_rates(*procedure.rates_program, procedure.rates_constants.data(), inputs);
      return {whole_steps(asked[0], clamped), whole_steps(asked[1], clamped)};
    }
    CellReach reach = reach_of(b);
    double most = settings_.spacing / side_;
    // At a kink the derivatives at a sample say nothing about the surface beside it.
    if (kinks_) {
      most = std::min(most, 1.0 / side_);
      reach.bend_u = reach.bend_v = 0;
    }
    return CellSteps::for_reach(reach, most, settings_.flatness, clamped);
  }

  // Lines lie close in front of the surface, at the depth of their samples: half a step along one is no more than half a
  // sub-pixel, whatever the spacing.
  CellSteps line_steps_of(const ProcedureCellBounds& b) const {
    if (settings_.style != ProcedureSettings::Style::kLines) return {};
    const double most = std::min(settings_.spacing, 1.0) / side_;
    bool clamped = false;
    const CellSteps along_u = CellSteps::for_reach({2 * b.reach_u, 0, 0, 0, 0, 0}, most, 1, clamped),
                    along_v = CellSteps::for_reach({2 * b.reach_v, 0, 0, 0, 0, 0}, most, 1, clamped);
    return {along_u.u, along_v.u};
  }

  // At a kink the derivatives may change within one footprint by all that they vary within the cell.
  std::uint8_t slack_of(const CellSteps& steps, const ProcedureCellBounds& b) const {
    const double bend = kinks_ ? std::min(b.bend_u / steps.u + b.bend_v / steps.v, 0.5 / side_)
                               : std::min(steps.bend(reach_of(b)), settings_.flatness);
    return static_cast<std::uint8_t>(
        std::clamp(std::ceil(bend * 256), static_cast<double>(ParameterCell::kLeastSlack), 255.0));
  }

  // Largest distance in pixels by which the lens moves a point between the cell's depths.
  double lens_reach(const ProcedureCellBounds& b) const {
    if (frame_.projection.lens_scale == 0) return 0;
    return std::max(frontend::defocus_radius(frame_.projection, b.near_z),
                    frontend::defocus_radius(frame_.projection, b.far_z));
  }

  static ParameterCell::Image image_of(const ProcedureCellBounds::Image& image) {
    // Rounding of floats inside any frame, and of their sums.
    constexpr double kRounding = 0x1p-6;
    const auto up = [](double a) { return static_cast<float>(a * (1 + 0x1p-20)); };
    return {static_cast<float>(image.x),
            static_cast<float>(image.y),
            static_cast<float>(image.x_u),
            static_cast<float>(image.y_u),
            static_cast<float>(image.x_v),
            static_cast<float>(image.y_v),
            up(image.off + kRounding),
            up(image.off_u),
            up(image.off_v)};
  }

  const FrameGeometry& frame_;
  const IntRect& region_;
  const ProcedureSettings& settings_;
  const double side_, margin_;  // sub-pixels of a pixel; pixels
  SparseResult& out_;
  std::uint32_t drawable_ = 0, piece_ = 0;
  bool kinks_ = false;
};

}  // namespace

void keep_cell(const FrameGeometry& frame, const ProcedureSettings& settings, ParameterCell cell, float far_z,
               bool crosses_near, const frontend::MovingBox* box, double grow, SparseResult& out) {
  const PosedDrawable& drawable = frame.drawables[cell.drawable];
  if (settings.style == ProcedureSettings::Style::kLines) cell.near_z *= ParameterMaps::kLineDepth;
  const float reach = line_reach(settings);
  frontend::BoundedSubPatch piece;
  piece.base_patch = scene::patch_of_piece_point(drawable, cell.piece, cell.u0, cell.v0).patch;
  piece.bounds = {cell.x0 - reach, cell.y0 - reach, cell.x1 + reach, cell.y1 + reach, static_cast<float>(grow) + reach,
                  cell.near_z,     far_z,           crosses_near};
  if (box != nullptr) {
    piece.box = *box;
  } else {
    constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
    piece.box.axes = {DVec3(1, 0, 0), DVec3(0, 1, 0), DVec3(0, 0, 1)};
    piece.box.low =
        piece.box.high = {std::array{kNoNumber, kNoNumber, kNoNumber}, std::array{kNoNumber, kNoNumber, kNoNumber}};
  }
  const auto effect = [](bool on, frontend::SubPatchEffect which) { return on ? int{which} : 0; };
  piece.effects = static_cast<std::uint8_t>(
      effect(drawable.moving, frontend::kEffectMotion) |
      effect(frame.projection.lens_scale != 0, frontend::kEffectDefocus) |
      effect(drawable.material->alpha_mode == scene::AlphaMode::kBlend, frontend::kEffectBlending) |
      effect(drawable.material->alpha_mode == scene::AlphaMode::kMask, frontend::kEffectAlphaTest));
  out.sub_patches.push_back(piece);
  out.cells.push_back(cell);
  if (out.cells.size() > ParameterMaps::kMaxCells) throw too_many_cells();
}

bool ParameterCell::may_reach(int i, int j, const IntRect& pixels) const {
  const float du = 1.0f / static_cast<float>(steps.u), dv = 1.0f / static_cast<float>(steps.v);
  const float s = (2.0f * static_cast<float>(i) + 1.0f) * du - 1.0f,
              t = (2.0f * static_cast<float>(j) + 1.0f) * dv - 1.0f;
  // The sample's place, then its footprint: half a step and slack.
  const float off = (image.off + std::abs(s) * image.off_u + std::abs(t) * image.off_v) +
                    (image.off_u * du + image.off_v * dv) + static_cast<float>(slack) * (1.0f / 256);
  const float x = image.x + s * image.x_u + t * image.x_v, y = image.y + s * image.y_u + t * image.y_v,
              reach_x = off + std::abs(image.x_u) * du + std::abs(image.x_v) * dv,
              reach_y = off + std::abs(image.y_u) * du + std::abs(image.y_v) * dv;
  // Infinity and NaN reach everything.
  return !(x + reach_x < static_cast<float>(pixels.x0) || x - reach_x > static_cast<float>(pixels.x1) ||
           y + reach_y < static_cast<float>(pixels.y0) || y - reach_y > static_cast<float>(pixels.y1));
}

scene::CellRange ParameterMaps::range_of(std::uint32_t cell) {
  const auto bits = [&](int at) { return static_cast<std::uint8_t>(cell >> at & 127); };
  return {bits(0), bits(7), bits(14), bits(21)};
}

std::uint32_t ParameterMaps::cell_of(const scene::CellRange& range) {
  return range.i0 | std::uint32_t{range.j0} << 7 | std::uint32_t{range.i1} << 14 | std::uint32_t{range.j1} << 21;
}

ParameterMaps::ParameterMaps(const FrameGeometry& frame, const IntRect& region, const ProcedureSettings& settings,
                             int side, std::uint64_t burst_bytes)
    : settings_(settings) {
  struct Task {
    std::uint32_t drawable, piece;
  };
  std::vector<Task> tasks;
  operations_.resize(frame.drawables.size());
  for (std::size_t d = 0; d < frame.drawables.size(); ++d) {
    const Procedure* procedure = frame.drawables[d].procedure;
    if (procedure == nullptr || !frame.drawables[d].visible) continue;
    ledger_.read(memory::Unit::kSampling, memory::Purpose::kPatchData,
                 memory::burst_bytes(0, frontend::patch_record_bytes(frame, frame.drawables[d].drawable->first_patch),
                                     burst_bytes));
    for (std::size_t p = 0; p < procedure->pieces.size(); ++p) {
      tasks.push_back({static_cast<std::uint32_t>(d), static_cast<std::uint32_t>(p)});
      // A shape that deforms is evaluated at both motion keys.
      operations_[d].push_back((shaders::count_geometry(procedure->shape, procedure->pieces[p].input).total() +
                                shaders::count_view().total()) *
                               (frame.drawables[d].deforming ? 2 : 1));
    }
  }
  // Pieces run on any thread and are joined in order.
  std::vector<SparseResult> results(tasks.size());
  PerThread<std::unique_ptr<SampleRegisters>> registers;
  parallel_for(tasks.size(), [&](std::size_t k) {
    if (settings_.mode == ProcedureSettings::Mode::kInterval) {
      IntervalPass(frame, region, settings_, side, results[k]).run(tasks[k].drawable, tasks[k].piece);
    } else {
      std::unique_ptr<SampleRegisters>& own = registers.local();
      if (own == nullptr) own = std::make_unique<SampleRegisters>();
      run_published_pass(frame, region, settings_, side, tasks[k].drawable, tasks[k].piece, *own, results[k]);
    }
  });
  for (std::size_t k = 0; k < tasks.size(); ++k) {
    SparseResult& of = results[k];
    if (cells_.size() + of.cells.size() > kMaxCells) throw too_many_cells();
    for (frontend::BoundedSubPatch& piece : of.sub_patches)
      piece.range = range_of(static_cast<std::uint32_t>(sub_patches_.size() + (&piece - of.sub_patches.data())));
    cells_.insert(cells_.end(), of.cells.begin(), of.cells.end());
    sub_patches_.insert(sub_patches_.end(), of.sub_patches.begin(), of.sub_patches.end());
    of.counters.sparse_operations = of.counters.sparse_evaluations * operations(tasks[k].drawable, tasks[k].piece);
    tessera::merge(counters_, of.counters);
    of = {};
  }
  counters_.cells = cells_.size();
  ledger_.write(memory::Unit::kSampling, memory::Purpose::kSamplingMaps,
                memory::burst_bytes(0, cells_.size() * kCellBytes, burst_bytes));
}

}  // namespace tessera::tilecore

#include "tilecore/procedural/sampling_controller.h"

#include <algorithm>
#include <tuple>

#include "base/round_up.h"
#include "tilecore/procedural/procedure_layers.h"

namespace tessera::tilecore {
namespace {

using scene::PosedDrawable;

// Operations of ParameterCell::may_reach() for one of several consecutive steps: two sums along each axis, the step's
// error, and four comparisons.
constexpr std::uint64_t kStepOperations = 10;

}  // namespace

SamplingController::SamplingController() : registers_(std::make_unique<SampleRegisters>()) {
  footprints_.reserve(kArraySamples);
}

int SamplingController::sub_pixels(int samples_per_pixel) {
  int side = 1;
  while (side * side < samples_per_pixel) ++side;
  return side;
}

// All pixels have the same offsets, so the first pixel's give the slots.
void SamplingController::find_slots(const TileSamples& samples) {
  side_ = sub_pixels(samples.spp);
  const auto slots = static_cast<std::size_t>(side_ * side_), spp = static_cast<std::size_t>(samples.spp);
  std::vector<std::uint32_t> slot_of(spp);
  slot_first_.assign(slots + 1, 0);
  slot_sample_.resize(spp);
  for (std::size_t k = 0; k < spp; ++k) {
    const auto place = [&](float at, int origin) {
      return std::clamp(static_cast<int>((at - static_cast<float>(origin)) * static_cast<float>(side_)), 0, side_ - 1);
    };
    slot_of[k] = static_cast<std::uint32_t>(place(samples.y[k], samples.pixels.y0) * side_ +
                                            place(samples.x[k], samples.pixels.x0));
    ++slot_first_[slot_of[k] + 1];
  }
  for (std::size_t s = 1; s <= slots; ++s) slot_first_[s] += slot_first_[s - 1];
  std::vector<std::uint32_t> next(slot_first_.begin(), slot_first_.end() - 1);
  for (std::size_t k = 0; k < spp; ++k) slot_sample_[next[slot_of[k]]++] = static_cast<std::uint32_t>(k);
}

bool SamplingController::take(const ParameterMaps& maps, std::uint32_t cell, TimeRange times) {
  waiting_.push_back({cell, times});
  waiting_samples_ += maps.cells()[cell].steps.count();
  return waiting_samples_ >= kArraySamples;
}

// The array takes cells of a piece together, so that few of its lanes are idle.
void SamplingController::draw(const Job& job) {
  const std::vector<ParameterCell>& cells = job.maps.cells();
  const auto piece_of = [&](const Waiting& w) { return std::tie(cells[w.cell].drawable, cells[w.cell].piece); };
  std::stable_sort(waiting_.begin(), waiting_.end(),
                   [&](const Waiting& a, const Waiting& b) { return piece_of(a) < piece_of(b); });
  const std::span<const Waiting> all(waiting_);
  for (std::size_t first = 0, end = 0; first < all.size(); first = end) {
    for (; end < all.size() && piece_of(all[end]) == piece_of(all[first]); ++end)
      reads_.push_back({all[end].cell, end == first});
    draw_piece(job, all.subspan(first, end - first));
  }
  waiting_.clear();
  waiting_samples_ = 0;
}

void SamplingController::merge_layers(const scene::FrameGeometry& frame, TileState& state) {
  if (state.layers.empty()) return;
  state.drop_hidden_layers();
  counters_.layers_merged += merge_procedure_layers(frame, state.layers);
}

void SamplingController::begin_piece(const Job& job, const ParameterCell& first) {
  drawable_ = first.drawable;
  piece_ = first.piece;
  const PosedDrawable& drawable = job.frame.drawables[drawable_];
  program_ = {};
  program_.shape = drawable.procedure->shape;
  program_.input = &drawable.procedure->pieces[piece_].input;
  if (drawable.deforming) program_.close = &drawable.procedure_close->pieces[piece_].input;
  program_.to_raster = drawable.to_raster;
  program_.keys = drawable.moving ? 2 : 1;
  program_.orthographic = job.frame.projection.orthographic;
  program_.divided = !drawable.moving && !job.lens();
}

std::uint64_t SamplingController::add_steps(const Job& job, const Waiting& waiting) {
  const ParameterCell& cell = job.maps.cells()[waiting.cell];
  const IntRect& pixels = job.samples.pixels;
  // A cell that reaches the tile by its lines alone has no surface in it.
  if (!cell.touches(pixels)) return 0;
  const float step_u = (cell.u1 - cell.u0) / static_cast<float>(cell.steps.u),
              step_v = (cell.v1 - cell.v0) / static_cast<float>(cell.steps.v);
  const bool image = cell.image.known();
  std::uint64_t issued = 0;
  for (int j = 0; j < cell.steps.v; ++j)
    for (int i = 0; i < cell.steps.u; ++i) {
      if (image && !cell.may_reach(i, j, pixels)) continue;
      footprints_.push_back({&cell, waiting.times, cell.u0 + (static_cast<float>(i) + 0.5f) * step_u,
                             cell.v0 + (static_cast<float>(j) + 0.5f) * step_v, 0.5f * step_u, 0.5f * step_v});
      ++issued;
      if (footprints_.size() == kArraySamples) run_batch(job);
    }
  if (image) counters_.operations += kStepOperations * cell.steps.count();
  return issued;
}

void SamplingController::draw_piece(const Job& job, std::span<const Waiting> cells) {
  begin_piece(job, job.maps.cells()[cells.front().cell]);
  std::uint64_t issued = 0;
  footprints_.clear();
  for (const Waiting& waiting : cells) issued += add_steps(job, waiting);
  run_batch(job);
  counters_.samples += issued;
  if (!drawables_.empty()) drawables_[drawable_].procedure_samples += issued;
  count_issued(job, issued);  // the array takes samples of one piece together, whatever their cells
  if (job.maps.settings().style == ProcedureSettings::Style::kLines) draw_lines(job, cells);
}

void SamplingController::count_issued(const Job& job, std::uint64_t issued) {
  const std::uint64_t slots = round_up(issued, kArrayLanes);
  counters_.array_slots += slots;
  counters_.operations += slots * job.maps.operations(drawable_, piece_);
}

void SamplingController::run_batch(const Job& job) {
  if (footprints_.empty()) return;
  for (std::size_t k = 0; k < footprints_.size(); ++k) {
    registers_->u[k] = footprints_[k].u;
    registers_->v[k] = footprints_[k].v;
  }
  run_procedure(program_, footprints_.size(), *registers_);
  const bool points = job.maps.settings().mode == ProcedureSettings::Mode::kPublished;
  for (std::size_t k = 0; k < footprints_.size(); ++k) {
    if (!program_.divided)
      scatter_moving(job, k);
    else if (points)
      scatter_points(job, k);
    else
      scatter_still(job, k);
  }
  footprints_.clear();
}

}  // namespace tessera::tilecore

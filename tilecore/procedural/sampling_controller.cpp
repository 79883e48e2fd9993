#include "tilecore/procedural/sampling_controller.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "base/round_up.h"
#include "frontend/front_end.h"
#include "scene/procedure_patch.h"
#include "tilecore/procedural/footprint.h"
#include "tilecore/shading/surface.h"

namespace tessera::tilecore {
namespace {

using scene::FrameGeometry;
using scene::PosedDrawable;

constexpr std::uint64_t kImagePointBytes = 12;  // three floats

}  // namespace

SamplingController::SamplingController() : registers_(std::make_unique<SampleRegisters>()) {
  footprints_.reserve(kArraySamples);
}

int SamplingController::sub_pixels(int samples_per_pixel) {
  int side = 1;
  while (side * side < samples_per_pixel) ++side;
  return side;
}

// All pixels have the same offsets: the first one's tell the slots.
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

// Cells are listed piece by piece; groups go near to far, so that the hidden ones may be skipped. Cells that reach the
// tile by their lines alone have no surface in it.
void SamplingController::group_cells(std::span<const std::uint32_t> cells, const ParameterMaps& maps,
                                     const IntRect& pixels) {
  order_.assign(cells.begin(), cells.end());
  if (maps.settings().style == ProcedureSettings::Style::kLines)
    std::erase_if(order_, [&](std::uint32_t c) {
      const ParameterCell& cell = maps.cells()[c];
      return cell.x1 < static_cast<float>(pixels.x0) || cell.y1 < static_cast<float>(pixels.y0) ||
             cell.x0 > static_cast<float>(pixels.x1) || cell.y0 > static_cast<float>(pixels.y1);
    });
  groups_.clear();
  for (std::uint32_t k = 0; k < order_.size(); ++k) {
    const ParameterCell& cell = maps.cells()[order_[k]];
    const bool same = k > 0 && maps.cells()[order_[k - 1]].drawable == cell.drawable &&
                      maps.cells()[order_[k - 1]].piece == cell.piece;
    if (!same) groups_.push_back({k, 0, cell.near_z});
    ++groups_.back().count;
    groups_.back().near_z = std::min(groups_.back().near_z, cell.near_z);
  }
  std::sort(groups_.begin(), groups_.end(),
            [](const Group& a, const Group& b) { return std::tie(a.near_z, a.first) < std::tie(b.near_z, b.first); });
}

void SamplingController::render(const FrameGeometry& frame, const ParameterMaps& maps, binner::TileIndex tile,
                                const TileSamples& samples, std::uint64_t burst_bytes, TileState& state) {
  const std::span<const std::uint32_t> cells = maps.of_tile(tile);
  if (cells.empty()) return;
  find_slots(samples);
  group_cells(cells, maps, samples.pixels);
  const auto read = [&](memory::Purpose purpose, std::uint64_t bytes) {
    ledger_.read(memory::Unit::kSampling, purpose, memory::burst_bytes(0, bytes, burst_bytes));
  };
  read(memory::Purpose::kSamplingMaps, cells.size() * (ParameterMaps::kEntryBytes + ParameterMaps::kCellBytes));
  const Job job{frame, maps, samples, state};
  for (const Group& group : groups_) {
    if (group.near_z > state.farthest()) {
      counters_.cells_culled_occlusion += group.count;
      continue;
    }
    const std::uint32_t drawable = maps.cells()[order_[group.first]].drawable;
    const scene::Procedure& procedure = *frame.drawables[drawable].procedure;
    const std::uint64_t image_bytes = procedure.image ? kImagePointBytes * procedure.image->x.size() : 0;
    read(memory::Purpose::kPatchData,
         frontend::patch_record_bytes(frame, frame.drawables[drawable].drawable->first_patch) - image_bytes);
    if (procedure.image)
      ledger_.read(memory::Unit::kSampling, memory::Purpose::kPatchData,
                   std::min(image_bytes_of(group, maps, *procedure.image, burst_bytes),
                            memory::burst_bytes(0, image_bytes, burst_bytes)));
    run_group(job, group);
  }
  if (maps.settings().refill) refill_holes(job);
  if (maps.settings().style == ProcedureSettings::Style::kLines) draw_lines(job, cells);
}

// What a group's cells read of a geometry image: its points row by row, once for each cell.
std::uint64_t SamplingController::image_bytes_of(const Group& group, const ParameterMaps& maps,
                                                 const shaders::GeometryImage& image, std::uint64_t burst_bytes) const {
  std::uint64_t sum = 0;
  for (std::uint32_t k = group.first; k < group.first + group.count; ++k) {
    const ParameterCell& cell = maps.cells()[order_[k]];
    const auto point = [](float at, int size) {
      return static_cast<std::uint64_t>(std::clamp(static_cast<int>(at * static_cast<float>(size - 1)), 0, size - 1));
    };
    const std::uint64_t width = static_cast<std::uint64_t>(image.width), first = point(cell.u0, image.width),
                        last = std::min(point(cell.u1, image.width) + 1, width - 1);
    const std::uint64_t last_row =
        std::min(point(cell.v1, image.height) + 1, static_cast<std::uint64_t>(image.height) - 1);
    for (std::uint64_t row = point(cell.v0, image.height); row <= last_row; ++row)
      sum += memory::burst_bytes(kImagePointBytes * (row * width + first), kImagePointBytes * (last - first + 1),
                                 burst_bytes);
  }
  return sum;
}

void SamplingController::begin_piece(const Job& job, const ParameterCell& first) {
  drawable_ = first.drawable;
  piece_ = first.piece;
  const PosedDrawable& drawable = job.frame.drawables[drawable_];
  program_ = {};
  program_.shape = drawable.procedure->shape;
  program_.input = &drawable.procedure->pieces[piece_].input;
  program_.to_raster = drawable.to_raster;
  program_.keys = drawable.moving ? 2 : 1;
  program_.orthographic = job.frame.projection.orthographic;
  program_.divided = !drawable.moving && !job.lens();
}

void SamplingController::run_group(const Job& job, const Group& group) {
  begin_piece(job, job.maps.cells()[order_[group.first]]);
  std::uint64_t issued = 0;
  footprints_.clear();
  const float limit = job.state.farthest();
  for (std::uint32_t k = group.first; k < group.first + group.count; ++k) {
    const ParameterCell& cell = job.maps.cells()[order_[k]];
    if (cell.near_z > limit) {
      ++counters_.cells_culled_occlusion;
      continue;
    }
    const float step_u = (cell.u1 - cell.u0) / static_cast<float>(cell.steps_u),
                step_v = (cell.v1 - cell.v0) / static_cast<float>(cell.steps_v);
    for (int j = 0; j < cell.steps_v; ++j)
      for (int i = 0; i < cell.steps_u; ++i) {
        footprints_.push_back({&cell, cell.u0 + (static_cast<float>(i) + 0.5f) * step_u,
                               cell.v0 + (static_cast<float>(j) + 0.5f) * step_v, 0.5f * step_u, 0.5f * step_v});
        ++issued;
        if (footprints_.size() == kArraySamples) run_batch(job);
      }
  }
  run_batch(job);
  counters_.samples += issued;
  if (!drawables_.empty()) drawables_[drawable_].procedure_samples += issued;
  count_issued(job, issued);  // the array takes samples of one piece together, whatever their cells
}

void SamplingController::count_issued(const Job& job, std::uint64_t issued) {
  const std::uint64_t slots = round_up(issued, static_cast<std::uint64_t>(job.maps.settings().lanes));
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
  const bool points = job.maps.settings().scatter == ProcedureSettings::Scatter::kPoint;
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

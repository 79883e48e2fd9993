#include "tilecore/sampling_controller.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "frontend/front_end.h"
#include "frontend/procedure_patch.h"
#include "tilecore/footprint.h"
#include "tilecore/surface.h"

namespace tessera::tilecore {
namespace {

using frontend::FrameGeometry;
using frontend::PosedDrawable;

constexpr std::uint64_t kImagePointBytes = 12;  // three floats

float farthest(const TileState& state) {
  if (state.unseen > 0) return std::numeric_limits<float>::infinity();
  return *std::max_element(state.z.begin(), state.z.end());
}

// Raster-space point and tangents at one time, homogeneous; in perspective z divides.
struct MovingPoint {
  float x, y, z, xu, yu, zu, xv, yv, zv;
};

}  // namespace

SamplingController::SamplingController() : registers_(std::make_unique<SampleRegisters>()) { footprints_.reserve(kArraySamples); }

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
    const auto place = [&](float at, int origin) { return std::clamp(static_cast<int>((at - static_cast<float>(origin)) * static_cast<float>(side_)), 0, side_ - 1); };
    slot_of[k] = static_cast<std::uint32_t>(place(samples.y[k], samples.pixels.y0) * side_ + place(samples.x[k], samples.pixels.x0));
    ++slot_first_[slot_of[k] + 1];
  }
  for (std::size_t s = 1; s <= slots; ++s) slot_first_[s] += slot_first_[s - 1];
  std::vector<std::uint32_t> next(slot_first_.begin(), slot_first_.end() - 1);
  for (std::size_t k = 0; k < spp; ++k) slot_sample_[next[slot_of[k]]++] = static_cast<std::uint32_t>(k);
}

// Cells are listed piece by piece; groups go near to far, so that the hidden ones may be skipped. Cells that reach the tile by their strokes
// alone have no surface in it.
void SamplingController::group_cells(std::span<const std::uint32_t> cells, const ParameterMaps& maps, const IntRect& pixels) {
  order_.assign(cells.begin(), cells.end());
  if (maps.settings().style == ProcedureSettings::Style::kLines)
    std::erase_if(order_, [&](std::uint32_t c) {
      const ParameterCell& cell = maps.cells()[c];
      return cell.x1 < static_cast<float>(pixels.x0) || cell.y1 < static_cast<float>(pixels.y0) || cell.x0 > static_cast<float>(pixels.x1) || cell.y0 > static_cast<float>(pixels.y1);
    });
  groups_.clear();
  for (std::uint32_t k = 0; k < order_.size(); ++k) {
    const ParameterCell& cell = maps.cells()[order_[k]];
    const bool same = k > 0 && maps.cells()[order_[k - 1]].drawable == cell.drawable && maps.cells()[order_[k - 1]].piece == cell.piece;
    if (!same) groups_.push_back({k, 0, cell.near_z});
    ++groups_.back().count;
    groups_.back().near_z = std::min(groups_.back().near_z, cell.near_z);
  }
  std::sort(groups_.begin(), groups_.end(), [](const Group& a, const Group& b) { return std::tie(a.near_z, a.first) < std::tie(b.near_z, b.first); });
}

void SamplingController::render(const FrameGeometry& frame, const ParameterMaps& maps, binner::TileIndex tile, const TileSamples& samples, std::uint64_t burst_bytes, TileState& state) {
  const std::span<const std::uint32_t> cells = maps.of_tile(tile);
  if (cells.empty()) return;
  find_slots(samples);
  group_cells(cells, maps, samples.pixels);
  const auto read = [&](hardware::Purpose purpose, std::uint64_t bytes) { ledger_.read(hardware::Unit::kSampling, purpose, hardware::burst_bytes(0, bytes, burst_bytes)); };
  read(hardware::Purpose::kSamplingMaps, cells.size() * (ParameterMaps::kEntryBytes + ParameterMaps::kCellBytes));
  const Job job{frame, maps, samples, state};
  for (const Group& group : groups_) {
    if (group.near_z > farthest(state)) {
      counters_.cells_culled_occlusion += group.count;
      continue;
    }
    const std::uint32_t drawable = maps.cells()[order_[group.first]].drawable;
    const frontend::Procedure& procedure = *frame.drawables[drawable].procedure;
    const std::uint64_t image_bytes = procedure.image ? kImagePointBytes * procedure.image->x.size() : 0;
    read(hardware::Purpose::kPatchData, frontend::patch_record_bytes(frame, frame.drawables[drawable].drawable->first_patch) - image_bytes);
    if (procedure.image) ledger_.read(hardware::Unit::kSampling, hardware::Purpose::kPatchData, std::min(image_bytes_of(group, maps, *procedure.image, burst_bytes), hardware::burst_bytes(0, image_bytes, burst_bytes)));
    run_group(job, group);
  }
  if (maps.settings().refill) refill_holes(job);
  if (maps.settings().style == ProcedureSettings::Style::kLines) draw_lines(job, cells);
}

// What a group's cells read of a geometry image: its points row by row, once for each cell.
std::uint64_t SamplingController::image_bytes_of(const Group& group, const ParameterMaps& maps, const shaders::GeometryImage& image, std::uint64_t burst_bytes) const {
  std::uint64_t sum = 0;
  for (std::uint32_t k = group.first; k < group.first + group.count; ++k) {
    const ParameterCell& cell = maps.cells()[order_[k]];
    const auto point = [](float at, int size) { return static_cast<std::uint64_t>(std::clamp(static_cast<int>(at * static_cast<float>(size - 1)), 0, size - 1)); };
    const std::uint64_t width = static_cast<std::uint64_t>(image.width), first = point(cell.u0, image.width), last = std::min(point(cell.u1, image.width) + 1, width - 1);
    const std::uint64_t last_row = std::min(point(cell.v1, image.height) + 1, static_cast<std::uint64_t>(image.height) - 1);
    for (std::uint64_t row = point(cell.v0, image.height); row <= last_row; ++row)
      sum += hardware::burst_bytes(kImagePointBytes * (row * width + first), kImagePointBytes * (last - first + 1), burst_bytes);
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
  program_.divided = !drawable.moving && job.samples.lens_u.empty();
}

void SamplingController::run_group(const Job& job, const Group& group) {
  begin_piece(job, job.maps.cells()[order_[group.first]]);
  std::uint64_t issued = 0;
  footprints_.clear();
  const float limit = farthest(job.state);
  for (std::uint32_t k = group.first; k < group.first + group.count; ++k) {
    const ParameterCell& cell = job.maps.cells()[order_[k]];
    if (cell.near_z > limit) {
      ++counters_.cells_culled_occlusion;
      continue;
    }
    const float step_u = (cell.u1 - cell.u0) / static_cast<float>(cell.steps_u), step_v = (cell.v1 - cell.v0) / static_cast<float>(cell.steps_v);
    for (int j = 0; j < cell.steps_v; ++j)
      for (int i = 0; i < cell.steps_u; ++i) {
        footprints_.push_back({&cell, cell.u0 + (static_cast<float>(i) + 0.5f) * step_u, cell.v0 + (static_cast<float>(j) + 0.5f) * step_v, 0.5f * step_u, 0.5f * step_v});
        ++issued;
        if (footprints_.size() == kArraySamples) run_batch(job);
      }
  }
  run_batch(job);
  // The array takes samples of one piece together, whatever their cells.
  const auto lanes = static_cast<std::uint64_t>(job.maps.settings().lanes);
  counters_.samples += issued;
  const std::uint64_t slots = (issued + lanes - 1) / lanes * lanes;
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
    if (!program_.divided) scatter_moving(job, k);
    else if (points) scatter_points(job, k);
    else scatter_still(job, k);
  }
  footprints_.clear();
}

// Depth test with the tie rule: equal depths go to the lower base patch, then to the lower parameters.
void SamplingController::write(const Job& job, const ParameterCell& cell, std::size_t s, float z, float u, float v, std::uint32_t triangle) {
  TileState& state = job.state;
  if (z > state.z[s]) return;
  const frontend::PatchPoint at = frontend::patch_of_piece_point(job.frame.drawables[drawable_], cell.piece, std::clamp(u, cell.u0, cell.u1), std::clamp(v, cell.v0, cell.v1));
  if (z == state.z[s] && std::tie(at.patch, triangle, at.u, at.v) >= std::tie(state.patch[s], state.triangle[s], state.b1[s], state.b2[s])) return;
  if (state.patch[s] == TileState::kNoPatch) --state.unseen;
  state.z[s] = z;
  state.patch[s] = at.patch;
  state.triangle[s] = triangle;
  state.b1[s] = at.u;
  state.b2[s] = at.v;
  ++counters_.writes;
}

// Where the surface is at shutter open, for what is not at rest.
void SamplingController::keep_rest(const Job& job, std::size_t k, std::size_t s) {
  const auto& open = registers_->at[0];
  const float w = program_.orthographic ? 1.0f : open[SampleRegisters::kZ][k];
  job.state.rest_x[s] = open[SampleRegisters::kX][k] / w;
  job.state.rest_y[s] = open[SampleRegisters::kY][k] / w;
}

// ---- Still surfaces through a pinhole ---------------------------------------------------------------------------

void SamplingController::scatter_still(const Job& job, std::size_t k) {
  using R = SampleRegisters;
  const auto& at = registers_->at[0];
  const Footprint& f = footprints_[k];
  const float z = at[R::kZ][k];
  const frontend::Projection& projection = job.frame.projection;
  if (z < static_cast<float>(projection.near) || (projection.far > 0 && z > static_cast<float>(projection.far))) return void(++counters_.samples_behind);
  Parallelogram p{at[R::kX][k], at[R::kY][k], at[R::kXu][k] * f.half_u, at[R::kYu][k] * f.half_u, at[R::kXv][k] * f.half_v, at[R::kYv][k] * f.half_v, 0, f.slack()};
  p.det = p.ax * p.by - p.ay * p.bx;
  if (!std::isfinite(p.x + p.y + z + p.ax + p.ay + p.bx + p.by)) return void(++counters_.samples_not_finite);
  const PosedDrawable& drawable = job.frame.drawables[drawable_];
  // Fronts have negative area where y points down.
  if (!drawable.material->double_sided && (drawable.mirrored ? p.det < 0 : p.det > 0)) return void(++counters_.samples_backfacing);

  // Sub-pixels that the footprint's box touches, inside the tile.
  const IntRect& pixels = job.samples.pixels;
  const auto side = static_cast<float>(side_);
  const float reach_x = std::abs(p.ax) + std::abs(p.bx) + p.slack, reach_y = std::abs(p.ay) + std::abs(p.by) + p.slack;
  const float left = (p.x - static_cast<float>(pixels.x0)) * side, top = (p.y - static_cast<float>(pixels.y0)) * side;
  const int columns = pixels.width() * side_, rows = pixels.height() * side_;
  const float x0 = std::max(left - reach_x * side, 0.0f), x1 = std::min(left + reach_x * side, static_cast<float>(columns)), y0 = std::max(top - reach_y * side, 0.0f), y1 = std::min(top + reach_y * side, static_cast<float>(rows));
  if (!(x0 <= x1 && y0 <= y1)) return void(++counters_.samples_outside_tile);
  const bool bounded = job.maps.settings().maps == ProcedureSettings::Maps::kInterval;
  const float z_u = at[R::kZu][k] * f.half_u, z_v = at[R::kZv][k] * f.half_v;
  for (int row = static_cast<int>(y0); row < std::min(static_cast<int>(y1) + 1, rows); ++row)
    for (int column = static_cast<int>(x0); column < std::min(static_cast<int>(x1) + 1, columns); ++column) {
      const auto slot = static_cast<std::size_t>(row % side_ * side_ + column % side_);
      const std::size_t pixel = static_cast<std::size_t>(row / side_ * pixels.width() + column / side_) * static_cast<std::size_t>(job.samples.spp);
      for (std::uint32_t n = slot_first_[slot]; n < slot_first_[slot + 1]; ++n) {
        const std::size_t s = pixel + slot_sample_[n];
        const float px = job.samples.x[s], py = job.samples.y[s];
        ++counters_.footprint_tests;
        float along_u, along_v;
        if (!p.holds(px, py, along_u, along_v)) continue;
        // What the bounds exclude is left to the cell that has it, so that no tile sees more than another would.
        if (bounded && (px < f.cell->x0 || px > f.cell->x1 || py < f.cell->y0 || py > f.cell->y1)) continue;
        write(job, *f.cell, s, z + (z_u * along_u + z_v * along_v), f.u + f.half_u * along_u, f.v + f.half_v * along_v, SurfaceLocation::kWholePatch);
      }
    }
}

// As published: the sub-pixel that the sample falls into takes it.
void SamplingController::scatter_points(const Job& job, std::size_t k) {
  using R = SampleRegisters;
  const auto& at = registers_->at[0];
  const Footprint& f = footprints_[k];
  const float x = at[R::kX][k], y = at[R::kY][k], z = at[R::kZ][k];
  const frontend::Projection& projection = job.frame.projection;
  if (z < static_cast<float>(projection.near) || (projection.far > 0 && z > static_cast<float>(projection.far))) return void(++counters_.samples_behind);
  if (!std::isfinite(x + y + z)) return void(++counters_.samples_not_finite);
  const PosedDrawable& drawable = job.frame.drawables[drawable_];
  const float det = at[R::kXu][k] * at[R::kYv][k] - at[R::kYu][k] * at[R::kXv][k];
  if (!drawable.material->double_sided && (drawable.mirrored ? det < 0 : det > 0)) return void(++counters_.samples_backfacing);
  const IntRect& pixels = job.samples.pixels;
  const auto side = static_cast<float>(side_);
  const float left = (x - static_cast<float>(pixels.x0)) * side, top = (y - static_cast<float>(pixels.y0)) * side;
  if (!(left >= 0 && top >= 0 && left < static_cast<float>(pixels.width() * side_) && top < static_cast<float>(pixels.height() * side_)))
    return void(++counters_.samples_outside_tile);
  const int column = static_cast<int>(left), row = static_cast<int>(top);
  const auto slot = static_cast<std::size_t>(row % side_ * side_ + column % side_);
  const std::size_t pixel = static_cast<std::size_t>(row / side_ * pixels.width() + column / side_) * static_cast<std::size_t>(job.samples.spp);
  for (std::uint32_t n = slot_first_[slot]; n < slot_first_[slot + 1]; ++n) write(job, *f.cell, pixel + slot_sample_[n], z, f.u, f.v, SurfaceLocation::kWholePatch);
}

// ---- Surfaces that move or are out of focus ---------------------------------------------------------------------

// The footprint sweeps an area while the shutter is open; each sample point inside is tested at its own time and through its own
// point of the lens.
void SamplingController::scatter_moving(const Job& job, std::size_t k) {
  using R = SampleRegisters;
  const Footprint& f = footprints_[k];
  const frontend::Projection& projection = job.frame.projection;
  const float near = static_cast<float>(projection.near), far = projection.far > 0 ? static_cast<float>(projection.far) : std::numeric_limits<float>::infinity();
  const auto key_point = [&](std::size_t key) {
    const auto& at = registers_->at[key];
    return MovingPoint{at[R::kX][k], at[R::kY][k], at[R::kZ][k], at[R::kXu][k] * f.half_u, at[R::kYu][k] * f.half_u, at[R::kZu][k] * f.half_u,
                       at[R::kXv][k] * f.half_v, at[R::kYv][k] * f.half_v, at[R::kZv][k] * f.half_v};
  };
  const MovingPoint open = key_point(0), close = program_.keys == 2 ? key_point(1) : open;
  if ((open.z < near && close.z < near) || (open.z > far && close.z > far)) return void(++counters_.samples_behind);
  const auto finite = [](const MovingPoint& p) { return std::isfinite(p.x + p.y + p.z + p.xu + p.yu + p.zu + p.xv + p.yv + p.zv); };
  if (!finite(open) || !finite(close)) return void(++counters_.samples_not_finite);
  const bool lens = !job.samples.lens_u.empty();
  const auto focus = static_cast<float>(projection.inverse_focus);
  const bool orthographic = projection.orthographic;
  // Footprint at time t through a lens point; false in front of the near plane.
  const auto footprint = [&](float t, float lens_u, float lens_v, Parallelogram& p, float& z, float& z_u, float& z_v) {
    const auto mix = [&](float a, float b) { return a * (1.0f - t) + b * t; };
    z = mix(open.z, close.z);
    if (!(z >= near && z <= far)) return false;
    z_u = mix(open.zu, close.zu), z_v = mix(open.zv, close.zv);
    const float inverse = orthographic ? 1.0f : 1.0f / z, turn = orthographic ? 0.0f : 1.0f;
    p.x = mix(open.x, close.x) * inverse, p.y = mix(open.y, close.y) * inverse;
    p.ax = (mix(open.xu, close.xu) - turn * p.x * z_u) * inverse, p.ay = (mix(open.yu, close.yu) - turn * p.y * z_u) * inverse;
    p.bx = (mix(open.xv, close.xv) - turn * p.x * z_v) * inverse, p.by = (mix(open.yv, close.yv) - turn * p.y * z_v) * inverse;
    if (lens) {
      const float coc = orthographic ? 1.0f - z * focus : inverse - focus, slope = orthographic ? -focus : -inverse * inverse;
      p.x += lens_u * coc, p.y += lens_v * coc;
      p.ax += lens_u * slope * z_u, p.ay += lens_v * slope * z_u;
      p.bx += lens_u * slope * z_v, p.by += lens_v * slope * z_v;
    }
    p.det = p.ax * p.by - p.ay * p.bx;
    p.slack = f.slack();
    return true;
  };
  // Box over the visible part of the shutter and the lens: positions at its two ends hold all between.
  float t0 = 0, t1 = 1;
  if (open.z < near) t0 = std::min((near - open.z) / (close.z - open.z) * 1.0001f, 1.0f);
  if (close.z < near) t1 = std::max((open.z - near) / (open.z - close.z) * 0.9999f, 0.0f);
  float x0 = f.cell->x1, x1 = f.cell->x0, y0 = f.cell->y1, y1 = f.cell->y0;
  for (const float t : {t0, t1}) {
    Parallelogram p;
    float z, z_u, z_v;
    if (!footprint(t, 0, 0, p, z, z_u, z_v)) {
      x0 = f.cell->x0, x1 = f.cell->x1, y0 = f.cell->y0, y1 = f.cell->y1;  // at the near plane itself: the cell's bounds serve
      break;
    }
    const float coc = lens ? job.samples.lens_scale * std::abs(orthographic ? 1.0f - z * focus : 1.0f / z - focus) : 0.0f;
    const float spread = lens ? job.samples.lens_scale * (std::abs(z_u) + std::abs(z_v)) * (orthographic ? std::abs(focus) : 1.0f / (z * z)) : 0.0f;
    const float rx = std::abs(p.ax) + std::abs(p.bx) + coc + spread + 2 * p.slack, ry = std::abs(p.ay) + std::abs(p.by) + coc + spread + 2 * p.slack;
    x0 = std::min(x0, p.x - rx), x1 = std::max(x1, p.x + rx), y0 = std::min(y0, p.y - ry), y1 = std::max(y1, p.y + ry);
  }
  const bool bounded = job.maps.settings().maps == ProcedureSettings::Maps::kInterval;
  if (bounded) x0 = std::max(x0, f.cell->x0), x1 = std::min(x1, f.cell->x1), y0 = std::max(y0, f.cell->y0), y1 = std::min(y1, f.cell->y1);
  const IntRect& pixels = job.samples.pixels;
  const auto clip = [](float a, int low, int high) { return std::min(std::max(a, static_cast<float>(low)), static_cast<float>(high)); };
  const IntRect box{static_cast<int>(std::floor(clip(x0, pixels.x0, pixels.x1))), static_cast<int>(std::floor(clip(y0, pixels.y0, pixels.y1))),
                    std::min(static_cast<int>(std::floor(clip(x1, pixels.x0 - 1, pixels.x1))) + 1, pixels.x1), std::min(static_cast<int>(std::floor(clip(y1, pixels.y0 - 1, pixels.y1))) + 1, pixels.y1)};
  if (box.empty() || !(x0 <= x1 && y0 <= y1)) return void(++counters_.samples_outside_tile);
  const PosedDrawable& drawable = job.frame.drawables[drawable_];
  const auto spp = static_cast<std::size_t>(job.samples.spp);
  for (int row = box.y0; row < box.y1; ++row) {
    const std::size_t first = static_cast<std::size_t>((row - pixels.y0) * pixels.width() + (box.x0 - pixels.x0)) * spp, count = static_cast<std::size_t>(box.width()) * spp;
    for (std::size_t s = first; s < first + count; ++s) {
      const float px = job.samples.x[s], py = job.samples.y[s];
      if (px < x0 || px > x1 || py < y0 || py > y1) continue;
      ++counters_.footprint_tests;
      Parallelogram p;
      float z, z_u, z_v, along_u, along_v;
      if (!footprint(job.samples.t(s), lens ? job.samples.lens_u[s] : 0.0f, lens ? job.samples.lens_v[s] : 0.0f, p, z, z_u, z_v)) continue;
      if (!drawable.material->double_sided && (drawable.mirrored ? p.det < 0 : p.det > 0)) continue;
      if (!p.holds(px, py, along_u, along_v)) continue;
      const std::uint64_t before = counters_.writes;
      write(job, *f.cell, s, z + (z_u * along_u + z_v * along_v), f.u + f.half_u * along_u, f.v + f.half_v * along_v, SurfaceLocation::kWholePatch);
      if (counters_.writes != before) keep_rest(job, k, s);
    }
  }
}

}  // namespace tessera::tilecore

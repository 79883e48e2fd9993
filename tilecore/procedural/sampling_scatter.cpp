// Scatters the samples of a batch into the tile buffer.
#include <algorithm>
#include <cmath>
#include <tuple>

#include "scene/procedure_patch.h"
#include "tilecore/procedural/footprint.h"
#include "tilecore/procedural/procedure_layers.h"
#include "tilecore/procedural/procedure_surface.h"
#include "tilecore/procedural/sampling_controller.h"
#include "tilecore/shading/surface.h"

namespace tessera::tilecore {

using scene::PosedDrawable;

// Front faces have negative area where y points down.
bool SamplingController::faces_away(const PosedDrawable& drawable, float det) {
  return !drawable.material->double_sided && (drawable.mirrored ? det < 0 : det > 0);
}

// Depth test with the tie rule: equal depths go to the lower base patch, then to the lower parameters.
void SamplingController::write(const Job& job, const ParameterCell& cell, std::size_t s, float z, float u, float v,
                               std::uint32_t triangle) {
  TileState& state = job.state;
  if (z > state.z[s]) return;
  const scene::PatchPoint at = scene::patch_of_piece_point(
      job.frame.drawables[drawable_], cell.piece, std::clamp(u, cell.u0, cell.u1), std::clamp(v, cell.v0, cell.v1));
  if (z == state.z[s] && !is_layer_code(triangle) &&
      std::tie(at.patch, triangle, at.u, at.v) >= std::tie(state.patch[s], state.triangle[s], state.b1[s], state.b2[s]))
    return;
  if (triangle == SurfaceLocation::kWholePatch && !passes_alpha(job, at, s)) return;
  if (is_layer_code(triangle)) {
    state.add_layer({static_cast<std::uint32_t>(s), at.patch, triangle, z, at.u, at.v, 0.0f, 0.0f});
    ++counters_.writes;
    return;
  }
  state.take_depth(s, z);
  state.patch[s] = at.patch;
  state.triangle[s] = triangle;
  state.b1[s] = at.u;
  state.b2[s] = at.v;
  ++counters_.writes;
}

std::uint32_t SamplingController::surface_name(const Job& job, const Footprint& f, float det) const {
  const PosedDrawable& drawable = job.frame.drawables[drawable_];
  if (drawable.material->alpha_mode != scene::AlphaMode::kBlend ||
      job.maps.settings().style == ProcedureSettings::Style::kLines)
    return SurfaceLocation::kWholePatch;
  return layer_code(drawable.mirrored ? det < 0 : det > 0, f.half_u, f.half_v);
}

// Drawings have no alpha.
bool SamplingController::passes_alpha(const Job& job, const scene::PatchPoint& at, std::size_t s) const {
  const scene::Material& material = *job.frame.drawables[drawable_].material;
  if (material.alpha_mode != scene::AlphaMode::kMask || job.maps.settings().style == ProcedureSettings::Style::kLines)
    return true;
  if (job.alpha_tests != nullptr) ++*job.alpha_tests;
  const SurfaceLocation location{at.patch, SurfaceLocation::kWholePatch, at.u, at.v,
                                 time_seen(job.frame, at.patch, job.samples.t(s))};
  return procedure_alpha(job.frame, location, job.textures) >= material.alpha_cutoff;
}

// Keeps the surface's place at shutter open if it moves or is seen through a lens.
void SamplingController::keep_rest(const Job& job, std::size_t k, std::size_t s) {
  using R = SampleRegisters;
  const auto& open = registers_->at[0];
  const float w = program_.orthographic ? 1.0f : open[R::kZ][k], x = open[R::kX][k] / w, y = open[R::kY][k] / w;
  const bool layer = job.frame.drawables[drawable_].material->alpha_mode == scene::AlphaMode::kBlend &&
                     job.maps.settings().style != ProcedureSettings::Style::kLines;
  (layer ? job.state.layers.back().rest_x : job.state.rest_x[s]) = x;
  (layer ? job.state.layers.back().rest_y : job.state.rest_y[s]) = y;
}

// ---- Still surfaces through a pinhole ---------------------------------------------------------------------------

void SamplingController::scatter_still(const Job& job, std::size_t k) {
  using R = SampleRegisters;
  const auto& at = registers_->at[0];
  const Footprint& f = footprints_[k];
  const float z = at[R::kZ][k];
  const scene::Projection& projection = job.frame.projection;
  if (z < static_cast<float>(projection.near) || (projection.far > 0 && z > static_cast<float>(projection.far)))
    return void(++counters_.samples_behind);
  Parallelogram p{at[R::kX][k],
                  at[R::kY][k],
                  at[R::kXu][k] * f.half_u,
                  at[R::kYu][k] * f.half_u,
                  at[R::kXv][k] * f.half_v,
                  at[R::kYv][k] * f.half_v,
                  0,
                  f.slack()};
  p.det = p.ax * p.by - p.ay * p.bx;
  if (!std::isfinite(p.x + p.y + z + p.ax + p.ay + p.bx + p.by)) return void(++counters_.samples_not_finite);
  const PosedDrawable& drawable = job.frame.drawables[drawable_];
  if (faces_away(drawable, p.det)) return void(++counters_.samples_backfacing);
  const std::uint32_t name = surface_name(job, f, p.det);

  // Sub-pixels that the footprint's box touches, inside the tile.
  const IntRect& pixels = job.samples.pixels;
  const auto side = static_cast<float>(side_);
  const float reach_x = std::abs(p.ax) + std::abs(p.bx) + p.slack, reach_y = std::abs(p.ay) + std::abs(p.by) + p.slack;
  const float left = (p.x - static_cast<float>(pixels.x0)) * side, top = (p.y - static_cast<float>(pixels.y0)) * side;
  const int columns = pixels.width() * side_, rows = pixels.height() * side_;
  const float x0 = std::max(left - reach_x * side, 0.0f),
              x1 = std::min(left + reach_x * side, static_cast<float>(columns)),
              y0 = std::max(top - reach_y * side, 0.0f), y1 = std::min(top + reach_y * side, static_cast<float>(rows));
  if (!(x0 <= x1 && y0 <= y1)) return void(++counters_.samples_outside_tile);
  const float z_u = at[R::kZu][k] * f.half_u, z_v = at[R::kZv][k] * f.half_v;
  for (int row = static_cast<int>(y0); row < std::min(static_cast<int>(y1) + 1, rows); ++row)
    for (int column = static_cast<int>(x0); column < std::min(static_cast<int>(x1) + 1, columns); ++column) {
      const auto slot = static_cast<std::size_t>(row % side_ * side_ + column % side_);
      const std::size_t pixel = static_cast<std::size_t>(row / side_ * pixels.width() + column / side_) *
                                static_cast<std::size_t>(job.samples.spp);
      for (std::uint32_t n = slot_first_[slot]; n < slot_first_[slot + 1]; ++n) {
        const std::size_t s = pixel + slot_sample_[n];
        const float px = job.samples.x[s], py = job.samples.y[s];
        ++counters_.footprint_tests;
        float along_u, along_v;
        if (!p.holds(px, py, along_u, along_v)) continue;
        // Another cell covers points outside the bounds, so that all tiles agree on them.
        if (px < f.cell->x0 || px > f.cell->x1 || py < f.cell->y0 || py > f.cell->y1) continue;
        write(job, *f.cell, s, z + (z_u * along_u + z_v * along_v), f.u + f.half_u * along_u, f.v + f.half_v * along_v,
              name);
      }
    }
}

// As published: the sub-pixel that holds the sample takes it.
void SamplingController::scatter_points(const Job& job, std::size_t k) {
  using R = SampleRegisters;
  const auto& at = registers_->at[0];
  const Footprint& f = footprints_[k];
  const float x = at[R::kX][k], y = at[R::kY][k], z = at[R::kZ][k];
  const scene::Projection& projection = job.frame.projection;
  if (z < static_cast<float>(projection.near) || (projection.far > 0 && z > static_cast<float>(projection.far)))
    return void(++counters_.samples_behind);
  if (!std::isfinite(x + y + z)) return void(++counters_.samples_not_finite);
  const PosedDrawable& drawable = job.frame.drawables[drawable_];
  const float det = at[R::kXu][k] * at[R::kYv][k] - at[R::kYu][k] * at[R::kXv][k];
  if (faces_away(drawable, det)) return void(++counters_.samples_backfacing);
  const IntRect& pixels = job.samples.pixels;
  const auto side = static_cast<float>(side_);
  const float left = (x - static_cast<float>(pixels.x0)) * side, top = (y - static_cast<float>(pixels.y0)) * side;
  if (!(left >= 0 && top >= 0 && left < static_cast<float>(pixels.width() * side_) &&
        top < static_cast<float>(pixels.height() * side_)))
    return void(++counters_.samples_outside_tile);
  const int column = static_cast<int>(left), row = static_cast<int>(top);
  const auto slot = static_cast<std::size_t>(row % side_ * side_ + column % side_);
  const std::size_t pixel = static_cast<std::size_t>(row / side_ * pixels.width() + column / side_) *
                            static_cast<std::size_t>(job.samples.spp);
  for (std::uint32_t n = slot_first_[slot]; n < slot_first_[slot + 1]; ++n)
    write(job, *f.cell, pixel + slot_sample_[n], z, f.u, f.v, surface_name(job, f, det));
}

// ---- Surfaces that move or are out of focus ---------------------------------------------------------------------

// The footprint sweeps an area while the shutter is open; each sample point inside is tested at its own time and
// through its own point of the lens.
void SamplingController::scatter_moving(const Job& job, std::size_t k) {
  using R = SampleRegisters;
  const Footprint& f = footprints_[k];
  const auto key = [&](std::size_t n) {
    const auto& at = registers_->at[n];
    return MovingFootprint::Key{at[R::kX][k],
                                at[R::kY][k],
                                at[R::kZ][k],
                                at[R::kXu][k] * f.half_u,
                                at[R::kYu][k] * f.half_u,
                                at[R::kZu][k] * f.half_u,
                                at[R::kXv][k] * f.half_v,
                                at[R::kYv][k] * f.half_v,
                                at[R::kZv][k] * f.half_v};
  };
  const TileSamples& samples = job.samples;
  const bool lens = job.lens();
  const MovingFootprint footprint(key(0), key(program_.keys == 2 ? 1 : 0), job.frame.projection,
                                  lens ? samples.lens_scale : 0.0f, f.slack());
  if (footprint.out_of_depth()) return void(++counters_.samples_behind);
  if (!footprint.finite()) return void(++counters_.samples_not_finite);
  const MovingFootprint::Box cell{f.cell->x0, f.cell->y0, f.cell->x1, f.cell->y1};
  MovingFootprint::Box box = cell;  // if the near plane cuts the footprint, the cell's bounds serve
  footprint.bounds(box);
  if (job.maps.settings().mode == ProcedureSettings::Mode::kInterval)
    box = {std::max(box.x0, cell.x0), std::max(box.y0, cell.y0), std::min(box.x1, cell.x1), std::min(box.y1, cell.y1)};
  const IntRect pixels = box.pixels(samples.pixels);
  if (pixels.empty() || box.empty()) return void(++counters_.samples_outside_tile);
  const PosedDrawable& drawable = job.frame.drawables[drawable_];
  const auto spp = static_cast<std::size_t>(samples.spp);
  for (int row = pixels.y0; row < pixels.y1; ++row) {
    const std::size_t first = samples.pixels.index(pixels.x0, row) * spp,
                      count = static_cast<std::size_t>(pixels.width()) * spp;
    for (std::size_t s = first; s < first + count; ++s) {
      const float px = samples.x[s], py = samples.y[s];
      if (!box.holds(px, py) || !(samples.stencil(s) >= f.times.first && samples.stencil(s) <= f.times.last)) continue;
      ++counters_.footprint_tests;
      Parallelogram p;
      MovingFootprint::Depth depth;
      float along_u, along_v;
      if (!footprint.at(samples.t(s), lens ? samples.lens_u[s] : 0.0f, lens ? samples.lens_v[s] : 0.0f, p, depth))
        continue;
      if (faces_away(drawable, p.det) || !p.holds(px, py, along_u, along_v)) continue;
      const std::uint64_t before = counters_.writes;
      write(job, *f.cell, s, depth.z + (depth.z_u * along_u + depth.z_v * along_v), f.u + f.half_u * along_u,
            f.v + f.half_v * along_v, surface_name(job, f, p.det));
      if (counters_.writes != before) keep_rest(job, k, s);
    }
  }
}

}  // namespace tessera::tilecore

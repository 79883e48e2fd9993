// A drawing instead of an image: another sampling process for the same procedures, which walks along lines of constant
// u and of constant v (the published architecture's brush lines). Brightly lit parts get fewer lines.
#include <algorithm>
#include <cmath>

#include "tilecore/procedural/footprint.h"
#include "tilecore/procedural/procedure_surface.h"
#include "tilecore/procedural/sampling_controller.h"

namespace tessera::tilecore {
namespace {

constexpr float kSlackPixels = 1.0f / 256;  // of a line, for rounding
constexpr int kLines = 64;                  // of each parameter over a piece; a power of two
constexpr float kWidthPixels = 0.55f;       // half the width of a line

// Largest light at which a line is drawn: every 32nd line always, other lines at less light the finer they are.
float max_light(int line) {
  if (line % 32 == 0) return 1e9f;
  if (line % 16 == 0) return 0.75f;
  if (line % 8 == 0) return 0.5f;
  if (line % 4 == 0) return 0.33f;
  return line % 2 == 0 ? 0.2f : 0.1f;
}

// Widens a line along (x, y) to a parallelogram of the width of lines.
void widen(Parallelogram& p) {
  const float length = std::sqrt(p.ax * p.ax + p.ay * p.ay), across = kWidthPixels / std::max(length, 1e-6f);
  p.bx = -p.ay * across, p.by = p.ax * across;
  p.det = p.ax * p.by - p.ay * p.bx;
}

// Samples of the tile in a box that lines of a cell may reach. A tile beyond that reach may not have the cell in its
// list, so no tile draws there: all tiles then agree.
template <class Visit>
void each_sample(const TileSamples& samples, const ParameterCell& cell, MovingFootprint::Box box, const Visit& visit) {
  constexpr float kReach = ParameterMaps::kLineReach;
  box = {std::max(box.x0, cell.x0 - kReach), std::max(box.y0, cell.y0 - kReach), std::min(box.x1, cell.x1 + kReach),
         std::min(box.y1, cell.y1 + kReach)};
  const IntRect pixels = box.pixels(samples.pixels);
  for (int y = pixels.y0; y < pixels.y1; ++y) {
    const auto spp = static_cast<std::size_t>(samples.spp);
    const std::size_t first = samples.pixels.index(pixels.x0, y) * spp,
                      end = first + static_cast<std::size_t>(std::max(pixels.width(), 0)) * spp;
    for (std::size_t s = first; s < end; ++s)
      if (box.holds(samples.x[s], samples.y[s])) visit(s);
  }
}

}  // namespace

void SamplingController::draw_lines(const Job& job, std::span<const Waiting> cells) {
  const scene::PosedDrawable& drawable = job.frame.drawables[drawable_];
  shaders::SurfaceProgram surface = surface_program(job.frame, drawable, drawable.procedure->pieces[piece_]);
  // This stage gives the tone; the material's shading needs more than the array has.
  surface.shading = shaders::ShadingId::kPhong;
  surface.shading_numbers = {0.15f, 0.6f, 0.4f, 24};
  surface.texture = shaders::TextureId::kPlain;
  surface.texture_numbers = {0.8f, 0.8f, 0.8f};
  program_.surface = &surface;
  for (const Waiting& waiting : cells)
    for (const bool along_u : {false, true}) draw_cell_lines(job, waiting, along_u);
  program_.surface = nullptr;
}

void SamplingController::draw_cell_lines(const Job& job, const Waiting& waiting, bool along_u) {
  const ParameterCell& cell = job.maps.cells()[waiting.cell];
  // Lines of constant v run along u, and vice versa.
  const float low = along_u ? cell.v0 : cell.u0, high = along_u ? cell.v1 : cell.u1;
  const float from = along_u ? cell.u0 : cell.v0, to = along_u ? cell.u1 : cell.v1;
  const int steps = along_u ? cell.line_steps.u : cell.line_steps.v;
  const float step = (to - from) / static_cast<float>(steps);
  for (int line = static_cast<int>(std::ceil(low * kLines)); static_cast<float>(line) < high * kLines; ++line) {
    count_issued(job, static_cast<std::uint64_t>(steps));
    for (int first = 0; first < steps; first += static_cast<int>(kArraySamples)) {
      const int count = std::min(steps - first, static_cast<int>(kArraySamples));
      for (int k = 0; k < count; ++k) {
        const float on = static_cast<float>(line) / kLines,
                    along = from + (static_cast<float>(first + k) + 0.5f) * step;
        registers_->u[static_cast<std::size_t>(k)] = along_u ? along : on;
        registers_->v[static_cast<std::size_t>(k)] = along_u ? on : along;
      }
      run_procedure(program_, static_cast<std::size_t>(count), *registers_);
      counters_.drawn_lines += static_cast<std::uint64_t>(count);
      for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) {
        const float luma = 0.2126f * registers_->r[k] + 0.7152f * registers_->g[k] + 0.0722f * registers_->b[k];
        if (!(luma <= max_light(line))) continue;
        if (program_.divided)
          scatter_line(job, cell, k, along_u, 0.5f * step);
        else
          scatter_moving_line(job, waiting, k, along_u, 0.5f * step);
      }
    }
  }
}

void SamplingController::scatter_line(const Job& job, const ParameterCell& cell, std::size_t k, bool along_u,
                                      float half_step) {
  using R = SampleRegisters;
  const auto& at = registers_->at[0];
  const float z = at[R::kZ][k];
  const scene::Projection& projection = job.frame.projection;
  if (!(z >= static_cast<float>(projection.near)) || (projection.far > 0 && z > static_cast<float>(projection.far)))
    return;
  Parallelogram p{at[R::kX][k],
                  at[R::kY][k],
                  at[along_u ? R::kXu : R::kXv][k] * half_step,
                  at[along_u ? R::kYu : R::kYv][k] * half_step,
                  0,
                  0,
                  0,
                  kSlackPixels};
  widen(p);
  if (!std::isfinite(p.x + p.y + z + p.det)) return;
  if (faces_away(job.frame.drawables[cell.drawable], at[R::kXu][k] * at[R::kYv][k] - at[R::kYu][k] * at[R::kXv][k]))
    return;
  const float rx = std::abs(p.ax) + std::abs(p.bx) + kSlackPixels, ry = std::abs(p.ay) + std::abs(p.by) + kSlackPixels;
  each_sample(job.samples, cell, {p.x - rx, p.y - ry, p.x + rx, p.y + ry}, [&](std::size_t s) {
    float along, beyond;
    ++counters_.footprint_tests;
    if (p.holds(job.samples.x[s], job.samples.y[s], along, beyond))
      write(job, cell, s, z * ParameterMaps::kLineDepth, registers_->u[k], registers_->v[k], SurfaceLocation::kLine);
  });
}

// Lines move with their surface and are out of focus with it; their width is the same at every time and through every
// point of the lens.
void SamplingController::scatter_moving_line(const Job& job, const Waiting& waiting, std::size_t k, bool along_u,
                                             float half_step) {
  using R = SampleRegisters;
  const ParameterCell& cell = job.maps.cells()[waiting.cell];
  const auto key = [&](std::size_t n, float across) {
    const auto& at = registers_->at[n];
    const std::size_t a = along_u ? R::kXu : R::kXv, b = along_u ? R::kXv : R::kXu;
    return MovingFootprint::Key{at[R::kX][k],
                                at[R::kY][k],
                                at[R::kZ][k],
                                at[a][k] * half_step,
                                at[a + 1][k] * half_step,
                                at[a + 2][k] * half_step,
                                at[b][k] * across,
                                at[b + 1][k] * across,
                                at[b + 2][k] * across};
  };
  const TileSamples& samples = job.samples;
  const bool lens = job.lens();
  const std::size_t close = program_.keys == 2 ? 1 : 0;
  const auto footprint = [&](float across) {
    return MovingFootprint(key(0, across), key(close, across), job.frame.projection, lens ? samples.lens_scale : 0.0f,
                           kSlackPixels);
  };
  // `line` is the place on screen; `surface` tells which side is visible.
  const MovingFootprint line = footprint(0), surface = footprint(half_step);
  if (line.out_of_depth() || !surface.finite()) return;
  MovingFootprint::Box box{cell.x0, cell.y0, cell.x1, cell.y1};
  line.bounds(box);
  constexpr float kWider = kWidthPixels + kSlackPixels;
  box = {box.x0 - kWider, box.y0 - kWider, box.x1 + kWider, box.y1 + kWider};
  const scene::PosedDrawable& drawable = job.frame.drawables[cell.drawable];
  each_sample(samples, cell, box, [&](std::size_t s) {
    if (samples.stencil(s) < waiting.times.first || samples.stencil(s) > waiting.times.last) return;
    ++counters_.footprint_tests;
    Parallelogram p;
    MovingFootprint::Depth depth;
    if (!surface.at(samples.t(s), lens ? samples.lens_u[s] : 0.0f, lens ? samples.lens_v[s] : 0.0f, p, depth)) return;
    if (faces_away(drawable, along_u ? p.det : -p.det)) return;
    widen(p);
    float along, beyond;
    if (!p.holds(samples.x[s], samples.y[s], along, beyond)) return;
    const std::uint64_t before = counters_.writes;
    write(job, cell, s, depth.z * ParameterMaps::kLineDepth, registers_->u[k], registers_->v[k],
          SurfaceLocation::kLine);
    if (counters_.writes != before) keep_rest(job, k, s);
  });
}

}  // namespace tessera::tilecore

// A drawing instead of an image: the same procedures behind another sampling process, which walks along lines of
// constant u and of constant v (the published architecture's brush lines). Where light falls, lines are left out.
#include <algorithm>
#include <cmath>

#include "tilecore/procedural/footprint.h"
#include "tilecore/procedural/procedure_surface.h"
#include "tilecore/procedural/sampling_controller.h"

namespace tessera::tilecore {
namespace {

constexpr float kSlackPixels = 1.0f / 256;    // of a line, for rounding
constexpr int kLines = 64;                    // of each parameter over a piece; a power of two
constexpr float kWidthPixels = 0.55f;         // half the width of a line
constexpr float kNearer = 1.0f - 1.0f / 256;  // lines lie a little in front of their surface

// Light up to which a line is drawn: every 32nd always, others the darker the finer.
float max_light(int line) {
  if (line % 32 == 0) return 1e9f;
  if (line % 16 == 0) return 0.75f;
  if (line % 8 == 0) return 0.5f;
  if (line % 4 == 0) return 0.33f;
  return line % 2 == 0 ? 0.2f : 0.1f;
}

}  // namespace

void SamplingController::draw_lines(const Job& job, std::span<const std::uint32_t> cells) {
  shaders::SurfaceProgram surface;
  const scene::Procedure::Piece* piece = nullptr;
  for (const std::uint32_t c : cells) {
    const ParameterCell& cell = job.maps.cells()[c];
    const scene::PosedDrawable& drawable = job.frame.drawables[cell.drawable];
    begin_piece(job, cell);
    if (!program_.divided) continue;  // lines stand still
    if (piece != &drawable.procedure->pieces[piece_]) {
      piece = &drawable.procedure->pieces[piece_];
      surface = surface_program(job.frame, drawable, *piece);
      // The stage that gives the tone; what a material would show needs more than the array has.
      surface.shading = shaders::ShadingId::kPhong;
      surface.shading_numbers = {0.15f, 0.6f, 0.4f, 24};
      surface.texture = shaders::TextureId::kPlain;
      surface.texture_numbers = {0.8f, 0.8f, 0.8f};
    }
    program_.surface = &surface;
    draw_cell_lines(job, cell, false);
    draw_cell_lines(job, cell, true);
  }
  program_.surface = nullptr;
}

void SamplingController::draw_cell_lines(const Job& job, const ParameterCell& cell, bool along_u) {
  // Lines of constant v run along u, and the other way round.
  const float low = along_u ? cell.v0 : cell.u0, high = along_u ? cell.v1 : cell.u1;
  const float from = along_u ? cell.u0 : cell.v0, to = along_u ? cell.u1 : cell.v1;
  const int steps = along_u ? cell.steps_u : cell.steps_v;
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
      for (int k = 0; k < count; ++k)
        scatter_line(job, cell, static_cast<std::size_t>(k), along_u, 0.5f * step, max_light(line));
    }
  }
}

void SamplingController::scatter_line(const Job& job, const ParameterCell& cell, std::size_t k, bool along_u,
                                      float half_step, float light) {
  using R = SampleRegisters;
  const auto& at = registers_->at[0];
  const float z = at[R::kZ][k];
  const float luma = 0.2126f * registers_->r[k] + 0.7152f * registers_->g[k] + 0.0722f * registers_->b[k];
  const scene::Projection& projection = job.frame.projection;
  if (!(z >= static_cast<float>(projection.near)) || (projection.far > 0 && z > static_cast<float>(projection.far)) ||
      !(luma <= light))
    return;
  const float tangent_x = at[along_u ? R::kXu : R::kXv][k] * half_step,
              tangent_y = at[along_u ? R::kYu : R::kYv][k] * half_step;
  const float length = std::sqrt(tangent_x * tangent_x + tangent_y * tangent_y),
              across = kWidthPixels / std::max(length, 1e-6f);
  Parallelogram p{at[R::kX][k],        at[R::kY][k],       tangent_x, tangent_y,
                  -tangent_y * across, tangent_x * across, 0,         kSlackPixels};
  p.det = p.ax * p.by - p.ay * p.bx;
  if (!std::isfinite(p.x + p.y + z + p.det)) return;
  const scene::PosedDrawable& drawable = job.frame.drawables[cell.drawable];
  const float facing = at[R::kXu][k] * at[R::kYv][k] - at[R::kYu][k] * at[R::kXv][k];
  if (!drawable.material->double_sided && (drawable.mirrored ? facing < 0 : facing > 0)) return;
  const IntRect& pixels = job.samples.pixels;
  // Beyond its reach a tile may not know of the cell: no tile draws there, so that none sees more than another would.
  const float left = cell.x0 - ParameterMaps::kLineReach, right = cell.x1 + ParameterMaps::kLineReach,
              top = cell.y0 - ParameterMaps::kLineReach, bottom = cell.y1 + ParameterMaps::kLineReach;
  const float rx = std::abs(p.ax) + std::abs(p.bx) + kSlackPixels, ry = std::abs(p.ay) + std::abs(p.by) + kSlackPixels;
  const auto clip = [](float a, int low, int high) {
    return static_cast<int>(std::floor(std::min(std::max(a, static_cast<float>(low)), static_cast<float>(high))));
  };
  const int x1 = std::min(clip(p.x + rx, pixels.x0 - 1, pixels.x1) + 1, pixels.x1),
            y1 = std::min(clip(p.y + ry, pixels.y0 - 1, pixels.y1) + 1, pixels.y1);
  for (int y = clip(p.y - ry, pixels.y0, pixels.y1); y < y1; ++y)
    for (int x = clip(p.x - rx, pixels.x0, pixels.x1); x < x1; ++x) {
      const std::size_t first = pixels.index(x, y) * static_cast<std::size_t>(job.samples.spp);
      for (std::size_t s = first; s < first + static_cast<std::size_t>(job.samples.spp); ++s) {
        float along, beyond;
        const float px = job.samples.x[s], py = job.samples.y[s];
        if (px < left || px > right || py < top || py > bottom) continue;
        ++counters_.footprint_tests;
        if (p.holds(px, py, along, beyond))
          write(job, cell, s, z * kNearer, registers_->u[k], registers_->v[k], SurfaceLocation::kLine);
      }
    }
}

}  // namespace tessera::tilecore

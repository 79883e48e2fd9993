// Holes between samples: found by their neighbours, filled by solving for the parameters of the surface there.
#include <algorithm>
#include <cmath>

#include "scene/procedure_patch.h"
#include "shaders_cpp/procedures/procedures.h"
#include "tilecore/procedural/sampling_controller.h"
#include "tilecore/shading/surface.h"

namespace tessera::tilecore {
namespace {

constexpr int kMaxSteps = 6;  // of Newton's method
constexpr int kMaxRounds = 4;
constexpr float kSolvedPixels = 1.0f / 128;
constexpr float kBehindShare = 1.0f / 512;      // a hole sees something farther by more than this share of the depth
constexpr float kSameSurfaceShare = 1.0f / 16;  // neighbours on one surface differ in depth by less

}  // namespace

// What was filled helps to find what lies beside it.
void SamplingController::refill_holes(const Job& job) {
  find_slots(job.samples);
  for (int round = 0; round < kMaxRounds; ++round) {
    const std::uint64_t before = counters_.holes_refilled;
    refill_once(job);
    if (counters_.holes_refilled == before) return;
  }
}

void SamplingController::refill_once(const Job& job) {
  const IntRect& pixels = job.samples.pixels;
  const int columns = pixels.width() * side_, rows = pixels.height() * side_;
  const auto sample_at = [&](int column, int row) -> std::size_t {
    const auto slot = static_cast<std::size_t>(row % side_ * side_ + column % side_);
    if (slot_first_[slot] == slot_first_[slot + 1]) return job.samples.count;  // no sample in this sub-pixel
    return static_cast<std::size_t>(row / side_ * pixels.width() + column / side_) *
               static_cast<std::size_t>(job.samples.spp) +
           slot_sample_[slot_first_[slot]];
  };
  const auto procedure_of = [&](std::size_t s) -> const scene::PosedDrawable* {
    if (s == job.samples.count || job.state.patch[s] == TileState::kNoPatch) return nullptr;
    const scene::PosedDrawable& drawable = job.frame.drawable_of(job.state.patch[s]);
    return drawable.procedure != nullptr && !drawable.moving && !job.lens() ? &drawable : nullptr;
  };
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const std::size_t hole = sample_at(column, row);
      if (hole == job.samples.count) continue;
      // Neighbours one or two sub-pixels away, so that holes two wide are found as well.
      for (const auto& [dx, dy] : {std::pair{1, 0}, {0, 1}, {2, 0}, {0, 2}}) {
        if (column < dx || row < dy || column + dx >= columns || row + dy >= rows) continue;
        const std::size_t before = sample_at(column - dx, row - dy), after = sample_at(column + dx, row + dy);
        const scene::PosedDrawable* drawable = procedure_of(before);
        if (drawable == nullptr || drawable != procedure_of(after)) continue;
        const float z0 = job.state.z[before], z1 = job.state.z[after], farther = std::max(z0, z1);
        if (std::abs(z1 - z0) > kSameSurfaceShare * farther || !(job.state.z[hole] > farther * (1 + kBehindShare)))
          continue;
        ++counters_.holes_suspected;
        if (refill(job, hole, before, after)) break;
      }
    }
}

bool SamplingController::refill(const Job& job, std::size_t hole, std::size_t before, std::size_t after) {
  const scene::PosedDrawable& drawable = job.frame.drawable_of(job.state.patch[before]);
  const scene::ProcedurePatch from = scene::procedure_patch(job.frame, job.state.patch[before]),
                              to = scene::procedure_patch(job.frame, job.state.patch[after]);
  const float x = job.samples.x[hole], y = job.samples.y[hole], near = static_cast<float>(job.frame.projection.near);
  // From the nearer end of the two; their middle would be wrong where a closed parameter wraps or a piece ends.
  float u = from.u(job.state.b1[before]), v = from.v(job.state.b2[before]);
  if (from.piece == to.piece && std::abs(to.u(job.state.b1[after]) - u) < 0.25f &&
      std::abs(to.v(job.state.b2[after]) - v) < 0.25f) {
    u = 0.5f * (u + to.u(job.state.b1[after]));
    v = 0.5f * (v + to.v(job.state.b2[after]));
  }
  for (int step = 0; step < kMaxSteps; ++step) {
    Vec4 r, by_u, by_v;
    shaders::with_shape(from.shape, [&](auto shape) {
      const auto p = shaders::shape_tangents<decltype(shape)>(from.piece->input, u, v);
      const Mat4& m = drawable.to_raster[0];
      r = m * Vec4(p.position.x, p.position.y, p.position.z, 1.0f);
      by_u = m * Vec4(p.by_u.x, p.by_u.y, p.by_u.z, 0.0f);
      by_v = m * Vec4(p.by_v.x, p.by_v.y, p.by_v.z, 0.0f);
    });
    const float depth = r.z;
    if (!(depth >= near)) return false;
    const auto screen = [&](const Vec4& d) {
      return job.frame.projection.orthographic ? Vec2(d) : (Vec2(d) - Vec2(r) / r.w * d.w) / r.w;
    };
    const Vec2 at = Vec2(r) / r.w, a = screen(by_u), b = screen(by_v), way = Vec2(x, y) - at;
    const float det = a.x * b.y - a.y * b.x;
    if (std::abs(way.x) + std::abs(way.y) < kSolvedPixels) {
      if (!drawable.material->double_sided && (drawable.mirrored ? det < 0 : det > 0)) return false;
      if (!(depth < job.state.z[hole])) return false;
      ParameterCell whole;
      whole.piece = static_cast<std::uint32_t>(from.piece - drawable.procedure->pieces.data());
      whole.u1 = whole.v1 = 1;
      drawable_ = static_cast<std::uint32_t>(&drawable - job.frame.drawables.data());
      write(job, whole, hole, depth, u, v, SurfaceLocation::kWholePatch);
      ++counters_.holes_refilled;
      return true;
    }
    u += (way.x * b.y - way.y * b.x) / det;
    v += (a.x * way.y - a.y * way.x) / det;
    if (!(u >= 0.0f && u <= 1.0f && v >= 0.0f && v <= 1.0f)) return false;
  }
  return false;
}

}  // namespace tessera::tilecore

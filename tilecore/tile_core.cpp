#include "tilecore/tile_core.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "base/check.h"
#include "tilecore/clipped_cells.h"
#include "tilecore/tile_frustum.h"

namespace tessera::tilecore {
namespace {

using frontend::AlphaMode;

// Nearest opaque surface wins; equal depths go to the lower patch, then the lower triangle, whatever came first.
class OpaqueSink final : public HitSink {
 public:
  OpaqueSink(std::uint32_t patch, TileState& state) : patch_(patch), state_(state) {}
  void take(std::span<const Hit> hits) override {
    for (const Hit& hit : hits) commit(hit);
  }

 protected:
  void commit(const Hit& hit) {
    const std::size_t s = hit.sample;
    if (hit.z > state_.z[s]) return;
    if (hit.z == state_.z[s] && std::tie(patch_, hit.triangle) >= std::tie(state_.patch[s], state_.triangle[s])) return;
    if (state_.patch[s] == TileState::kNoPatch) --state_.unseen;
    state_.z[s] = hit.z;
    state_.patch[s] = patch_;
    state_.triangle[s] = hit.triangle;
    state_.b1[s] = hit.b1;
    state_.b2[s] = hit.b2;
    state_.rest_x[s] = hit.rest_x;
    state_.rest_y[s] = hit.rest_y;
  }

  std::uint32_t patch_;
  TileState& state_;
};

// Hits count only where the material's alpha reaches its cutoff.
class MaskSink final : public HitSink {
 public:
  MaskSink(const frontend::FrameGeometry& frame, std::uint32_t patch, TileState& state, std::uint64_t& alpha_tests)
      : frame_(frame), patch_(patch), cutoff_(frame.drawable_of(patch).material->alpha_cutoff), opaque_(patch, state), alpha_tests_(alpha_tests) {}
  void take(std::span<const Hit> hits) override {
    for (const Hit& hit : hits) {
      ++alpha_tests_;
      if (point_alpha(frame_, {patch_, hit.triangle, hit.b1, hit.b2, 0.0f}) >= cutoff_) opaque_.take(std::span(&hit, 1));
    }
  }

 private:
  const frontend::FrameGeometry& frame_;
  std::uint32_t patch_;
  float cutoff_;
  OpaqueSink opaque_;
  std::uint64_t& alpha_tests_;
};

class LayerSink final : public HitSink {
 public:
  LayerSink(std::uint32_t patch, TileState& state) : patch_(patch), state_(state) {}
  void take(std::span<const Hit> hits) override {
    for (const Hit& hit : hits)
      state_.layers.push_back({hit.sample, patch_, hit.triangle, hit.z, hit.b1, hit.b2, hit.rest_x, hit.rest_y});
  }

 private:
  std::uint32_t patch_;
  TileState& state_;
};

// The tile's far plane: infinity while a sample sees nothing.
float farthest(const TileState& state) {
  if (state.unseen > 0) return std::numeric_limits<float>::infinity();
  const std::vector<float>& z = state.z;
  // Several running maxima, so that the loop is not one chain of dependent steps.
  std::array<float, 16> most{};
  std::size_t i = 0;
  for (; i + most.size() <= z.size(); i += most.size())
    for (std::size_t k = 0; k < most.size(); ++k) most[k] = z[i + k] > most[k] ? z[i + k] : most[k];
  for (; i < z.size(); ++i) most[0] = std::max(most[0], z[i]);
  return *std::max_element(most.begin(), most.end());
}

HitLimits hit_limits(const frontend::FrameGeometry& frame, const frontend::PosedDrawable& drawable) {
  HitLimits limits;
  limits.near = static_cast<float>(frame.projection.near);
  if (frame.projection.far > 0) limits.far = static_cast<float>(frame.projection.far);
  if (!drawable.material->double_sided) {
    // glTF's front faces wind counter-clockwise with y up; raster space has y down, where that is a negative area.
    limits.keep_positive = drawable.mirrored;
    limits.keep_negative = !drawable.mirrored;
  }
  return limits;
}

}  // namespace

void TileState::start(std::size_t samples) {
  unseen = samples;
  z.assign(samples, std::numeric_limits<float>::infinity());
  patch.assign(samples, kNoPatch);
  triangle.assign(samples, kNoPatch);
  for (auto* v : {&b1, &b2, &rest_x, &rest_y}) v->assign(samples, 0.0f);
  layers.clear();
  started = true;
}

FrameTargets::FrameTargets(IntRect region_in, bool auxiliary_in)
    : color(region_in.width(), region_in.height(), 4), auxiliary(auxiliary_in), region(region_in) {
  if (!auxiliary) return;
  depth = Image(region.width(), region.height(), 1);
  normal = Image(region.width(), region.height(), 3);
  invocations = Image(region.width(), region.height(), 1);
  patch = ImageOf<std::uint32_t>(region.width(), region.height(), 1);
}

TileCoreCounters TileCore::take_counters() { return std::exchange(counters_, {}); }
hardware::Ledger TileCore::take_ledger() { return std::exchange(ledger_, {}); }
ResolveCounters TileCore::take_resolve_counters() { return std::exchange(resolve_counters_, {}); }

void TileCore::prepare_samples(const TileJob& job, IntRect pixels) {
  const bool lens = job.frame->projection.lens_scale != 0 || job.force_lens;
  samples_.fill(*job.pattern, pixels, static_cast<float>(job.frame->projection.lens_scale), lens);
}

// ---- Visibility -------------------------------------------------------------------------------------------------

void TileCore::render_entries(const TileJob& job, binner::TileIndex tile, std::vector<binner::QueueEntry> entries, TileState& state) {
  counters_.entries_fetched += entries.size();
  const IntRect pixels = job.grid->pixels(tile);
  prepare_samples(job, pixels);
  if (!state.started) state.start(samples_.count);
  std::sort(entries.begin(), entries.end(), [](const binner::QueueEntry& a, const binner::QueueEntry& b) {
    return std::tie(a.near_depth, a.base_patch, a.range.j0, a.range.i0) < std::tie(b.near_depth, b.base_patch, b.range.j0, b.range.i0);
  });
  // Nearest first: once an entry begins behind everything that the tile sees, so do all that follow. An entry's near
  // depth is no farther than any of its vertices, rounding included; one that begins at the same depth may still win.
  for (std::size_t e = 0; e < entries.size(); ++e) {
    if (job.cull_occlusion && entries[e].near_depth > farthest(state)) {
      counters_.culled_occlusion += entries.size() - e;
      break;
    }
    current_work_place().base_patch = entries[e].base_patch;
    render_sub_patch(job, entries[e], state);
  }
  current_work_place().base_patch = -1;
}

void TileCore::render_sub_patch(const TileJob& job, const binner::QueueEntry& entry, TileState& state) {
  const frontend::FrameGeometry& frame = *job.frame;
  const frontend::PosedDrawable& drawable = frame.drawable_of(entry.base_patch);
  const RayEffects effects{drawable.moving || job.force_motion, frame.projection.lens_scale != 0 || job.force_lens};
  const auto& [mesh, work] = meshes_.get(frame, entry.base_patch, entry.range, effects, job.box_bits);
  tessellations_.push_back({entry.base_patch, entry.range, static_cast<std::uint32_t>(work.domain_evaluations), static_cast<std::uint32_t>(work.triangles),
                            hardware::burst_bytes(0, work.patch_bytes, job.burst_bytes), effects.motion});

  const VisibilitySettings settings{hit_limits(frame, drawable), frame.projection.orthographic, static_cast<float>(frame.projection.inverse_focus), state.z.data()};
  const auto run = [&](HitSink&& sink) {
    test_mesh(job, mesh, {entry.t0, entry.t1}, effects, settings, sink);
    sink.flush();
  };
  switch (drawable.material->alpha_mode) {
    case AlphaMode::kOpaque: run(OpaqueSink(entry.base_patch, state)); break;
    case AlphaMode::kMask: run(MaskSink(frame, entry.base_patch, state, counters_.alpha_tests)); break;
    case AlphaMode::kBlend: run(LayerSink(entry.base_patch, state)); break;
  }
}

void TileCore::find_hits(const TileJob& job, const binner::QueueEntry& entry, HitSink& sink) {
  const frontend::FrameGeometry& frame = *job.frame;
  const frontend::PosedDrawable& drawable = frame.drawable_of(entry.base_patch);
  const RayEffects effects{drawable.moving || job.force_motion, frame.projection.lens_scale != 0 || job.force_lens};
  const MicroMesh& mesh = meshes_.get(frame, entry.base_patch, entry.range, effects, job.box_bits).mesh;
  test_mesh(job, mesh, {entry.t0, entry.t1}, effects, {hit_limits(frame, drawable), frame.projection.orthographic, static_cast<float>(frame.projection.inverse_focus)}, sink);
  sink.flush();
}

void TileCore::test_mesh(const TileJob& job, const MicroMesh& mesh, TimeRange entry_times, RayEffects effects, const VisibilitySettings& settings, HitSink& sink) {
  VisibilityWork work;
  if (!effects.motion && !effects.lens) {
    raster_mesh(mesh, samples_, settings, sink, work);
  } else {
    for (std::size_t l = 0; l < mesh.leaves.size(); ++l) {
      ++work.box_tests;
      const TimeRange times = touching_times(mesh.leaves[l], samples_.pixels, effects.motion, samples_.lens_scale).intersect(entry_times);
      if (!times.empty()) trace_leaf(mesh, l, samples_, times, effects, settings, sink, work);
    }
  }
  if (!mesh.clipped_cells.empty()) test_clipped_cells(mesh, samples_, entry_times, effects, job.frame->projection, settings, sink, work);
  counters_.box_tests += work.box_tests;
  counters_.triangle_tests += work.triangle_tests;
  counters_.sample_hits += work.sample_hits;
}

void TileCore::store_state(const TileJob& job, const TileState& state) {
  const std::uint64_t bytes = state.z.size() * TileState::kBytesPerSample + state.layers.size() * TileState::kBytesPerLayer;
  ledger_.write(hardware::Unit::kTilecore, hardware::Purpose::kTileState, hardware::burst_bytes(0, bytes, job.burst_bytes));
}

void TileCore::load_state(const TileJob& job, const TileState& state) {
  const std::uint64_t bytes = state.z.size() * TileState::kBytesPerSample + state.layers.size() * TileState::kBytesPerLayer;
  ledger_.read(hardware::Unit::kTilecore, hardware::Purpose::kTileState, hardware::burst_bytes(0, bytes, job.burst_bytes));
}

// ---- Shading ----------------------------------------------------------------------------------------------------

void TileCore::finish(const TileJob& job, binner::TileIndex tile, TileState& state, FrameTargets& targets) {
  const IntRect pixels = job.grid->pixels(tile);
  TESSERA_CHECK(state.started && samples_.pixels == pixels, "a tile is finished right after its last entries");
  pixel_invocations_.assign(samples_.count / static_cast<std::size_t>(samples_.spp), 0);
  pixel_normal_.assign(pixel_invocations_.size(), Vec3(0.0f));
  shade_opaque(job, state);
  shade_layers(job, state);
  resolve_multisample({sample_color_, sample_coverage_, samples_.spp, pixels, targets.region, job.burst_bytes}, targets.color, resolve_counters_, ledger_);
  if (targets.auxiliary) write_auxiliary(state, targets);
  if (tile < targets.tile_farthest.size()) targets.tile_farthest[tile] = farthest(state);
}

void TileCore::shade_opaque(const TileJob& job, const TileState& state) {
  const frontend::FrameGeometry& frame = *job.frame;
  const auto spp = static_cast<std::size_t>(samples_.spp);
  sample_color_.resize(samples_.count);
  sample_coverage_.assign(samples_.count, 0.0f);
  // Samples of one pixel that share a run of the shader: same patch and, where the picture of the surface at rest
  // differs from where the samples are, same pixel of that picture.
  struct Group {
    std::uint32_t patch;
    float cell_x, cell_y;
    std::size_t sample;  // the one nearest to the middle of the cell is shaded
    float distance2;
  };
  std::vector<Group> groups;
  std::vector<std::size_t> group_of(spp);
  for (std::size_t pixel = 0; pixel < samples_.count / spp; ++pixel) {
    groups.clear();
    const std::size_t first = pixel * spp;
    for (std::size_t k = 0; k < spp; ++k) {
      const std::size_t s = first + k;
      if (state.patch[s] == TileState::kNoPatch) continue;
      ++counters_.samples_visible;
      const bool at_rest = !frame.drawable_of(state.patch[s]).moving && frame.projection.lens_scale == 0;
      // A still pinhole sample sees the surface where it is itself.
      const float x = at_rest ? samples_.x[s] : state.rest_x[s], y = at_rest ? samples_.y[s] : state.rest_y[s];
      const float cell_x = std::floor(x), cell_y = std::floor(y);
      const float dx = x - cell_x - 0.5f, dy = y - cell_y - 0.5f, distance2 = dx * dx + dy * dy;
      std::size_t g = 0;
      if (job.shading == ShadingRate::kSample) g = groups.size();
      while (g < groups.size() && (groups[g].patch != state.patch[s] || groups[g].cell_x != cell_x || groups[g].cell_y != cell_y)) ++g;
      if (g == groups.size()) groups.push_back({state.patch[s], cell_x, cell_y, s, distance2});
      else if (distance2 < groups[g].distance2) groups[g].sample = s, groups[g].distance2 = distance2;
      group_of[k] = g;
    }
    for (std::size_t g = 0; g < groups.size(); ++g) {
      const std::size_t s = groups[g].sample;
      const float t = samples_.t(s);
      const ShadedPoint point = shade_point(frame, job.lighting, {state.patch[s], state.triangle[s], state.b1[s], state.b2[s], t});
      ++pixel_invocations_[pixel];
      pixel_normal_[pixel] += point.normal;
      for (std::size_t k = 0; k < spp; ++k)
        if (state.patch[first + k] != TileState::kNoPatch && group_of[k] == g) {
          sample_color_[first + k] = point.color;
          sample_coverage_[first + k] = 1.0f;
        }
    }
    counters_.pixel_shader_invocations += groups.size();
    if (groups.empty() || groups.size() < spp || std::count(sample_coverage_.begin() + static_cast<std::ptrdiff_t>(first), sample_coverage_.begin() + static_cast<std::ptrdiff_t>(first + spp), 0.0f) > 0)
      fill_background(job, first, spp);
  }
}

void TileCore::fill_background(const TileJob& job, std::size_t first, std::size_t count) {
  for (std::size_t s = first; s < first + count; ++s) {
    if (sample_coverage_[s] > 0.0f) continue;
    sample_color_[s] = job.has_background ? job.background : job.lighting.environment.background(view_direction(*job.frame, samples_.x[s], samples_.y[s]));
  }
}

void TileCore::shade_layers(const TileJob& job, TileState& state) {
  const frontend::FrameGeometry& frame = *job.frame;
  std::erase_if(state.layers, [&](const TileState::Layer& layer) { return layer.z >= state.z[layer.sample]; });
  if (state.layers.empty()) return;
  counters_.blended_layers += state.layers.size();
  // Far to near within a sample; equal depths by patch and triangle.
  std::sort(state.layers.begin(), state.layers.end(), [](const TileState::Layer& a, const TileState::Layer& b) {
    return std::tie(a.sample, b.z, a.patch, a.triangle) < std::tie(b.sample, a.z, b.patch, b.triangle);
  });
  // One run of the shader per pixel and triangle (and pixel of the resting picture where things move).
  struct Shaded {
    std::uint32_t patch, triangle;
    float cell_x, cell_y;
    ShadedPoint point;
  };
  std::vector<Shaded> shaded;
  std::size_t pixel = samples_.count;
  for (const TileState::Layer& layer : state.layers) {
    const std::size_t here = layer.sample / static_cast<std::size_t>(samples_.spp);
    if (here != pixel) shaded.clear();
    pixel = here;
    const bool at_rest = !frame.drawable_of(layer.patch).moving && frame.projection.lens_scale == 0;
    const float cell_x = at_rest ? 0.0f : std::floor(layer.rest_x), cell_y = at_rest ? 0.0f : std::floor(layer.rest_y);
    auto found = std::find_if(shaded.begin(), shaded.end(), [&](const Shaded& s) {
      return s.patch == layer.patch && s.triangle == layer.triangle && s.cell_x == cell_x && s.cell_y == cell_y;
    });
    if (found == shaded.end() || job.shading == ShadingRate::kSample) {
      const float t = samples_.t(layer.sample);
      shaded.push_back({layer.patch, layer.triangle, cell_x, cell_y, shade_point(frame, job.lighting, {layer.patch, layer.triangle, layer.b1, layer.b2, t})});
      found = shaded.end() - 1;
      ++counters_.pixel_shader_invocations;
      ++pixel_invocations_[pixel];
    }
    const float alpha = found->point.alpha;
    sample_color_[layer.sample] = sample_color_[layer.sample] * (1.0f - alpha) + found->point.color * alpha;
    sample_coverage_[layer.sample] = sample_coverage_[layer.sample] * (1.0f - alpha) + alpha;
  }
}

void TileCore::write_auxiliary(const TileState& state, FrameTargets& targets) {
  const auto spp = static_cast<std::size_t>(samples_.spp);
  std::size_t pixel = 0;
  for (int y = samples_.pixels.y0; y < samples_.pixels.y1; ++y)
    for (int x = samples_.pixels.x0; x < samples_.pixels.x1; ++x, ++pixel) {
      const int tx = x - targets.region.x0, ty = y - targets.region.y0;
      float nearest = std::numeric_limits<float>::infinity();
      for (std::size_t k = 0; k < spp; ++k) nearest = std::min(nearest, state.z[pixel * spp + k]);
      targets.depth.at(tx, ty)[0] = std::isinf(nearest) ? 0.0f : nearest;
      targets.patch.at(tx, ty)[0] = state.patch[pixel * spp] + 1;  // kNoPatch wraps to 0
      targets.invocations.at(tx, ty)[0] = static_cast<float>(pixel_invocations_[pixel]);
      const float length = glm::length(pixel_normal_[pixel]);
      for (int c = 0; c < 3; ++c) targets.normal.at(tx, ty)[static_cast<std::size_t>(c)] = length > 0 ? pixel_normal_[pixel][c] / length : 0.0f;
    }
}

}  // namespace tessera::tilecore

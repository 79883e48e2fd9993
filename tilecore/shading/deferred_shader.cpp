#include "tilecore/shading/deferred_shader.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace tessera::tilecore {
namespace {

constexpr int kBlockSide = 8;  // pixels; what is near on screen is shaded together

// Whether samples see a surface where it is at rest: it does not move and there is no lens.
bool at_rest(const scene::FrameGeometry& frame, std::uint32_t patch) {
  return !frame.drawable_of(patch).moving && frame.projection.lens_scale == 0;
}

// Time at which a sample sees a patch: what does not move is as it is at shutter open. Mixing two equal poses by the
// time would round, and a still pixel would not stay the same from frame to frame.
float time_of(const scene::FrameGeometry& frame, const TileSamples& samples, std::size_t sample, std::uint32_t patch) {
  return frame.drawable_of(patch).moving ? samples.t(sample) : 0.0f;
}

}  // namespace

void DeferredShader::shade(const TileJob& job, const TileSamples& samples, TileState& state, bool empty_cache,
                           std::span<const std::uint8_t> runs) {
  runs_ = runs;
  pixel_invocations_.assign(samples.count / static_cast<std::size_t>(samples.spp), 0);
  pixel_normal_.assign(pixel_invocations_.size(), Vec3(0.0f));
  if (job.shading == ShadingRate::kCache && empty_cache) {
    cells_.start(*job.frame, job.shading_cell_pixels);
    cache_.empty(job.shading_cache_entries);
  }
  shade_opaque(job, samples, state);
  shade_layers(job, samples, state);
}

// ---- Pixel-shader invocations -----------------------------------------------------------------------------------

ShadedPoint DeferredShader::run_shader(const TileJob& job, const SurfaceLocation& at, std::size_t pixel) {
  ++counters_.pixel_shader_invocations;
  ++pixel_invocations_[pixel];
  if (!drawables_.empty()) ++drawables_[job.frame->assembly->patch_drawable[at.patch]].pixel_shader_invocations;
  return shade_point(*job.frame, job.lighting, at, &textures_);
}

const ShadedPoint& DeferredShader::shade_cell(const TileJob& job, const SurfaceLocation& at, std::size_t pixel) {
  const ShadingCell cell = cells_.cell_of(at);
  if (const ShadedPoint* found = cache_.find(cell)) {
    ++counters_.shading_cache_hits;
    ++counters_.pixel_shader_invocations_saved;
    return *found;
  }
  ++counters_.shading_cache_misses;
  return cache_.insert(cell, run_shader(job, ShadingCells::canonical_point(*job.frame, cell), pixel));
}

// ---- What is opaque ---------------------------------------------------------------------------------------------

void DeferredShader::shade_opaque(const TileJob& job, const TileSamples& samples, const TileState& state) {
  const auto spp = static_cast<std::size_t>(samples.spp);
  sample_color_.resize(samples.count);
  sample_coverage_.assign(samples.count, 0.0f);
  // Block by block, so that neighbours in both directions find the shading cache warm.
  const int width = samples.pixels.width(), height = samples.pixels.height();
  for (int block_y = 0; block_y < height; block_y += kBlockSide)
    for (int block_x = 0; block_x < width; block_x += kBlockSide)
      for (int y = block_y; y < std::min(block_y + kBlockSide, height); ++y)
        for (int x = block_x; x < std::min(block_x + kBlockSide, width); ++x) {
          const auto pixel =
              static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
          if (runs_of(pixel) == 0) {
            skip_pixel(job, samples, state, pixel);
            continue;
          }
          if (job.shading == ShadingRate::kCache)
            shade_pixel_from_cells(job, samples, state, pixel);
          else
            shade_pixel(job, samples, state, pixel);
          fill_background(job, samples, pixel * spp, spp);
        }
}

std::size_t DeferredShader::group_samples(const TileJob& job, const TileSamples& samples, const TileState& state,
                                          std::size_t pixel) {
  const scene::FrameGeometry& frame = *job.frame;
  const auto spp = static_cast<std::size_t>(samples.spp);
  const std::size_t first = pixel * spp;
  const bool halves = runs_of(pixel) == 2;
  groups_.clear();
  group_of_.resize(spp);
  std::size_t visible = 0;
  for (std::size_t k = 0; k < spp; ++k) {
    const std::size_t s = first + k;
    if (state.patch[s] == TileState::kNoPatch) continue;
    ++visible;
    count_visible(job, state.patch[s]);
    // A still pinhole sample sees the surface where it is itself.
    const bool rests = at_rest(frame, state.patch[s]);
    const float x = rests ? samples.x[s] : state.rest_x[s], y = rests ? samples.y[s] : state.rest_y[s];
    const float cell_x = std::floor(x), cell_y = std::floor(y);
    const bool right = halves && samples.x[s] - std::floor(samples.x[s]) >= 0.5f;
    const float dx = x - cell_x - (halves ? (right ? 0.75f : 0.25f) : 0.5f), dy = y - cell_y - 0.5f,
                distance2 = dx * dx + dy * dy;
    std::size_t g = 0;
    if (job.shading == ShadingRate::kSample) g = groups_.size();
    while (g < groups_.size() && (groups_[g].patch != state.patch[s] || groups_[g].cell_x != cell_x ||
                                  groups_[g].cell_y != cell_y || groups_[g].right != right))
      ++g;
    if (g == groups_.size())
      groups_.push_back({state.patch[s], cell_x, cell_y, s, distance2, right});
    else if (distance2 < groups_[g].distance2)
      groups_[g].sample = s, groups_[g].distance2 = distance2;
    group_of_[k] = g;
  }
  return visible;
}

void DeferredShader::skip_pixel(const TileJob& job, const TileSamples& samples, const TileState& state,
                                std::size_t pixel) {
  const std::size_t visible = group_samples(job, samples, state, pixel);
  counters_.samples_visible += visible;
  skipped_.samples += visible;
  skipped_.invocations += job.shading == ShadingRate::kCache ? visible : groups_.size();
}

void DeferredShader::shade_pixel(const TileJob& job, const TileSamples& samples, const TileState& state,
                                 std::size_t pixel) {
  const auto spp = static_cast<std::size_t>(samples.spp);
  const std::size_t first = pixel * spp, visible = group_samples(job, samples, state, pixel);
  counters_.samples_visible += visible;
  counters_.pixel_shader_invocations_saved += visible - groups_.size();
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    const std::size_t s = groups_[g].sample;
    const ShadedPoint point = run_shader(
        job,
        {state.patch[s], state.triangle[s], state.b1[s], state.b2[s], time_of(*job.frame, samples, s, state.patch[s])},
        pixel);
    pixel_normal_[pixel] += point.normal;
    for (std::size_t k = 0; k < spp; ++k)
      if (state.patch[first + k] != TileState::kNoPatch && group_of_[k] == g) {
        sample_color_[first + k] = point.color;
        sample_coverage_[first + k] = 1.0f;
      }
  }
}

void DeferredShader::shade_pixel_from_cells(const TileJob& job, const TileSamples& samples, const TileState& state,
                                            std::size_t pixel) {
  const auto spp = static_cast<std::size_t>(samples.spp);
  for (std::size_t s = pixel * spp; s < (pixel + 1) * spp; ++s) {
    if (state.patch[s] == TileState::kNoPatch) continue;
    ++counters_.samples_visible;
    count_visible(job, state.patch[s]);
    const ShadedPoint& point =
        shade_cell(job, {state.patch[s], state.triangle[s], state.b1[s], state.b2[s], 0.0f}, pixel);
    pixel_normal_[pixel] += point.normal;
    sample_color_[s] = point.color;
    sample_coverage_[s] = 1.0f;
  }
}

void DeferredShader::fill_background(const TileJob& job, const TileSamples& samples, std::size_t first,
                                     std::size_t count) {
  for (std::size_t s = first; s < first + count; ++s) {
    if (sample_coverage_[s] > 0.0f) continue;
    sample_color_[s] =
        job.has_background
            ? job.background
            : job.lighting.environment.background(view_direction(*job.frame, samples.x[s], samples.y[s]));
  }
}

// ---- Blending ---------------------------------------------------------------------------------------------------

void DeferredShader::shade_layers(const TileJob& job, const TileSamples& samples, TileState& state) {
  state.drop_hidden_layers();
  if (state.layers.empty()) return;
  counters_.blended_layers += state.layers.size();
  // Far to near within a sample; equal depths by patch and triangle.
  std::sort(state.layers.begin(), state.layers.end(), [](const TileState::Layer& a, const TileState::Layer& b) {
    return std::tie(a.sample, b.z, a.patch, a.triangle) < std::tie(b.sample, a.z, b.patch, b.triangle);
  });
  std::size_t pixel = samples.count;
  for (std::size_t begin = 0, end = 0; begin < state.layers.size(); begin = end) {
    const std::size_t s = state.layers[begin].sample, here = s / static_cast<std::size_t>(samples.spp);
    if (here != pixel) shaded_layers_.clear();
    pixel = here;
    blended_.clear();
    const bool skipped = runs_of(here) == 0;
    for (; end < state.layers.size() && state.layers[end].sample == s; ++end) {
      const TileState::Layer& layer = state.layers[end];
      if (skipped) {
        skip_layer(job, layer);
        continue;
      }
      const ShadedPoint point = shade_layer(job, samples, layer, pixel);
      blended_.push_back({point.color * point.alpha, point.alpha, layer.z, layer.patch, layer.triangle});
    }
    if (skipped) continue;
    counters_.blend_overflows += merger_.merge(blended_, job.blend_layers);
    for (const BlendedLayer& layer : blended_) {
      sample_color_[s] = sample_color_[s] * (1.0f - layer.alpha) + layer.color;
      sample_coverage_[s] = sample_coverage_[s] * (1.0f - layer.alpha) + layer.alpha;
    }
  }
}

DeferredShader::ShadedLayer* DeferredShader::shared_layer(const TileJob& job, const TileState::Layer& layer,
                                                          bool& found) {
  const bool rests = at_rest(*job.frame, layer.patch);
  const float cell_x = rests ? 0.0f : std::floor(layer.rest_x), cell_y = rests ? 0.0f : std::floor(layer.rest_y);
  for (ShadedLayer& shaded : shaded_layers_)
    if (shaded.patch == layer.patch && shaded.triangle == layer.triangle && shaded.cell_x == cell_x &&
        shaded.cell_y == cell_y) {
      found = true;
      return &shaded;
    }
  found = false;
  shaded_layers_.push_back({layer.patch, layer.triangle, cell_x, cell_y, {}});
  return &shaded_layers_.back();
}

ShadedPoint DeferredShader::shade_layer(const TileJob& job, const TileSamples& samples, const TileState::Layer& layer,
                                        std::size_t pixel) {
  const SurfaceLocation at{layer.patch, layer.triangle, layer.b1, layer.b2,
                           time_of(*job.frame, samples, layer.sample, layer.patch)};
  if (job.shading == ShadingRate::kCache) return shade_cell(job, at, pixel);
  if (job.shading == ShadingRate::kSample) return run_shader(job, at, pixel);
  bool found = false;
  ShadedLayer& shaded = *shared_layer(job, layer, found);
  if (found)
    ++counters_.pixel_shader_invocations_saved;
  else
    shaded.point = run_shader(job, at, pixel);
  return shaded.point;
}

void DeferredShader::skip_layer(const TileJob& job, const TileState::Layer& layer) {
  ++skipped_.samples;
  bool found = false;
  if (job.shading == ShadingRate::kPixel) shared_layer(job, layer, found);
  if (!found) ++skipped_.invocations;
}

// ---- Layers for the EXR file ------------------------------------------------------------------------------------

void DeferredShader::write_auxiliary(const TileSamples& samples, const TileState& state, FrameTargets& targets) const {
  const auto spp = static_cast<std::size_t>(samples.spp);
  std::size_t pixel = 0;
  for (int y = samples.pixels.y0; y < samples.pixels.y1; ++y)
    for (int x = samples.pixels.x0; x < samples.pixels.x1; ++x, ++pixel) {
      const int tx = x - targets.region.x0, ty = y - targets.region.y0;
      float nearest = std::numeric_limits<float>::infinity();
      for (std::size_t k = 0; k < spp; ++k) nearest = std::min(nearest, state.z[pixel * spp + k]);
      targets.depth.at(tx, ty)[0] = std::isinf(nearest) ? 0.0f : nearest;
      targets.patch.at(tx, ty)[0] = state.patch[pixel * spp] + 1;  // kNoPatch wraps to 0
      targets.invocations.at(tx, ty)[0] = static_cast<float>(pixel_invocations_[pixel]);
      const float length = glm::length(pixel_normal_[pixel]);
      for (int c = 0; c < 3; ++c)
        targets.normal.at(tx, ty)[static_cast<std::size_t>(c)] = length > 0 ? pixel_normal_[pixel][c] / length : 0.0f;
    }
}

}  // namespace tessera::tilecore

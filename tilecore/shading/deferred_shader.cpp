#include "tilecore/shading/deferred_shader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>

namespace tessera::tilecore {
namespace {

constexpr int kBlockSide = 8;  // pixels; what is near on screen is shaded together

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
  view_rays_.clear();
  for (std::size_t s = 0; s <= job.frame->segments.size(); ++s)
    view_rays_.emplace_back(job.frame->segment(static_cast<int>(s)));
  shade_opaque(job, samples, state);
  shade_layers(job, samples, state);
}

// ---- Pixel-shader invocations -----------------------------------------------------------------------------------

ShadedPoint DeferredShader::run_shader(const TileJob& job, const Invocation& invocation, std::size_t pixel) {
  ++counters_.pixel_shader_invocations;
  ++pixel_invocations_[pixel];
  if (!drawables_.empty())
    ++drawables_[job.frame->assembly->patch_drawable[invocation.at.patch]].pixel_shader_invocations;
  return shade_point(*job.frame, job.lighting, invocation, &textures_);
}

Invocation DeferredShader::invocation(const TileJob& job, const TileSamples& samples, const SurfaceLocation& at,
                                      float light_time, std::size_t pixel, bool rests) const {
  Invocation out{at, light_time};
  if (job.derivatives != ShadingDerivatives::kQuad || job.shading == ShadingRate::kCache) return out;
  // What moves or is defocused has a quad of its own; still, its place in it is that of its pixel on screen.
  const auto width = static_cast<std::size_t>(samples.pixels.width());
  out.partner_x = rests && pixel % width % 2 == 1 ? -1 : 1;
  out.partner_y = rests && pixel / width % 2 == 1 ? -1 : 1;
  return out;
}

const ShadedPoint& DeferredShader::shade_cell(const TileJob& job, const SurfaceLocation& at, std::size_t pixel) {
  const ShadingCell cell = cells_.cell_of(at);
  if (const ShadedPoint* found = cache_.find(cell)) {
    ++counters_.shading_cache_hits;
    ++counters_.pixel_shader_invocations_saved;
    return *found;
  }
  ++counters_.shading_cache_misses;
  return cache_.insert(cell,
                       run_shader(job, {ShadingCells::canonical_point(*job.frame, cell), ShadingCells::kTime}, pixel));
}

// ---- What is opaque ---------------------------------------------------------------------------------------------

void DeferredShader::shade_opaque(const TileJob& job, const TileSamples& samples, const TileState& state) {
  sample_color_.resize(samples.count);
  sample_coverage_.assign(samples.count, 0.0f);
  const bool quads = job.derivatives == ShadingDerivatives::kQuad && job.shading != ShadingRate::kCache;
  const int side = quads ? 2 : 1;
  // Block by block, so that neighbours in both directions find the shading cache warm.
  const int width = samples.pixels.width(), height = samples.pixels.height();
  for (int block_y = 0; block_y < height; block_y += kBlockSide)
    for (int block_x = 0; block_x < width; block_x += kBlockSide)
      for (int y = block_y; y < std::min(block_y + kBlockSide, height); y += side)
        for (int x = block_x; x < std::min(block_x + kBlockSide, width); x += side)
          shade_block(job, samples, state, x, y, side);
}

void DeferredShader::shade_block(const TileJob& job, const TileSamples& samples, const TileState& state, int x0, int y0,
                                 int side) {
  const auto spp = static_cast<std::size_t>(samples.spp);
  std::array<std::size_t, 4> pixels;
  std::array<bool, 4> split;
  std::size_t count = 0;
  for (int y = y0; y < std::min(y0 + side, samples.pixels.height()); ++y)
    for (int x = x0; x < std::min(x0 + side, samples.pixels.width()); ++x) {
      const auto pixel = static_cast<std::size_t>(y * samples.pixels.width() + x);
      if (runs_of(pixel) == 0)
        skip_pixel(job, samples, state, pixel);
      else if (job.shading == ShadingRate::kCache)
        shade_pixel_from_cells(job, samples, state, pixel);
      else
        split[count] = runs_of(pixel) == 2, pixels[count++] = pixel;
      if (runs_of(pixel) != 0 && job.shading == ShadingRate::kCache) fill_background(job, samples, pixel * spp, spp);
    }
  if (count == 0) return;
  FragmentMerger& merger = merger_of_fragments_;
  merger.group(job, samples, state, std::span(pixels).first(count), std::span(split).first(count));
  counters_.samples_visible += merger.visible();
  counters_.pixel_shader_invocations_saved += merger.visible() - merger.runs().size();
  counters_.fragments_merged += merger.merged();
  if (job.derivatives == ShadingDerivatives::kQuad) {
    counters_.quads += merger.quads();
    counters_.helper_invocations += 4 * merger.quads() - merger.runs().size();
  }
  points_.clear();
  for (const FragmentMerger::Run& run : merger.runs()) {
    const std::size_t s = run.sample, pixel = pixels[run.pixel];
    const SurfaceLocation at{state.patch[s], state.triangle[s], state.b1[s], state.b2[s],
                             time_seen(*job.frame, state.patch[s], samples.t(s))};
    points_.push_back(run_shader(job, invocation(job, samples, at, run.light_time, pixel, run.rests), pixel));
    pixel_normal_[pixel] += points_.back().normal;
  }
  for (std::size_t p = 0; p < count; ++p) {
    const std::size_t first = pixels[p] * spp;
    for (std::size_t k = 0; k < spp; ++k) {
      const std::uint32_t run = merger.run_of(p, k);
      if (run == FragmentMerger::kNoRun) continue;
      count_visible(job, state.patch[first + k]);
      sample_color_[first + k] = points_[run].color;
      sample_coverage_[first + k] = 1.0f;
    }
    fill_background(job, samples, first, spp);
  }
}

void DeferredShader::skip_pixel(const TileJob& job, const TileSamples& samples, const TileState& state,
                                std::size_t pixel) {
  const bool split = false;
  merger_of_fragments_.group(job, samples, state, std::span(&pixel, 1), std::span(&split, 1));
  const auto spp = static_cast<std::size_t>(samples.spp);
  for (std::size_t s = pixel * spp; s < (pixel + 1) * spp; ++s)
    if (state.patch[s] != TileState::kNoPatch) count_visible(job, state.patch[s]);
  const std::size_t visible = merger_of_fragments_.visible();
  counters_.samples_visible += visible;
  skipped_.samples += visible;
  skipped_.invocations += job.shading == ShadingRate::kCache ? visible : merger_of_fragments_.runs().size();
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
    sample_color_[s] = job.has_background ? job.background : background_of(job, samples, s);
  }
}

Vec3 DeferredShader::background_of(const TileJob& job, const TileSamples& samples, std::size_t s) const {
  // Its lens point is the pattern's own: tiles where nothing is out of focus have none for their samples.
  SamplePattern::LensPoint lens{0.0f, 0.0f};
  // What is behind everything turns with the camera, segment by segment.
  const int count = static_cast<int>(job.frame->segments.size()),
            segment = count == 0 ? 0 : 1 + part_of_time(samples.t(s), count);
  const scene::FrameGeometry& frame = job.frame->segment(segment);
  const auto lens_scale = static_cast<float>(frame.projection.lens_scale);
  if (lens_scale != 0.0f) {
    const auto pixel = static_cast<int>(s) / samples.spp;
    lens = job.pattern->lens(samples.pixels.x0 + pixel % samples.pixels.width(),
                             samples.pixels.y0 + pixel / samples.pixels.width(), static_cast<int>(s) % samples.spp);
  }
  return job.lighting.environment.background(view_rays_[static_cast<std::size_t>(segment)].direction(
      samples.x[s], samples.y[s], frame.part.local(samples.t(s)), lens.u * lens_scale, lens.v * lens_scale));
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
  const auto spp = static_cast<std::size_t>(samples.spp);
  layer_quads_.clear();
  for (std::size_t begin = 0, end = 0; begin < state.layers.size(); begin = end) {
    const std::size_t pixel = state.layers[begin].sample / spp;
    while (end < state.layers.size() && state.layers[end].sample / spp == pixel) ++end;
    const std::span<const TileState::Layer> layers = std::span(state.layers).subspan(begin, end - begin);
    share_layers(job, samples, layers);
    if (runs_of(pixel) == 0) {
      skipped_.samples += layers.size();
      skipped_.invocations += shared_layers_.size();
      continue;
    }
    for (std::size_t first = 0, last = 0; first < layers.size(); first = last) {
      const std::size_t s = layers[first].sample;
      blended_.clear();
      for (; last < layers.size() && layers[last].sample == s; ++last) {
        const TileState::Layer& layer = layers[last];
        const ShadedPoint point = shade_layer(job, samples, layer, shared_layers_[shared_of_[last]], pixel);
        blended_.push_back({point.color * point.alpha, point.alpha, layer.z, layer.patch, layer.triangle});
      }
      counters_.blend_overflows += merger_.merge(blended_, job.blend_layers);
      for (const BlendedLayer& layer : blended_) {
        sample_color_[s] = sample_color_[s] * (1.0f - layer.alpha) + layer.color;
        sample_coverage_[s] = sample_coverage_[s] * (1.0f - layer.alpha) + layer.alpha;
      }
    }
  }
  count_layer_quads();
}

void DeferredShader::share_layers(const TileJob& job, const TileSamples& samples,
                                  std::span<const TileState::Layer> layers) {
  const bool shares = job.shading == ShadingRate::kPixel || job.shading == ShadingRate::kPrimitive;
  shared_layers_.clear();
  shared_of_.clear();
  for (const TileState::Layer& layer : layers) {
    const bool rests = is_at_rest(*job.frame, layer.patch);
    const float cell_x = rests ? 0.0f : std::floor(layer.rest_x), cell_y = rests ? 0.0f : std::floor(layer.rest_y);
    const int segment = job.frame->segment_at(layer.patch, samples.t(layer.sample));
    std::size_t g = shares ? 0 : shared_layers_.size();
    const auto same = [&](const SharedLayer& o) {
      return o.patch == layer.patch && o.triangle == layer.triangle && o.segment == segment && o.cell_x == cell_x &&
             o.cell_y == cell_y;
    };
    while (g < shared_layers_.size() && !same(shared_layers_[g])) ++g;
    if (g == shared_layers_.size())
      shared_layers_.push_back({layer.patch, layer.triangle, segment, cell_x, cell_y, 0, 0, false, {}});
    shared_layers_[g].time_sum += samples.t(layer.sample);
    ++shared_layers_[g].count;
    shared_of_.push_back(static_cast<std::uint32_t>(g));
  }
}

ShadedPoint DeferredShader::shade_layer(const TileJob& job, const TileSamples& samples, const TileState::Layer& layer,
                                        SharedLayer& shared, std::size_t pixel) {
  const SurfaceLocation at{layer.patch, layer.triangle, layer.b1, layer.b2,
                           time_seen(*job.frame, layer.patch, samples.t(layer.sample))};
  if (job.shading == ShadingRate::kCache) return shade_cell(job, at, pixel);
  if (shared.shaded) {
    ++counters_.pixel_shader_invocations_saved;
    return shared.point;
  }
  const float light_time = shared.time_sum / static_cast<float>(shared.count);
  shared.point =
      run_shader(job, invocation(job, samples, at, light_time, pixel, is_at_rest(*job.frame, layer.patch)), pixel);
  shared.shaded = true;
  if (job.derivatives == ShadingDerivatives::kQuad) add_layer_quad(job, samples, layer);
  return shared.point;
}

void DeferredShader::add_layer_quad(const TileJob& job, const TileSamples& samples, const TileState::Layer& layer) {
  if (!is_at_rest(*job.frame, layer.patch)) {
    ++counters_.quads;
    counters_.helper_invocations += 3;
    return;
  }
  const auto spp = static_cast<std::uint32_t>(samples.spp), width = static_cast<std::uint32_t>(samples.pixels.width()),
             pixel = layer.sample / spp, block = pixel / width / 2 * ((width + 1) / 2) + pixel % width / 2;
  layer_quads_.push_back(
      {block, layer.patch, layer.triangle, job.shading == ShadingRate::kSample ? layer.sample % spp : 0});
}

void DeferredShader::count_layer_quads() {
  std::sort(layer_quads_.begin(), layer_quads_.end());
  const auto quads =
      static_cast<std::uint64_t>(std::unique(layer_quads_.begin(), layer_quads_.end()) - layer_quads_.begin());
  counters_.quads += quads;
  counters_.helper_invocations += 4 * quads - layer_quads_.size();
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

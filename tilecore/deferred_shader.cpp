#include "tilecore/deferred_shader.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace tessera::tilecore {

void DeferredShader::shade(const TileJob& job, const TileSamples& samples, TileState& state) {
  pixel_invocations_.assign(samples.count / static_cast<std::size_t>(samples.spp), 0);
  pixel_normal_.assign(pixel_invocations_.size(), Vec3(0.0f));
  shade_opaque(job, samples, state);
  shade_layers(job, samples, state);
}

void DeferredShader::shade_opaque(const TileJob& job, const TileSamples& samples, const TileState& state) {
  const frontend::FrameGeometry& frame = *job.frame;
  const auto spp = static_cast<std::size_t>(samples.spp);
  sample_color_.resize(samples.count);
  sample_coverage_.assign(samples.count, 0.0f);
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
  for (std::size_t pixel = 0; pixel < samples.count / spp; ++pixel) {
    groups.clear();
    const std::size_t first = pixel * spp;
    for (std::size_t k = 0; k < spp; ++k) {
      const std::size_t s = first + k;
      if (state.patch[s] == TileState::kNoPatch) continue;
      ++counters_.samples_visible;
      const bool at_rest = !frame.drawable_of(state.patch[s]).moving && frame.projection.lens_scale == 0;
      // A still pinhole sample sees the surface where it is itself.
      const float x = at_rest ? samples.x[s] : state.rest_x[s], y = at_rest ? samples.y[s] : state.rest_y[s];
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
      const float t = static_cast<float>(samples.time[s]) * 0x1p-8f;
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
      fill_background(job, samples, first, spp);
  }
}

void DeferredShader::fill_background(const TileJob& job, const TileSamples& samples, std::size_t first, std::size_t count) {
  for (std::size_t s = first; s < first + count; ++s) {
    if (sample_coverage_[s] > 0.0f) continue;
    sample_color_[s] = job.has_background ? job.background : job.lighting.environment.background(view_direction(*job.frame, samples.x[s], samples.y[s]));
  }
}

void DeferredShader::shade_layers(const TileJob& job, const TileSamples& samples, TileState& state) {
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
  std::size_t pixel = samples.count;
  for (const TileState::Layer& layer : state.layers) {
    const std::size_t here = layer.sample / static_cast<std::size_t>(samples.spp);
    if (here != pixel) shaded.clear();
    pixel = here;
    const bool at_rest = !frame.drawable_of(layer.patch).moving && frame.projection.lens_scale == 0;
    const float cell_x = at_rest ? 0.0f : std::floor(layer.rest_x), cell_y = at_rest ? 0.0f : std::floor(layer.rest_y);
    auto found = std::find_if(shaded.begin(), shaded.end(), [&](const Shaded& s) {
      return s.patch == layer.patch && s.triangle == layer.triangle && s.cell_x == cell_x && s.cell_y == cell_y;
    });
    if (found == shaded.end() || job.shading == ShadingRate::kSample) {
      const float t = static_cast<float>(samples.time[layer.sample]) * 0x1p-8f;
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
      for (int c = 0; c < 3; ++c) targets.normal.at(tx, ty)[static_cast<std::size_t>(c)] = length > 0 ? pixel_normal_[pixel][c] / length : 0.0f;
    }
}

}  // namespace tessera::tilecore

#include "tilecore/shading/deferred_shader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>

#include "tilecore/resolve/multisample_resolve.h"

namespace tessera::tilecore {
namespace {

constexpr int kBlockSide = 8;  // pixels; neighbours on screen are shaded together

// Whether any of a pixel's samples sees an opaque surface.
bool sees_opaque(const std::uint32_t* patch, int spp) {
  static_assert(TileState::kNoPatch == 0xFFFFFFFFu);
  std::uint32_t all = TileState::kNoPatch;
  for (int k = 0; k < spp; ++k) all &= patch[k];
  return all != TileState::kNoPatch;
}

// The way from the viewer through the middle of some pixels at shutter open, in world space.
Vec3 axis_through(const scene::FrameGeometry& frame, const IntRect& pixels) {
  const DMat4& to_world = frame.views[0].camera_to_world;
  const scene::Projection& projection = frame.projection;
  DVec3 way(0, 0, -1);
  if (!projection.orthographic)
    way = {(0.5 * (pixels.x0 + pixels.x1) - projection.center_x) / projection.scale,
           (projection.center_y - 0.5 * (pixels.y0 + pixels.y1)) / projection.scale, -1};
  return Vec3(DMat3(to_world) * way);
}

}  // namespace

void DeferredShader::begin(const TileJob& job, const TileSamples& samples, std::span<const std::uint8_t> rates) {
  rates_ = rates;
  pixel_invocations_.assign(samples.count / static_cast<std::size_t>(samples.spp), 0);
  pixel_normal_.assign(pixel_invocations_.size(), Vec3(0.0f));
  if (job.shading.rate == ShadingRate::kCache && !again_) {
    cells_.start(*job.frame, static_cast<float>(job.shading.cell_pixels));
    cache_.empty(static_cast<std::size_t>(job.shading_cache.entries));
  }
  drawable_lookup_.forget();
  view_rays_.clear();
  for (std::size_t s = 0; s <= job.frame->segments.size(); ++s)
    view_rays_.emplace_back(job.frame->segment(static_cast<int>(s)));
  // Cells that the cache holds keep their points; nothing else is asked for again.
  if (job.shading.rate != ShadingRate::kCache || !again_) points_.clear();
  kept_ = points_.size();
  invocations_.clear();
  pixel_of_invocation_.clear();
  quads_ = 0;
}

void DeferredShader::shade(const TileJob& job, const TileSamples& samples, TileState& state,
                           std::span<const std::uint8_t> rates, shaders::RadianceImage* behind) {
  begin(job, samples, rates);
  collect_opaque(job, samples, state);
  opaque_ = invocations_.size();
  collect_layers(job, samples, state);
  run_warps(job, samples.pixels);
  color_samples(job, samples);
  if (behind != nullptr) keep_behind(samples, *behind);
  blend_layers(job, state);
}

std::uint64_t DeferredShader::fill(const TileJob& job, const TileSamples& samples, TileState& state) {
  begin(job, samples, {});
  collect_opaque(job, samples, state);
  opaque_ = invocations_.size();
  collect_layers(job, samples, state);
  fill_warps(job, samples.pixels);
  constexpr std::uint64_t kNumberBytes = 4;  // of a listed light
  return kNumberBytes * pixel_shader_.listed_lights();
}

void DeferredShader::light(const TileJob& job, const TileSamples& samples, TileState& state) {
  // Records name patches, whose attributes are read again.
  if (job.shading.layout == GbufferLayout::kExact)
    for (std::size_t i = 0; i < invocations_.size(); ++i)
      if (pixel_shader_.filled()[i] != 0) reads_patch(invocations_[i].at.patch);
  light_warps(job);
  color_samples(job, samples);
  blend_layers(job, state);
}

void DeferredShader::shade_again(const TileJob& job, const TileSamples& samples, TileState& state,
                                 std::span<const std::uint8_t> mask) {
  std::swap(first_color_, sample_color_), std::swap(first_coverage_, sample_coverage_);
  std::swap(first_normal_, pixel_normal_), std::swap(first_invocations_, pixel_invocations_);
  again_ = true;
  shade(job, samples, state, mask);
  again_ = false;
  const auto spp = static_cast<std::size_t>(samples.spp);
  for (std::size_t pixel = 0; pixel < mask.size(); ++pixel) {
    if (mask[pixel] == 0) continue;
    std::copy_n(&sample_color_[pixel * spp], spp, &first_color_[pixel * spp]);
    std::copy_n(&sample_coverage_[pixel * spp], spp, &first_coverage_[pixel * spp]);
    first_normal_[pixel] = pixel_normal_[pixel], first_invocations_[pixel] = pixel_invocations_[pixel];
  }
  std::swap(first_color_, sample_color_), std::swap(first_coverage_, sample_coverage_);
  std::swap(first_normal_, pixel_normal_), std::swap(first_invocations_, pixel_invocations_);
}

void DeferredShader::shade_opaque(const TileJob& job, const TileSamples& samples, const TileState& state,
                                  shaders::RadianceImage& behind) {
  begin(job, samples, {});
  collect_opaque(job, samples, state);
  opaque_ = invocations_.size();
  run_warps(job, samples.pixels);
  color_samples(job, samples);
  keep_behind(samples, behind);
}

void DeferredShader::keep_behind(const TileSamples& samples, shaders::RadianceImage& image) const {
  std::size_t first = 0;
  for (int y = samples.pixels.y0; y < samples.pixels.y1; ++y)
    for (int x = samples.pixels.x0; x < samples.pixels.x1; ++x, first += static_cast<std::size_t>(samples.spp))
      image.set(0, x, y, Vec3(mean_of_samples(&sample_color_[first], &sample_coverage_[first], samples.spp)));
}

// ---- Pixel-shader invocations -----------------------------------------------------------------------------------

Invocation& DeferredShader::add_invocation(const TileJob& job, std::uint32_t patch, std::size_t pixel) {
  ++counters_.pixel_shader_invocations;
  ++pixel_invocations_[pixel];
  reads_patch(patch);
  if (!drawables_.empty()) ++drawables_[drawable_of(job, patch)].pixel_shader_invocations;
  pixel_of_invocation_.push_back(static_cast<std::uint32_t>(pixel));
  return invocations_.emplace_back();
}

std::vector<std::uint32_t> DeferredShader::take_patches_read() {
  std::sort(patches_read_.begin(), patches_read_.end());
  patches_read_.erase(std::unique(patches_read_.begin(), patches_read_.end()), patches_read_.end());
  return std::exchange(patches_read_, {});
}

std::uint32_t DeferredShader::ask_for(const TileJob& job, const Invocation& invocation, std::size_t pixel) {
  add_invocation(job, invocation.at.patch, pixel) = invocation;
  return static_cast<std::uint32_t>(kept_ + invocations_.size() - 1);
}

void DeferredShader::run_warps(const TileJob& job, const IntRect& pixels) {
  if (job.shading.has_gbuffer()) {
    fill_warps(job, pixels);
    light_warps(job);
    return;
  }
  points_.resize(kept_ + invocations_.size());
  const bool lists = has_light_lists(*job.frame, job.shading.light_lists);
  const Vec3 axis = lists ? axis_through(*job.frame, pixels) : Vec3(0.0f);
  pixel_shader_.shade(*job.frame, job.lighting, invocations_, std::span(points_).subspan(kept_), &textures_,
                      job.warp_lanes(), lists ? &axis : nullptr);
  count_warps();
}

void DeferredShader::fill_warps(const TileJob& job, const IntRect& pixels) {
  points_.resize(kept_ + invocations_.size());
  const bool lists = has_light_lists(*job.frame, job.shading.light_lists);
  const Vec3 axis = lists ? axis_through(*job.frame, pixels) : Vec3(0.0f);
  pixel_shader_.fill(*job.frame, job.lighting, invocations_, std::span(points_).subspan(kept_), &textures_,
                     job.warp_lanes(), lists ? &axis : nullptr, halves_of(job.shading));
  count_warps();
  const std::span<const std::uint8_t> filled = pixel_shader_.filled();
  const auto fills = [&](std::uint32_t point) { return point != kNone && filled[point - kept_] != 0; };
  const auto invocations = static_cast<std::uint64_t>(std::ranges::count(filled, 1)),
             samples = static_cast<std::uint64_t>(std::ranges::count_if(sample_point_, fills));
  gbuffer_.filled += invocations;
  gbuffer_.samples += samples;
  gbuffer_.tile_bytes += (samples + invocations) * job.shading.gbuffer_bytes();
  // The light half finds the triangles of records once more.
  if (job.shading.layout == GbufferLayout::kExact) gbuffer_.tile_bytes += TriangleTable::kRecordBytes * invocations;
}

void DeferredShader::light_warps(const TileJob& job) {
  pixel_shader_.light(*job.frame, job.lighting, invocations_, std::span(points_).subspan(kept_), &textures_,
                      job.warp_lanes(), halves_of(job.shading));
  gbuffer_.light_warps += pixel_shader_.take_light_warps();
  gbuffer_.light_lookups += pixel_shader_.take_light_lookups();
  count_warps();
}

void DeferredShader::count_warps() {
  counters_.warps += pixel_shader_.take_warps();
  const PixelShader::SurfaceWork again = pixel_shader_.take_surface_work();
  counters_.surface_warps += again.warps;
  counters_.surface_evaluations += again.evaluations;
  counters_.height_lookups += again.height_lookups;
  counters_.vertex_outputs += again.vertices;
  counters_.vertex_output_warps += again.vertex_warps;
  counters_.vertex_output_bytes += again.vertex_bytes_moved;
  vertex_bytes_ += again.vertex_bytes;
}

void DeferredShader::set_partners(const TileJob& job, const TileSamples& samples, std::size_t pixel, bool rests,
                                  Invocation& out) const {
  if (job.shading.derivatives != ShadingDerivatives::kQuad || job.shading.rate == ShadingRate::kCache) return;
  // A moving or defocused surface has a quad of its own; its place in the quad is still its pixel's place on screen.
  const auto width = static_cast<std::size_t>(samples.pixels.width());
  out.partner_x = rests && pixel % width % 2 == 1 ? -1 : 1;
  out.partner_y = rests && pixel / width % 2 == 1 ? -1 : 1;
}

std::uint32_t DeferredShader::ask_for_cell(const TileJob& job, const SurfaceLocation& at, std::size_t pixel) {
  const ShadingCell cell = cells_.cell_of(at);
  const std::uint32_t found = cache_.find(cell);
  if (found != ShadingCache::kNone) {
    ++counters_.pixel_shader_invocations_saved;
    return found;
  }
  const std::uint32_t number =
      ask_for(job, {ShadingCells::canonical_point(*job.frame, cell), ShadingCells::kTime}, pixel);
  cache_.insert(cell, number);
  return number;
}

// ---- Opaque surfaces ---------------------------------------------------------------------------------------------

void DeferredShader::collect_opaque(const TileJob& job, const TileSamples& samples, const TileState& state) {
  sample_point_.assign(samples.count, kNone);
  const bool quads = job.shading.derivatives == ShadingDerivatives::kQuad && job.shading.rate != ShadingRate::kCache;
  const int side = quads ? 2 : 1;
  // Block by block, so that neighbours in both directions find the shading cache warm.
  const int width = samples.pixels.width(), height = samples.pixels.height();
  for (int block_y = 0; block_y < height; block_y += kBlockSide)
    for (int block_x = 0; block_x < width; block_x += kBlockSide)
      for (int y = block_y; y < std::min(block_y + kBlockSide, height); y += side)
        for (int x = block_x; x < std::min(block_x + kBlockSide, width); x += side)
          if (side > 1 ||
              sees_opaque(&state.patch[static_cast<std::size_t>((y * width + x) * samples.spp)], samples.spp))
            collect_block(job, samples, state, x, y, side);
}

void DeferredShader::collect_block(const TileJob& job, const TileSamples& samples, const TileState& state, int x0,
                                   int y0, int side) {
  const auto spp = static_cast<std::size_t>(samples.spp);
  std::array<std::size_t, 4> pixels;
  std::array<bool, 4> split;
  std::size_t count = 0;
  for (int y = y0; y < std::min(y0 + side, samples.pixels.height()); ++y)
    for (int x = x0; x < std::min(x0 + side, samples.pixels.width()); ++x) {
      const auto pixel = static_cast<std::size_t>(y * samples.pixels.width() + x);
      if (rate_of(pixel) == kSkipped) {
        if (!again_) skip_pixel(job, samples, state, pixel);
      } else if (job.shading.rate == ShadingRate::kCache) {
        collect_cells(job, samples, state, pixel);
      } else {
        split[count] = rate_of(pixel) == kHalvesApart, pixels[count++] = pixel;
      }
    }
  if (count == 0) return;
  FragmentMerger& merger = merger_of_fragments_;
  merger.group(job, samples, state, std::span(pixels).first(count), std::span(split).first(count));
  if (again_)
    unskip(merger.visible(), merger.runs().size());
  else
    counters_.samples_visible += merger.visible();
  counters_.fragments_merged += merger.merged();
  if (!state.layout.parameters) counters_.places_found += merger.places();
  if (job.shading.derivatives == ShadingDerivatives::kQuad) {
    counters_.quads += merger.quads();
    counters_.helper_invocations += 4 * merger.quads() - merger.runs().size();
  }
  const auto first_point = static_cast<std::uint32_t>(kept_ + invocations_.size());
  for (const FragmentMerger::Run& run : merger.runs()) {
    const std::size_t s = run.sample, pixel = pixels[run.pixel];
    const std::uint32_t patch = state.patch[s];
    // Filled in place: a copy would wait for the values just written.
    Invocation& asked = add_invocation(job, patch, pixel);
    asked.at.patch = patch, asked.at.triangle = state.triangle[s];
    asked.at.b1 = state.b1[s], asked.at.b2 = state.b2[s];
    asked.at.t = run.moves && !run.rests ? samples.t(s) : 0.0f;
    asked.light_time = run.light_time;
    asked.quad = quads_ + run.quad;
    set_partners(job, samples, pixel, run.rests, asked);
  }
  quads_ += static_cast<std::uint32_t>(merger.quads());
  for (std::size_t p = 0; p < count; ++p) {
    const std::size_t first = pixels[p] * spp;
    for (std::size_t k = 0; k < spp; ++k) {
      const std::uint32_t run = merger.run_of(p, k);
      if (run == FragmentMerger::kNoRun) continue;
      if (!again_) count_visible(job, state.patch[first + k]);
      sample_point_[first + k] = first_point + run;
    }
  }
  counters_.pixel_shader_invocations_saved += merger.visible() - merger.runs().size();
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
  skipped_.invocations += job.shading.rate == ShadingRate::kCache ? visible : merger_of_fragments_.runs().size();
}

void DeferredShader::collect_cells(const TileJob& job, const TileSamples& samples, const TileState& state,
                                   std::size_t pixel) {
  const auto spp = static_cast<std::size_t>(samples.spp);
  for (std::size_t s = pixel * spp; s < (pixel + 1) * spp; ++s) {
    if (state.patch[s] == TileState::kNoPatch) continue;
    if (again_) {
      unskip(1, 1);
    } else {
      ++counters_.samples_visible;
      count_visible(job, state.patch[s]);
    }
    sample_point_[s] = ask_for_cell(job, {state.patch[s], state.triangle[s], state.b1[s], state.b2[s], 0.0f}, pixel);
  }
}

void DeferredShader::color_samples(const TileJob& job, const TileSamples& samples) {
  sample_color_.resize(samples.count);
  sample_coverage_.resize(samples.count);
  behind_.clear();
  const auto spp = static_cast<std::size_t>(samples.spp);
  for (std::size_t s = 0, pixel = 0; s < samples.count; ++pixel)
    for (const std::size_t end = s + spp; s < end; ++s) {
      const std::uint32_t point = sample_point_[s];
      sample_coverage_[s] = point == kNone ? 0.0f : 1.0f;
      if (point == kNone) {
        // Samples of skipped pixels have no colour.
        if (rate_of(pixel) != kSkipped) behind_.push_back(static_cast<std::uint32_t>(s));
        continue;
      }
      sample_color_[s] = points_[point].color;
      if (job.shading.rate == ShadingRate::kCache) pixel_normal_[pixel] += points_[point].normal;
    }
  if (job.background) {
    for (const std::uint32_t s : behind_) sample_color_[s] = *job.background;
  } else {
    // The background turns with the camera, segment by segment.
    const int segments = static_cast<int>(job.frame->segments.size());
    for (int segment = std::min(segments, 1); segment <= segments; ++segment) color_background(job, samples, segment);
  }
  if (job.shading.rate == ShadingRate::kCache) return;
  for (std::size_t i = 0; i < opaque_; ++i) pixel_normal_[pixel_of_invocation_[i]] += points_[kept_ + i].normal;
}

void DeferredShader::color_background(const TileJob& job, const TileSamples& samples, int segment) {
  const scene::FrameGeometry& frame = job.frame->segment(segment);
  const int width = samples.pixels.width();
  const auto lens_scale = static_cast<float>(frame.projection.lens_scale);
  auto& [x, y, t, lens_u, lens_v] = view_points_;
  std::array<std::uint32_t, kBackgroundBatch> seen;
  std::array<Vec3, kBackgroundBatch> colors;
  const shaders::Surroundings& around = job.lighting.environment.surroundings();
  const bool told = around.kind == shaders::Surroundings::Kind::kImage && textures_.active();
  LookupArrays lookups;
  if (told) {
    constexpr std::size_t kSlot = slot_of(ImageLookup::kMirrored);
    lookups.layout[kSlot] = &textures_.memory()->layout(around.image->radiance);
    for (std::size_t line = 0; line < kLookupLines; ++line) lookups.line[kSlot][line] = background_lines_[line].data();
  }
  const ViewRays& rays = view_rays_[static_cast<std::size_t>(segment)];
  const bool computed = around.kind != shaders::Surroundings::Kind::kUniform;
  const timing::WarpItem item =
      computed ? background_item(around.kind == shaders::Surroundings::Kind::kImage, rays.turning())
               : timing::WarpItem();
  int last_pixel = -1;
  const SamplePattern::LensPoint* lenses = nullptr;  // of its samples
  for (std::size_t next = 0; next < behind_.size();) {
    std::size_t count = 0;
    for (; next < behind_.size() && count < kBackgroundBatch; ++next) {
      const std::uint32_t s = behind_[next];
      const float time = samples.t(s);
      if (segment != 0 && job.frame->segment_of(time) != segment) continue;
      // Its lens point is the pattern's own: tiles where nothing is out of focus have none for their samples.
      SamplePattern::LensPoint lens{0.0f, 0.0f};
      if (lens_scale != 0.0f) {
        const int pixel = static_cast<int>(s) / samples.spp;
        if (pixel != last_pixel) {
          last_pixel = pixel;
          lenses = job.pattern->lenses(samples.pixels.x0 + pixel % width, samples.pixels.y0 + pixel / width);
        }
        lens = lenses[static_cast<int>(s) - pixel * samples.spp];
      }
      seen[count] = s;
      x[count] = samples.x[s], y[count] = samples.y[s], t[count] = frame.part.local(time);
      lens_u[count] = lens.u * lens_scale, lens_v[count] = lens.v * lens_scale;
      ++count;
    }
    // Lanes up to the next multiple of the widest vector.
    for (std::size_t lane = count; lane % 16 != 0; ++lane)
      for (auto& values : view_points_) values[lane] = values[count - 1];
    rays.background({x.data(), y.data(), t.data(), lens_u.data(), lens_v.data()}, count, around, lookups,
                    colors.data());
    if (computed) {
      counters_.background_samples += count;
      counters_.background_warps += pixel_shader_.pack_background(count, item, lookups, textures_, job.warp_lanes());
    }
    for (std::size_t i = 0; i < count; ++i) sample_color_[seen[i]] = colors[i];
  }
}

// ---- Blending ---------------------------------------------------------------------------------------------------

void DeferredShader::collect_layers(const TileJob& job, const TileSamples& samples, TileState& state) {
  state.drop_hidden_layers();
  layer_point_.assign(state.layers.size(), kNone);
  if (state.layers.empty()) return;
  if (!again_) counters_.blended_layers += state.layers.size();
  // Far to near within a sample; equal depths by patch and triangle.
  std::sort(state.layers.begin(), state.layers.end(), [](const TileState::Layer& a, const TileState::Layer& b) {
    return std::tie(a.sample, b.z, a.patch, a.triangle, a.b1, a.b2) <
           std::tie(b.sample, a.z, b.patch, b.triangle, b.b1, b.b2);
  });
  const auto spp = static_cast<std::size_t>(samples.spp);
  layer_quads_.clear();
  for (std::size_t begin = 0, end = 0; begin < state.layers.size(); begin = end) {
    const std::size_t pixel = state.layers[begin].sample / spp;
    while (end < state.layers.size() && state.layers[end].sample / spp == pixel) ++end;
    const std::span<const TileState::Layer> layers = std::span(state.layers).subspan(begin, end - begin);
    share_layers(job, samples, layers);
    if (rate_of(pixel) == kSkipped) {
      if (again_) continue;
      skipped_.samples += layers.size();
      skipped_.invocations += shared_layers_.size();
      continue;
    }
    if (again_) unskip(layers.size(), shared_layers_.size());
    if (!state.layout.parameters) counters_.places_found += layer_places_;
    for (std::size_t i = 0; i < layers.size(); ++i)
      layer_point_[begin + i] = ask_for_layer(job, samples, layers[i], shared_layers_[shared_of_[i]], pixel);
  }
  number_layer_quads();
}

void DeferredShader::blend_layers(const TileJob& job, const TileState& state) {
  for (std::size_t first = 0, last = 0; first < state.layers.size(); first = last) {
    const std::size_t s = state.layers[first].sample;
    blended_.clear();
    for (; last < state.layers.size() && state.layers[last].sample == s; ++last) {
      if (layer_point_[last] == kNone) continue;
      const TileState::Layer& layer = state.layers[last];
      const ShadedPoint& point = points_[layer_point_[last]];
      blended_.push_back({point.color * point.alpha, point.alpha, layer.z, layer.patch, layer.triangle});
    }
    if (blended_.empty()) continue;
    counters_.blend_overflows += merger_.merge(blended_, job.blend_layers());
    for (const BlendedLayer& layer : blended_) {
      sample_color_[s] = sample_color_[s] * (1.0f - layer.alpha) + layer.color;
      sample_coverage_[s] = sample_coverage_[s] * (1.0f - layer.alpha) + layer.alpha;
    }
  }
}

void DeferredShader::share_layers(const TileJob& job, const TileSamples& samples,
                                  std::span<const TileState::Layer> layers) {
  const bool shares = job.shading.rate == ShadingRate::kPixel || job.shading.rate == ShadingRate::kPrimitive;
  shared_layers_.clear();
  shared_of_.clear();
  layer_places_ = 0;
  for (const TileState::Layer& layer : layers) {
    const bool rests = is_at_rest(*job.frame, layer.patch);
    const float cell_x = rests ? 0.0f : std::floor(layer.rest_x), cell_y = rests ? 0.0f : std::floor(layer.rest_y);
    layer_places_ += shares && !rests ? 1 : 0;
    const int segment = job.frame->segment_at(layer.patch, samples.t(layer.sample));
    std::size_t g = shares ? 0 : shared_layers_.size();
    const auto same = [&](const SharedLayer& o) {
      return o.patch == layer.patch && o.triangle == layer.triangle && o.segment == segment && o.cell_x == cell_x &&
             o.cell_y == cell_y;
    };
    while (g < shared_layers_.size() && !same(shared_layers_[g])) ++g;
    if (g == shared_layers_.size())
      shared_layers_.push_back({layer.patch, layer.triangle, segment, cell_x, cell_y, 0, 0, kNone});
    shared_layers_[g].time_sum += samples.t(layer.sample);
    ++shared_layers_[g].count;
    shared_of_.push_back(static_cast<std::uint32_t>(g));
  }
}

std::uint32_t DeferredShader::ask_for_layer(const TileJob& job, const TileSamples& samples,
                                            const TileState::Layer& layer, SharedLayer& shared, std::size_t pixel) {
  const SurfaceLocation at{layer.patch, layer.triangle, layer.b1, layer.b2,
                           time_seen(*job.frame, layer.patch, samples.t(layer.sample))};
  if (job.shading.rate == ShadingRate::kCache) return ask_for_cell(job, at, pixel);
  if (shared.point != kNone) {
    ++counters_.pixel_shader_invocations_saved;
    return shared.point;
  }
  const float light_time = shared.time_sum / static_cast<float>(shared.count);
  const bool rests = is_at_rest(*job.frame, layer.patch);
  Invocation asked{at, light_time};
  set_partners(job, samples, pixel, rests, asked);
  shared.point = ask_for(job, asked, pixel);
  if (job.shading.derivatives == ShadingDerivatives::kQuad) add_layer_quad(job, samples, layer, shared.point);
  return shared.point;
}

void DeferredShader::add_layer_quad(const TileJob& job, const TileSamples& samples, const TileState::Layer& layer,
                                    std::uint32_t point) {
  if (!is_at_rest(*job.frame, layer.patch)) {
    ++counters_.quads;
    counters_.helper_invocations += 3;
    invocations_[point - kept_].quad = quads_++;
    return;
  }
  const auto spp = static_cast<std::uint32_t>(samples.spp), width = static_cast<std::uint32_t>(samples.pixels.width()),
             pixel = layer.sample / spp, block = pixel / width / 2 * ((width + 1) / 2) + pixel % width / 2;
  layer_quads_.push_back(
      {block, layer.patch, layer.triangle, job.shading.rate == ShadingRate::kSample ? layer.sample % spp : 0, point});
}

void DeferredShader::number_layer_quads() {
  std::sort(layer_quads_.begin(), layer_quads_.end());
  for (std::size_t i = 0; i < layer_quads_.size(); ++i) {
    const bool opens = i == 0 || !layer_quads_[i].same_quad(layer_quads_[i - 1]);
    if (opens) ++counters_.quads, counters_.helper_invocations += 4, ++quads_;
    --counters_.helper_invocations;
    invocations_[layer_quads_[i].point - kept_].quad = quads_ - 1;
  }
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

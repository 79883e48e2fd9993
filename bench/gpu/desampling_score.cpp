#include "bench/gpu/desampling_score.h"

#include <algorithm>
#include <cmath>
#include <ctime>

#include <fmt/format.h>

#include "base/image_metrics.h"
#include "gpu/configuration.h"
#include "shaders_cpp/tone_map.h"

namespace tessera::bench {
namespace {

using gpu::Device;
using gpu::FrameResult;

// Processor time of all threads of the program.
double process_seconds() {
  std::timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

}  // namespace

scene::Capture read_shipped(const std::string& name) {
  return scene::read_capture(std::filesystem::path(TESSERA_SOURCE_DIR) / "captures" / (name + ".glb"));
}

Device renderer_of(const scene::Capture& capture, const Shot& shot, const Sets& sets, bool images) {
  gpu::RunSettings settings;
  gpu::GpuConfiguration gpu;
  for (const std::string& text : sets) gpu::apply_setting(text, settings, gpu);
  gpu::RenderRequest request;
  request.width = shot.width, request.height = shot.height;
  request.region = {0, 0, shot.width, shot.height};
  request.resolve_auxiliary = request.error = images;
  return {capture, gpu, settings, request};
}

Image shown(const Image8& display) {
  Image out(display.width, display.height, 3);
  std::transform(display.values.begin(), display.values.end(), out.values.begin(),
                 [](std::uint8_t v) { return static_cast<float>(v) / 255.0f; });
  return out;
}

double rmse(const Image& a, const Image& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.values.size(); ++i) {
    const double d = static_cast<double>(a.values[i]) - static_cast<double>(b.values[i]);
    sum += d * d;
  }
  return std::sqrt(sum / static_cast<double>(a.values.size()));
}

Reference render_reference(const scene::Capture& capture, const Shot& shot, bool keep_linear) {
  Reference out;
  Device r = renderer_of(capture, shot, {});
  for (int f = shot.first; f < shot.last; ++f) {
    FrameResult frame = r.render(f);
    out.display.push_back(shaders::to_display(frame.targets.color, capture.settings.exposure));
    out.invocations.push_back(frame.counters.shading.pixel_shader_invocations);
    if (keep_linear) out.linear.push_back(std::move(frame.targets.color));
  }
  return out;
}

double Score::worst_psnr() const { return *std::min_element(frame_psnr.begin(), frame_psnr.end()); }

Score score(const scene::Capture& capture, const Shot& shot, const Sets& sets, const Reference& reference) {
  Score s;
  Device r = renderer_of(capture, shot, sets);
  double shaded = 0, full = 0, resolve = 0, tiles = 0, frames = 0, perceptual = 0;
  for (int f = shot.first; f < shot.last; ++f) {
    const auto i = static_cast<std::size_t>(f - shot.first);
    const double begin = process_seconds();
    FrameResult frame = r.render(f);
    frames += process_seconds() - begin;
    const auto runs = static_cast<double>(frame.counters.shading.pixel_shader_invocations),
               all = static_cast<double>(reference.invocations[i]);
    shaded += runs, full += all;
    s.frame_saved.push_back(1 - runs / all);
    resolve += frame.stage_seconds["resolve_threads"], tiles += frame.stage_seconds["tile_threads"];
    const Image a = shown(reference.display[i]),
                b = shown(shaders::to_display(frame.targets.color, capture.settings.exposure));
    s.frame_psnr.push_back(std::min(kIdenticalDecibel, psnr(a, b)));
    s.psnr += s.frame_psnr.back();
    if (i % 6 != 5) continue;
    s.ssim += mssim(a, b);
    s.flip += mean_value(flip_map(a, b));
    ++perceptual;
  }
  const double n = shot.last - shot.first;
  s.saved = 1 - shaded / full;
  s.psnr /= n, s.ssim /= std::max(1.0, perceptual), s.flip /= std::max(1.0, perceptual);
  s.resolve_of_tiles = tiles > 0 ? resolve / tiles : 0;
  s.resolve_of_frame = frames > 0 ? resolve / frames : 0;
  return s;
}

Sets speeds(double reuse, double half_rate, double quarter_rate) {
  return {fmt::format("resolve.reuse_speed={}", reuse), fmt::format("resolve.half_rate_speed={}", half_rate),
          fmt::format("resolve.quarter_rate_speed={}", quarter_rate)};
}

Sets adaptive(Sets more) {
  more.insert(more.begin(), "resolve.desampling=adaptive");
  return more;
}

}  // namespace tessera::bench

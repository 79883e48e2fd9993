#pragma once

#include "base/image_metrics.h"
#include "gpu/device.h"
#include "scene/capture_reader.h"
#include "tests/support/displayed_image.h"
#include "tests/support/fault_scenes.h"
#include "tests/support/tests.h"

// Frames of a capture, adaptive beside fully shaded, as a display shows them.
namespace tessera::replay {

struct DesampledComparison {
  static constexpr int kWidth = test::kFaultWidth, kHeight = test::kFaultHeight;

  struct Frame {
    Image shown, expected;
    double psnr_db, saved;  // of pixel-shader invocations
    tilecore::DesamplingCounters counters;
    std::string advection;
  };
  std::vector<Frame> frames;

  DesampledComparison(const scene::Capture& capture, int first, int last, const std::vector<std::string>& sets = {},
                      IntRect region = {0, 0, kWidth, kHeight}) {
    gpu::RunSettings plain, desampled;
    gpu::GpuConfiguration gpu;
    desampled.resolve.desampling = tilecore::Desampling::kAdaptive;
    for (const std::string& text : sets) gpu::apply_setting(text, desampled, gpu);
    const gpu::RenderRequest request{kWidth, kHeight, region};
    gpu::Device full(capture, gpu, plain, request), device(capture, gpu, desampled, request);
    for (int f = first; f < last; ++f) {
      const gpu::FrameResult expected = full.render(f), got = device.render(f);
      Frame frame{
          test::displayed(got.targets.color), test::displayed(expected.targets.color), 0, 0, got.counters.desampling,
          got.effect_reasons.at("advection")};
      frame.psnr_db = psnr(frame.shown, frame.expected);
      const auto all = static_cast<double>(expected.counters.shading.pixel_shader_invocations);
      frame.saved = 1 - static_cast<double>(got.counters.shading.pixel_shader_invocations) / all;
      frames.push_back(std::move(frame));
    }
  }

  const Frame& back() const { return frames.back(); }
  double worst_psnr(std::size_t from) const {
    double worst = std::numeric_limits<double>::infinity();
    for (std::size_t f = from; f < frames.size(); ++f) worst = std::min(worst, frames[f].psnr_db);
    return worst;
  }
  double saved(std::size_t from) const {
    double sum = 0;
    for (std::size_t f = from; f < frames.size(); ++f) sum += frames[f].saved;
    return sum / static_cast<double>(frames.size() - from);
  }

  // Root mean square errors of pixels at most `reach` pixels from a border between tiles, and of the other pixels.
  struct Seams {
    double at_borders, inside;
    double ratio() const { return at_borders / inside; }
  };
  Seams seams(std::size_t from, int tile, int reach = 2) const {
    double sum[2] = {0, 0}, count[2] = {0, 0};
    for (std::size_t f = from; f < frames.size(); ++f)
      for (int y = 0; y < frames[f].shown.height; ++y)
        for (int x = 0; x < frames[f].shown.width; ++x) {
          const auto near = [&](int v, int end) {
            const int in = v % tile;
            return (in < reach && v >= tile) || (in >= tile - reach && v < end / tile * tile);
          };
          const bool inside = !near(x, frames[f].shown.width - 1) && !near(y, frames[f].shown.height - 1);
          for (std::size_t c = 0; c < 3; ++c) {
            const double d =
                static_cast<double>(frames[f].shown.at(x, y)[c]) - static_cast<double>(frames[f].expected.at(x, y)[c]);
            sum[inside] += d * d, count[inside] += 1;
          }
        }
    return {std::sqrt(sum[0] / count[0]), std::sqrt(sum[1] / count[1])};
  }
};

}  // namespace tessera::replay

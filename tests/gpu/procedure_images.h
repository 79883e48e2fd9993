#pragma once

#include "base/image_metrics.h"
#include "base/simd_targets.h"
#include "gpu/device.h"
#include "tests/support/displayed_image.h"
#include "tests/support/procedures.h"
#include "tests/support/tests.h"

namespace tessera::gpu {

// Frames of procedures, for comparing them.

using Settings = tilecore::ProcedureSettings;

struct Ways {
  Settings::Path path = Settings::Path::kSampled;
  int tile = 32;
  std::size_t threads = 0;
  std::string simd = "";
  int spp = 16;
  bool motion = true;
  Settings::Style style = Settings::Style::kSurface;
  std::int64_t buffer_bytes = 10 << 20;
  binner::FullPolicy full_policy = binner::FullPolicy::kPartialRender;
  Settings procedures{};  // but for path and style
  double edge_pixels = 1.5;
};

inline FrameResult render(const scene::Capture& capture, const Ways& ways, int width = 160, int height = 90) {
  const ThreadLimit threads(ways.threads);
  force_simd_target(ways.simd);
  gpu::GpuConfiguration gpu;
  gpu.tile.width = gpu.tile.height = ways.tile;
  gpu.parameter_buffer.bytes = ways.buffer_bytes;
  gpu.parameter_buffer.full_policy = ways.full_policy;
  RunSettings settings;
  settings.procedures = ways.procedures;
  settings.procedures.path = ways.path;
  settings.procedures.style = ways.style;
  settings.sampling.samples_per_pixel = ways.spp;
  settings.tessellation.target_edge_pixels = ways.edge_pixels;
  if (!ways.motion) settings.effects.motion = gpu::EffectMode::kOff;
  Device renderer(capture, gpu, settings, {width, height, {0, 0, width, height}, true});
  FrameResult result = renderer.render(capture.settings.first_frame);
  force_simd_target("");
  return result;
}

inline double decibels(const FrameResult& a, const FrameResult& b) {
  return psnr(test::displayed(a.targets.color), test::displayed(b.targets.color));
}

// Stripes of two colours, every second of which is a hole where alpha counts.
inline std::shared_ptr<const shaders::Texture> stripes() {
  Image8 image(64, 64, 4);
  for (std::size_t at = 0; at < image.values.size(); at += 4) {
    const std::size_t x = at / 4 % 64, y = at / 256;
    const bool hole = (x / 8 + y / 16) % 2 == 1;
    image.values[at] = hole ? 40 : 230;
    image.values[at + 1] = static_cast<std::uint8_t>(4 * y);
    image.values[at + 2] = static_cast<std::uint8_t>(4 * x);
    image.values[at + 3] = hole ? 0 : 255;
  }
  return std::make_shared<const shaders::Texture>(DecodedImage{image}, shaders::ColorSpace::kSrgb);
}

}  // namespace tessera::gpu

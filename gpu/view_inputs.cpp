#include "gpu/view_inputs.h"

#include "tilecore/visibility/ray_effects.h"

namespace tessera::gpu {

scene::CameraChoice frame_camera(const scene::Capture& capture, const RunSettings& settings, int width, int height) {
  const scene::CaptureSettings& own = capture.settings;
  scene::CameraChoice choice = scene::choose_camera(capture, own.first_frame / own.frame_rate, width, height);
  if (settings.defocus == "off" || !tilecore::kGeneralEffects) choice.camera.lens.aperture_radius = 0;
  return choice;
}

scene::FrameRequest frame_request(const scene::Capture& capture, const hardware::GpuConfiguration& gpu,
                                  const RunSettings& settings, int width, int height, int frame) {
  const scene::CaptureSettings& own = capture.settings;
  scene::FrameRequest request;
  request.width = width;
  request.height = height;
  request.open_time = (frame + own.shutter_open) / own.frame_rate;
  request.close_time = settings.motion == "off" || !tilecore::kGeneralEffects
                           ? request.open_time
                           : (frame + own.shutter_close) / own.frame_rate;
  request.tessellation.target_edge_pixels = settings.target_edge_pixels;
  request.tessellation.displacement_bias = settings.displacement_bias;
  request.max_factor = static_cast<int>(gpu.tessellator_max_factor);
  request.subpixel_bits = static_cast<int>(gpu.tessellator_subpixel_bits);
  request.half_attributes = settings.shading_attributes == "half";
  request.draw_lines = settings.procedures_style == "lines";
  request.sample_procedures = settings.procedures_path == "sampled";
  request.displacement = settings.displacement != "off" && tilecore::kGeneralEffects;
  request.alpha_test = settings.alpha_test != "off";
  request.blending = settings.blending != "off";
  request.procedures = settings.procedures != "off";
  return request;
}

tilecore::SamplingSettings sampling_settings(const RunSettings& settings, int frame) {
  return {static_cast<int>(settings.samples_per_pixel),
          static_cast<std::uint32_t>(settings.seed),
          static_cast<std::uint32_t>(frame),
          settings.temporal_pattern == "32x32" ? 32 : 8,
          settings.time_bits == "16" ? 16 : 8,
          static_cast<int>(settings.lens_points)};
}

tilecore::Lighting frame_lighting(const scene::Capture& capture) {
  // An asset with lights of its own keeps a little of the environment, so that nothing is black.
  return {shaders::Environment(capture.settings.environment.value_or(capture.lights.empty() ? 1.0f : 0.3f))};
}

std::optional<Vec3> frame_background(const scene::Capture& capture) {
  if (!capture.settings.background) return std::nullopt;
  return *capture.settings.background;
}

}  // namespace tessera::gpu

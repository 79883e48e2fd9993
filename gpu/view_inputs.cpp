#include "gpu/view_inputs.h"

#include <algorithm>

#include "shaders_cpp/environment_image.h"
#include "tilecore/shading/transmission.h"
#include "tilecore/visibility/ray_effects.h"

namespace tessera::gpu {

scene::CameraChoice frame_camera(scene::CameraChoice choice, const RunSettings& settings) {
  if (settings.effects.defocus == EffectMode::kOff || !tilecore::kGeneralEffects)
    choice.camera.lens.aperture_radius = 0;
  return choice;
}

scene::CameraChoice frame_camera(const scene::Capture& capture, const RunSettings& settings, int width, int height) {
  return frame_camera(scene::choose_camera(capture, width, height), settings);
}

float frame_exposure(const scene::Capture& capture, const RunSettings& settings) {
  return settings.output.exposure > 0 ? static_cast<float>(settings.output.exposure) : capture.settings.exposure;
}

scene::FrameRequest frame_request(const scene::Capture& capture, const GpuConfiguration& gpu,
                                  const RunSettings& settings, int width, int height, int frame) {
  const scene::CaptureSettings& own = capture.settings;
  scene::FrameRequest request;
  request.width = width;
  request.height = height;
  request.open_time = (frame + own.shutter_open) / own.frame_rate;
  request.close_time = settings.effects.motion == EffectMode::kOff || !tilecore::kGeneralEffects
                           ? request.open_time
                           : (frame + own.shutter_close) / own.frame_rate;
  request.tessellation = settings.tessellation;
  request.max_factor = gpu.tessellator.max_factor;
  request.subpixel_bits = gpu.tessellator.subpixel_bits;
  request.half_attributes = settings.shading.attributes == tilecore::AttributePrecision::kHalf;
  request.interpolated_surfaces = settings.shading.surface != tilecore::ShadingSurface::kEvaluated;
  request.height_normals = settings.shading.surface == tilecore::ShadingSurface::kFrame;
  request.draw_lines = settings.procedures.style == tilecore::ProcedureSettings::Style::kLines;
  request.sample_procedures = settings.procedures.path == tilecore::ProcedureSettings::Path::kSampled;
  request.motion_segments = settings.sampling.motion_segments;
  request.motion_error = settings.sampling.motion_error;
  request.motion_segments_max = settings.sampling.motion_segments_max;
  request.displacement = settings.effects.displacement != EffectMode::kOff && tilecore::kGeneralEffects;
  request.alpha_test = settings.effects.alpha_test != EffectMode::kOff;
  request.blending = settings.effects.blending != EffectSwitch::kOff;
  request.procedures = settings.effects.procedures != EffectSwitch::kOff;
  request.shadow_casters = settings.effects.shadows;
  return request;
}

bool transmits(const scene::Assembly& assembly) {
  return std::any_of(assembly.drawables.begin(), assembly.drawables.end(), [&](const scene::Drawable& drawable) {
    return tilecore::transmits(drawable, assembly.materials[static_cast<std::size_t>(drawable.material)]);
  });
}

tilecore::Lighting frame_lighting(const scene::Capture& capture) {
  // An asset with lights of its own keeps a little of the environment, so that no surface is black.
  const float intensity = capture.settings.environment.value_or(capture.lights.empty() ? 1.0f : 0.3f);
  tilecore::Lighting lighting;
  lighting.environment =
      shaders::Environment({capture.settings.environment_kind, intensity, capture.environment_image.get()});
  return lighting;
}

std::optional<Vec3> frame_background(const scene::Capture& capture) {
  if (!capture.settings.background) return std::nullopt;
  return *capture.settings.background;
}

}  // namespace tessera::gpu

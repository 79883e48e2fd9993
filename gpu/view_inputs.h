#pragma once

#include <optional>

#include "gpu/configuration.h"
#include "gpu/settings.h"
#include "scene/frame_geometry.h"
#include "tilecore/shading/pixel_shader.h"

namespace tessera::gpu {

// What a frame follows from, of a capture and what a user chose: read by the machine and by what it is compared with.

// A camera as frames have it: without its lens where effects.defocus is off. Of a capture: its own.
scene::CameraChoice frame_camera(scene::CameraChoice choice, const RunSettings& settings);
scene::CameraChoice frame_camera(const scene::Capture& capture, const RunSettings& settings, int width, int height);

// How frame `frame` is posed and tessellated.
scene::FrameRequest frame_request(const scene::Capture& capture, const GpuConfiguration& gpu,
                                  const RunSettings& settings, int width, int height, int frame);

// What light is multiplied by before the tone map.
float frame_exposure(const scene::Capture& capture, const RunSettings& settings);

// Whether any surface shows what is behind it.
bool transmits(const scene::Assembly& assembly);

// Its light, and what is behind everything: a colour, or nothing for the environment.
tilecore::Lighting frame_lighting(const scene::Capture& capture);
std::optional<Vec3> frame_background(const scene::Capture& capture);

}  // namespace tessera::gpu

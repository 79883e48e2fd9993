#pragma once

#include <optional>

#include "gpu/configuration.h"
#include "gpu/settings.h"
#include "scene/frame_geometry.h"
#include "tilecore/shading/pixel_shader.h"

namespace tessera::gpu {

// The inputs of a frame, from a capture and a user's choices: the machine and the references it is compared with read
// them.

// A camera for frames: without its lens if effects.defocus is off. The second takes the capture's own camera.
scene::CameraChoice frame_camera(scene::CameraChoice choice, const RunSettings& settings);
scene::CameraChoice frame_camera(const scene::Capture& capture, const RunSettings& settings, int width, int height);

// The request that poses and tessellates frame `frame`.
scene::FrameRequest frame_request(const scene::Capture& capture, const GpuConfiguration& gpu,
                                  const RunSettings& settings, int width, int height, int frame);

// The factor of light before the tone map.
float frame_exposure(const scene::Capture& capture, const RunSettings& settings);

// Whether any surface transmits light from behind it.
bool transmits(const scene::Assembly& assembly);

// The capture's light, and its background: a colour, or nullopt for the environment.
tilecore::Lighting frame_lighting(const scene::Capture& capture);
std::optional<Vec3> frame_background(const scene::Capture& capture);

}  // namespace tessera::gpu

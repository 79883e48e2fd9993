#pragma once

#include <optional>

#include "frontend/frame_geometry.h"
#include "hardware/configuration.h"
#include "replay/settings.h"
#include "tilecore/pixel_shader.h"
#include "tilecore/sample_pattern.h"

namespace tessera::replay {

// What a frame follows from, of a capture and what a user chose: read by the machine and by what it is compared with.

// The camera of the whole capture; without its lens where effects.defocus is off.
frontend::CameraChoice frame_camera(const frontend::Capture& capture, const RunSettings& settings, int width,
                                    int height);

// How frame `frame` is posed and tessellated.
frontend::FrameRequest frame_request(const frontend::Capture& capture, const hardware::GpuConfiguration& gpu,
                                     const RunSettings& settings, int width, int height, int frame);

// Where its samples are.
tilecore::SamplingSettings sampling_settings(const RunSettings& settings, int frame);

// Its light, and what is behind everything: a colour, or nothing for the environment.
tilecore::Lighting frame_lighting(const frontend::Capture& capture);
std::optional<Vec3> frame_background(const frontend::Capture& capture);

}  // namespace tessera::replay

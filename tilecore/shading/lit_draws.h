#pragma once

#include <cstdint>

#include "hardware/shader_costs.h"
#include "tilecore/shading/pixel_shader.h"

namespace tessera::tilecore {

// Functions that the sources of PixelShader share.

// Constants of a draw in a segment of the shutter, lit as in segment `lights_in`.
DrawConstants lit_draw(const scene::FrameGeometry& shutter, const scene::FrameGeometry& segment, int lights_in,
                       const scene::PosedDrawable& drawable, const Lighting& lighting,
                       const shaders::ShadowView* shadows, bool quads);
// Time t within a segment.
float light_time(const scene::FrameGeometry& shutter, int segment, float t);
// Bytes of a listed light in the tile memory.
std::uint64_t light_bytes_of(const scene::FrameGeometry& frame);
// Whether a material's shader looks up an image of the surroundings.
bool looks_around(const Lighting& lighting, const scene::Material& material);
// The features of a pixel shader, except its lights. `evaluates`: it evaluates a patch.
hardware::ShaderFeatures pixel_features(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable,
                                        bool quads, bool evaluates);

}  // namespace tessera::tilecore

#pragma once

#include <array>
#include <cstddef>

#include "base/half_float.h"
#include "base/real.h"
#include "base/vector3.h"
#include "shaders_cpp/bicubic.h"
#include "shaders_cpp/metallic_roughness.h"
#include "shaders_cpp/shadow_map.h"
#include "shaders_cpp/texture.h"
#include "tilecore/shading/draw_inputs.h"
#include "tilecore/shading/surface.h"

namespace tessera::tilecore {

// The pixel shader of pixel_shader_kernel.cpp on one float: its twin, also used for single points.
namespace one_lane {

namespace stage = shaders;
using tessera::any;
using tessera::both;
using tessera::gather;
using tessera::is_finite;
using tessera::select;

#include "tilecore/shading/lane_shader.inc"

}  // namespace one_lane

// Camera and geometry of a draw, without lights.
DrawConstants draw_constants(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable);

// Inputs for a location on a patch of the drawable, which is no procedure; its time counts within the frame's segment.
one_lane::LaneInputs<float> lane_inputs(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable,
                                        const SurfaceLocation& at);

one_lane::LaneSurface<float> one_lane_surface(const Surface& surface);

}  // namespace tessera::tilecore

#pragma once

#include "hardware/shader_costs.h"
#include "scene/frame_geometry.h"
#include "tilecore/shading/frame_shadows.h"

namespace tessera::tilecore {

// The features of a material that its pixel shader's code depends on: the textures that it reads, the number of their
// coordinates, whether it is lit. For static triangles without lights. `height_normals`: normals are turned by the
// gradient of the displacement's heights, which are then read like a texture.
hardware::ShaderFeatures material_features(const scene::Material& material, bool height_normals = false);

// The pixel shader of a drawable in a frame, at its lights; `quads`: derivatives are differences within quads.
hardware::ShaderFeatures draw_features(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable,
                                       bool quads, bool height_normals = false);

// Reduces the lights of `features` to those in a list; `numbers`: of the frame's lights.
void keep_lights(const scene::FrameGeometry& frame, std::span<const std::uint32_t> numbers,
                 hardware::ShaderFeatures& features);

// Adds the shadow lookups of lights; `frame`: one of the frames of `shadows`. `listed`: the lights of a list; nullptr:
// all.
void add_shadows(const FrameShadows& shadows, const scene::FrameGeometry& frame,
                 const std::span<const std::uint32_t>* listed, hardware::ShaderFeatures& features);

// The domain shader of a drawable that has vertices to shade.
hardware::ShaderFeatures domain_features(const scene::PosedDrawable& drawable);

}  // namespace tessera::tilecore

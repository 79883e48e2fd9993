#pragma once

#include <cstdint>

#include "scene/frame_geometry.h"

namespace tessera::tilecore {

// Clocks of a lane for a point of a procedure, by its operations (shaders_cpp/procedures/operation_count.h): one for
// each, four for a division or a square root. A procedure that deforms is evaluated at both motion keys. 0 if it has no
// pieces.
std::uint32_t place_clocks(const scene::PosedDrawable& drawable);     // a vertex' place
std::uint32_t geometry_clocks(const scene::PosedDrawable& drawable);  // place and normal
// Texture and shading of a pixel. The material's shading is compiled and not counted here; drawn lines have none.
std::uint32_t surface_clocks(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable);

}  // namespace tessera::tilecore

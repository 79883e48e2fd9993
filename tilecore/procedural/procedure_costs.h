#pragma once

#include <cstdint>

#include "scene/frame_geometry.h"

namespace tessera::tilecore {

// Clocks of a lane for points of a procedure, by its operations (shaders_cpp/procedures/operation_count.h): one for each,
// four for a division or a square root. What deforms is evaluated at both motion keys.
struct ProcedureClocks {
  std::uint32_t place = 0;     // a vertex' place
  std::uint32_t geometry = 0;  // place and normal
  std::uint32_t surface = 0;   // texture and shading of a pixel; the material's shading is compiled
};
ProcedureClocks procedure_clocks(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable);

}  // namespace tessera::tilecore

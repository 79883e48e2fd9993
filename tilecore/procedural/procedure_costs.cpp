#include "tilecore/procedural/procedure_costs.h"

#include "shaders_cpp/procedures/operation_count.h"
#include "tilecore/procedural/procedure_surface.h"

namespace tessera::tilecore {
namespace {

std::uint32_t clocks(const shaders::OperationCount& count) {
  return static_cast<std::uint32_t>(count.total() + 3 * (count.divides + count.square_roots));
}

// Calls count(shape, input) for the first piece, at each motion key: pieces run the same code.
template <class Count>
std::uint32_t shape_clocks(const scene::PosedDrawable& drawable, const Count& count) {
  const scene::Procedure& procedure = *drawable.procedure;
  if (procedure.pieces.empty()) return 0;
  return (drawable.deforming ? 2 : 1) * clocks(count(procedure.shape, procedure.pieces.front().input));
}

}  // namespace

std::uint32_t place_clocks(const scene::PosedDrawable& drawable) {
  return shape_clocks(drawable, shaders::count_position);
}

std::uint32_t geometry_clocks(const scene::PosedDrawable& drawable) {
  return shape_clocks(drawable, shaders::count_geometry);
}

std::uint32_t surface_clocks(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable) {
  if (frame.request.draw_lines || drawable.procedure->pieces.empty()) return 0;
  return clocks(shaders::count_surface(surface_program(frame, drawable, drawable.procedure->pieces.front())));
}

}  // namespace tessera::tilecore

#include "tilecore/procedural/procedure_costs.h"

#include "shaders_cpp/procedures/operation_count.h"
#include "tilecore/procedural/procedure_surface.h"

namespace tessera::tilecore {
namespace {

std::uint32_t clocks(const shaders::OperationCount& count) {
  return static_cast<std::uint32_t>(count.total() + 3 * (count.divides + count.square_roots));
}

}  // namespace

ProcedureClocks procedure_clocks(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable) {
  if (drawable.procedure->pieces.empty()) return {};
  // Pieces run the same code.
  const shaders::ShapeId shape = drawable.procedure->shape;
  const scene::Procedure::Piece& piece = drawable.procedure->pieces.front();
  const std::uint32_t keys = drawable.deforming ? 2 : 1;
  return {keys * clocks(shaders::count_position(shape, piece.input)),
          keys * clocks(shaders::count_geometry(shape, piece.input)),
          clocks(shaders::count_surface(surface_program(frame, drawable, piece)))};
}

}  // namespace tessera::tilecore

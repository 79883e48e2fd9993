#pragma once

#include <cstdint>

#include "scene/capture.h"
#include "scene/tessellation_pattern.h"

namespace tessera::scene {

struct FrameGeometry;
struct PosedDrawable;

// A base patch of a procedure: cell (column, row) of a piece that is cut evenly. The numbers of columns and rows are
// powers of two, so that neighbours compute a shared edge's parameters, and with them its vertices, with the same bits.
struct ProcedurePatch {
  shaders::ShapeId shape = shaders::ShapeId::kSphere;
  const Procedure::Piece *piece = nullptr,
                         *piece_close = nullptr;  // at the motion keys; different for deforming procedures only
  int column = 0, row = 0, columns = 1, rows = 1;

  // Parameters of the piece from parameters of the patch.
  float u(float local) const { return (static_cast<float>(column) + local) / static_cast<float>(columns); }
  float v(float local) const { return (static_cast<float>(row) + local) / static_cast<float>(rows); }
  const shaders::ShapeInput& input(std::size_t key) const { return (key == 0 ? piece : piece_close)->input; }
};

ProcedurePatch procedure_patch(const FrameGeometry& frame, std::uint32_t patch);

// The patch that holds (u, v) of a piece, and the patch's own parameters there.
struct PatchPoint {
  std::uint32_t patch;
  float u, v;
};
PatchPoint patch_of_piece_point(const PosedDrawable& drawable, std::uint32_t piece, float u, float v);

// Tessellation factors from the length on screen of the patch's edges and inner lines, each as a polygon of nine
// points: the same for both patches at an edge. They lie within the procedure's own limits; throws LimitError where its
// minimum exceeds the machine's maximum.
TessellationPattern procedure_pattern(const FrameGeometry& frame, std::uint32_t patch);

// Bytes of a procedure in memory: the numbers of all stages (twice for a shape that deforms, once per motion key) and a
// geometry image's points. The code is counted separately.
std::uint64_t procedure_record_bytes(const Procedure& procedure, bool deforming);
// The part of these bytes that evaluating a point of a piece reads: the piece's numbers.
std::uint64_t procedure_piece_bytes(const Procedure& procedure);
// The part of these bytes that shading a point reads: the numbers of its piece and of texture and shading.
std::uint64_t procedure_point_bytes(const Procedure& procedure);

}  // namespace tessera::scene

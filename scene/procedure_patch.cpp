#include "scene/procedure_patch.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "base/error.h"
#include "scene/frame_geometry.h"
#include "shaders_cpp/procedures/procedures.h"

namespace tessera::scene {
namespace {

constexpr int kPolygonPoints = 9;

struct SegmentLimits {
  int least, most;
};
SegmentLimits segment_limits(const FrameGeometry& frame, const Procedure& procedure) {
  const int machine = frame.request.max_factor;
  if (!frame.request.procedure_limits) return {1, machine};
  return {procedure.min_segments, std::min(procedure.max_segments, machine)};
}

// Factor of the line from (u0, v0) to (u1, v1) of a piece.
int line_factor(const FrameGeometry& frame, const PosedDrawable& drawable, const ProcedurePatch& at, Vec2 from,
                Vec2 to) {
  const float near_w = frame.projection.orthographic ? 1.0f : static_cast<float>(frame.projection.near);
  std::array<std::array<Vec2, kPolygonPoints>, 2> screen;
  for (int k = 0; k < kPolygonPoints; ++k) {
    const float t = static_cast<float>(k) / (kPolygonPoints - 1), u = at.u(from.x + (to.x - from.x) * t),
                v = at.v(from.y + (to.y - from.y) * t);
    Vector3<float> p;
    for (std::size_t key = 0; key < 2; ++key) {
      if (key == 0 || at.piece != at.piece_close) p = shaders::shape_point(at.shape, at.input(key), u, v);
      const Vec4 r = drawable.to_raster[key] * Vec4(p.x, p.y, p.z, 1.0f);
      screen[key][static_cast<std::size_t>(k)] = Vec2(r) / std::max(r.w, near_w);
    }
  }
  float longest = 0;
  for (const auto& points : screen) {
    float length = 0;
    for (std::size_t k = 1; k < points.size(); ++k) length += glm::length(points[k] - points[k - 1]);
    longest = std::max(longest, length);
  }
  const double cells = std::ceil(static_cast<double>(longest) / frame.request.tessellation.target_edge_pixels);
  const SegmentLimits limits = segment_limits(frame, *drawable.procedure);
  if (!(cells > limits.least)) return limits.least;  // NaN too
  return static_cast<int>(std::min(cells, static_cast<double>(limits.most)));
}

}  // namespace

ProcedurePatch procedure_patch(const FrameGeometry& frame, std::uint32_t patch) {
  const PosedDrawable& drawable = frame.drawable_of(patch);
  const shaders::StageDeclaration& shape = drawable.procedure->declaration();
  const int per_piece = shape.patches_u * shape.patches_v,
            number = static_cast<int>(patch - drawable.drawable->first_patch), cell = number % per_piece;
  const auto piece = static_cast<std::size_t>(number / per_piece);
  return {drawable.procedure->shape,
          &drawable.procedure->pieces[piece],
          &drawable.procedure_close->pieces[piece],
          cell % shape.patches_u,
          cell / shape.patches_u,
          shape.patches_u,
          shape.patches_v};
}

PatchPoint patch_of_piece_point(const PosedDrawable& drawable, std::uint32_t piece, float u, float v) {
  const shaders::StageDeclaration& shape = drawable.procedure->declaration();
  const float x = u * static_cast<float>(shape.patches_u), y = v * static_cast<float>(shape.patches_v);
  const float column = std::clamp(std::floor(x), 0.0f, static_cast<float>(shape.patches_u - 1)),
              row = std::clamp(std::floor(y), 0.0f, static_cast<float>(shape.patches_v - 1));
  const auto cell = static_cast<std::uint32_t>(row) * static_cast<std::uint32_t>(shape.patches_u) +
                    static_cast<std::uint32_t>(column);
  return {drawable.drawable->first_patch + piece * static_cast<std::uint32_t>(shape.patches_u * shape.patches_v) + cell,
          x - column, y - row};
}

TessellationPattern procedure_pattern(const FrameGeometry& frame, std::uint32_t patch) {
  const PosedDrawable& drawable = frame.drawable_of(patch);
  const ProcedurePatch at = procedure_patch(frame, patch);
  const int least = drawable.procedure->min_segments, machine = frame.request.max_factor;
  if (frame.request.procedure_limits && least > machine && !frame.request.sample_procedures)
    throw LimitError(fmt::format(
        "procedure at node {} wants {} segments along each side of a patch at least, the machine makes {}: raise "
        "tessellator.max_factor or lower tessellation.min",
        drawable.drawable->node, least, machine));
  const auto along_u = [&](float v) { return line_factor(frame, drawable, at, {0, v}, {1, v}); };
  const auto along_v = [&](float u) { return line_factor(frame, drawable, at, {u, 0}, {u, 1}); };
  const std::array<int, 4> edge = {along_u(0), along_u(1), along_v(0), along_v(1)};
  TessellationPattern pattern;
  for (std::size_t e = 0; e < 4; ++e) pattern.edge[e] = static_cast<std::uint8_t>(edge[e]);
  pattern.nu = static_cast<std::uint8_t>(std::max({edge[0], edge[1], along_u(0.25f), along_u(0.5f), along_u(0.75f)}));
  pattern.nv = static_cast<std::uint8_t>(std::max({edge[2], edge[3], along_v(0.25f), along_v(0.5f), along_v(0.75f)}));
  return pattern;
}

namespace {

// Numbers of texture and shading: a block for each, larger where a texture of the user's own has more.
std::uint64_t stage_numbers(const Procedure& procedure) {
  std::size_t texture = procedure.texture_numbers.size();
  if (procedure.texture_program) texture = std::max(texture, procedure.texture_program->parameter_numbers);
  return texture + procedure.shading_numbers.size();
}

}  // namespace

std::uint64_t procedure_point_bytes(const Procedure& procedure) {
  std::uint64_t numbers = stage_numbers(procedure);
  for (const shaders::ParameterDeclaration& p : procedure.declaration().parameters)
    numbers += static_cast<std::uint64_t>(p.size);
  return 4 * numbers;
}

std::uint64_t procedure_piece_bytes(const Procedure& procedure) {
  return procedure_point_bytes(procedure) - 4 * stage_numbers(procedure);
}

std::uint64_t procedure_record_bytes(const Procedure& procedure, bool deforming) {
  return procedure_piece_bytes(procedure) * procedure.pieces.size() * (deforming ? 2 : 1) +
         4 * stage_numbers(procedure) + (procedure.image ? 12 * procedure.image->x.size() : 0);
}

}  // namespace tessera::scene

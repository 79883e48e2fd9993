#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "gpu/configuration.h"
#include "gpu/settings.h"
#include "replay/stability/stage.h"
#include "scene/frame_geometry.h"
#include "scene/patch_displacement.h"

namespace tessera::replay::stability {

// A stage with the machine's pose of it.
struct PosedStage {
  explicit PosedStage(const Stage& stage);

  const Stage& stage;
  gpu::RunSettings settings;
  gpu::GpuConfiguration gpu;
  scene::CameraChoice camera;
  scene::Assembly assembly;
  std::unique_ptr<scene::FrameGeometry> frame;
};

// Arithmetic of a judge. Twins use single precision and denormal numbers flushed to zero.
enum class Arithmetic { kDouble, kSingle, kNoDenormals };

// Computes where points of a scene are seen at a time, in double precision, from the numbers of the scene alone:
// interpolated, morphed, skinned, displaced and projected at that time itself. It shares with the machine glTF's
// definition of a pose and the filter of heights, but nothing of the evaluation of surfaces: Bernstein polynomials are
// summed in their textbook form (Farin 2002, chapter 5), and no quantity is treated as linear in time.
class Judge {
 public:
  // `time` in seconds. `stage` must outlive the judge.
  Judge(const PosedStage& stage, double time, Arithmetic arithmetic = Arithmetic::kDouble);

  // Results are in raster space (scene/view.h).
  DVec4 vertex(const scene::Drawable& drawable, std::uint32_t vertex) const;
  // A point of a Bezier patch, displaced; `patch` is numbered in the whole scene.
  DVec4 surface(std::uint32_t patch, double u, double v) const;
  DVec4 procedure(std::uint32_t patch, double u, double v) const;

  const scene::Projection& projection() const { return projection_; }

 private:
  DVec3 morphed(const scene::Primitive& primitive, int node, std::size_t vertex) const;
  // Transform to raster space from the space in which a mesh is displaced: object space, or world space for a skinned
  // mesh.
  DMat4 to_raster(const scene::Drawable& drawable) const;
  DVec3 placed(const scene::Drawable& drawable, const scene::Primitive& primitive, std::size_t vertex) const;

  // The product of two transforms, and the transformed point, in the judge's arithmetic.
  DMat4 product(const DMat4& a, const DMat4& b) const;
  DVec4 product(const DMat4& a, const DVec3& p) const;

  const PosedStage& stage_;
  const Arithmetic arithmetic_;
  scene::Pose pose_;
  scene::PosedProcedures procedures_;
  scene::Projection projection_;
  DMat4 world_to_raster_;
};

// A point of a Bezier patch and its unit normal, displaced by `offset` along it.
DVec3 displaced(const std::array<DVec3, 16>& net, double u, double v, double offset);

}  // namespace tessera::replay::stability

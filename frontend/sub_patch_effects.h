#pragma once

#include <cstdint>

#include "frontend/bounds/screen_bounds.h"
#include "frontend/bounds/sub_patch_bounder.h"
#include "scene/frame_geometry.h"

namespace tessera::frontend {

// Effects whose code a sub-patch needs in a tile core; its record in the parameter buffer carries them.
enum SubPatchEffect : std::uint8_t {
  kEffectMotion = 1,
  kEffectDefocus = 2,
  kEffectDisplacement = 4,
  kEffectAlphaTest = 8,
  kEffectBlending = 16,
};
inline constexpr std::uint8_t kAllSubPatchEffects = 31;

// Decides which effects the code for a sub-patch needs. An effect is left out only if the code without it certainly
// finds the same bits. For motion and defocus this relies on two rules that the tile core applies to single vertices,
// in every kernel:
//   a vertex that moves by no more than kStillPixels and kStillDepth does not move (project_vertices);
//   a vertex whose circle of confusion is no larger than kSharpPixels is seen through the lens centre: see
//     place_corner.
// The rules look at one vertex alone, so they depend on no split, tile or neighbour, and open no crack.
//
// Invariants (cited by the tests):
//   SE1  Without kEffectMotion every vertex of the sub-patch is projected and has the same bits at both motion keys.
//   SE2  Without kEffectDefocus every vertex is projected and sharp at all times.
//   SE3  Without kEffectDisplacement every offset that any of its vertices is displaced by, its neighbours' included,
//        is zero.
//   SE4  Without kEffectAlphaTest no point of it has an alpha below its material's cutoff.
class EffectSelector {
 public:
  EffectSelector(const scene::FrameGeometry& frame, const PyramidLibrary& pyramids)
      : frame_(frame), pyramids_(pyramids) {}

  void begin(std::uint32_t patch);
  // Chooses the effects of the cells whose body `bounder` made last; `bounds` are the bounds of that body.
  std::uint8_t select(const SubPatchBounder& bounder, const SubPatchBody& body, const ScreenBounds& bounds) const;

 private:
  bool moves(const SubPatchBody& body) const;
  bool may_fail_alpha(const SubPatchBounder& bounder) const;
  // Whether vertices of the patch, or of the patches that own its boundary, differ between the keys.
  bool deforms(std::uint32_t patch) const;

  const scene::FrameGeometry& frame_;
  const PyramidLibrary& pyramids_;
  std::uint32_t patch_ = 0;
  const scene::PosedDrawable* drawable_ = nullptr;
  bool deforms_ = false;
  float least_vertex_alpha_ = 1;
  Vec2 texcoord_low_{0.0f}, texcoord_high_{0.0f};  // of a cluster
};

// Whether every point of a moving body moves by less than the tile core ignores, for any rounding of its arithmetic:
// corners of both keys are the same points of a body that is rigid in object space. Exposed for tests.
bool stays_still(const SubPatchBody& body, const scene::Projection& projection, double still_pixels,
                 double still_depth);
// Whether a body lies in front of the near plane and inside the guard band at both motion keys, so that every vertex is
// projected.
bool certainly_projected(const SubPatchBody& body, const scene::Projection& projection);
// Whether the circle of confusion of every depth of `bounds` has a radius of no more than `sharp_pixels`, rounding
// included.
bool stays_sharp(const ScreenBounds& bounds, const scene::Projection& projection, double sharp_pixels);

// The lens factor below which a vertex is sharp; 0 without a lens.
float sharp_factor(const scene::Projection& projection);

}  // namespace tessera::frontend

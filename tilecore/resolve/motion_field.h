#pragma once

#include <cstdint>
#include <vector>

#include "frontend/frame_geometry.h"
#include "tilecore/surface.h"

namespace tessera::tilecore {

// Where the points of a frame's surfaces were in another frame, or are for another eye: what vertex positions of both, interpolated at a
// hit, would say. Positions are those at shutter open through a pinhole, in both frames; what a shutter and a lens add to a
// sample's place is the same in both and does not count as motion.
//
// Drawables whose vertices keep their places in object space (all but deforming ones) moved as a whole: one matrix on the
// point's place in raster space is exact and needs no surface. The points of deforming ones are evaluated at both poses.
//
// Invariants (cited by the tests):
//   M1  A drawable of kind kStill looks the same in both frames through every sample: no motion between them, nor during the shutters.
//   M2  A point with w <= 0 in either frame, or of a drawable without an inverse, is not usable.
class MotionField {
 public:
  enum class Kind : std::uint8_t { kStill, kRigid, kDeforming, kUnusable };

  // `now` and `then` are posed from the same assembly; both outlive the field.
  MotionField(const frontend::FrameGeometry& now, const frontend::FrameGeometry& then);

  Kind kind(std::uint32_t drawable) const { return motions_[drawable].kind; }
  bool all_still() const { return all_still_; }
  // Lights are part of what the pixel shader is told; a frame with others may not take over colours.
  bool same_lights() const { return same_lights_; }

  struct Point {
    Vec2 pixel{0.0f};
    float depth = 0;
    bool usable = false;
  };
  struct Step {
    Vec2 velocity{0.0f};  // pixels from `then` to `now`
    float depth = 0;      // in `then`
    bool usable = false;
  };
  // Motion of the point of drawable `d` that a sample sees at `at`; `rest` is its pixel at shutter open, z its depth.
  Step step(std::uint32_t d, Vec2 rest, float z, const SurfaceLocation& at) const;

 private:
  struct Motion {
    Kind kind = Kind::kUnusable;
    Mat4 rows{1.0f};  // rigid: row k dotted with (xh, yh, depth, 1) now is component k of (xh, yh, depth, w) then
  };
  static Motion motion_of(const frontend::FrameGeometry& now, const frontend::FrameGeometry& then, std::size_t drawable);

  const frontend::FrameGeometry& now_;
  const frontend::FrameGeometry& then_;
  std::vector<Motion> motions_;
  bool all_still_ = true, same_lights_ = true;
};

}  // namespace tessera::tilecore

#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "base/vec.h"
#include "scene/frame_geometry.h"
#include "tilecore/resolve/history.h"
#include "tilecore/resolve/light_reach.h"
#include "tilecore/shading/surface.h"

namespace tessera::tilecore {

// The places of a frame's surface points in another frame, or for another eye: vertex positions of both, interpolated
// at a hit. Positions are at shutter open through a pinhole, in both frames; the displacement of a sample by shutter
// and lens is the same in both and does not count as motion.
//
// A drawable whose vertices keep their places in object space (any but a deforming one) moves as a whole: one matrix on
// the point's place in raster space is exact and needs no surface. Points of deforming drawables are evaluated at both
// poses. If pixels interpolate a patch's surface between the vertices of its grid, the vertices are evaluated instead,
// and their places in both frames are interpolated likewise.
//
// Invariants (cited by the tests):
//   MF1  A drawable of kind kStill looks the same in both frames through every sample: no motion between them, nor
//        during the shutters.
//   MF2  A point with w <= 0 in either frame, or of a drawable without an inverse, is not usable.
//   MF3  If a drawable's shading is the same in both frames, the pixel shader gets the same inputs for its points, except
//        for the lights and the viewpoint.
//   MF4  If pixels interpolate a deforming patch's surface, a point's places are its triangle's vertex places,
//        weighed in raster space.
class MotionField {
 public:
  enum class Kind : std::uint8_t { kStill, kRigid, kDeforming, kUnusable };

  // `now` and `then` are posed from the same assembly; both outlive the field.
  MotionField(const scene::FrameGeometry& now, const scene::FrameGeometry& then);

  Kind kind(std::uint32_t drawable) const { return motions_[drawable].kind; }
  bool all_still() const { return all_still_; }
  // Whether every sample sees the background as before.
  bool camera_rests() const { return camera_rests_; }
  // False if animated values of its material differ, or if its vertices stay where they are but their normals or
  // tangents do not. If vertices move as well, their normals turn with them; the discrepancy check finds the error of a
  // colour that is taken over then.
  bool same_shading(std::uint32_t drawable) const { return motions_[drawable].same_shading; }
  // Share of the time between the frames in which the shutter is open in `now`; 0 if it is closed, or if the frames are
  // the same moment.
  float shutter() const { return shutter_; }
  // Lights are inputs of the pixel shader; colours may not be taken over in the reach of a changed one.
  const LightReach& lights() const { return lights_; }

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
  // Places of a point of a deforming drawable in both frames at shutter open: (xh, yh, depth, w).
  struct Places {
    Vec4 now{0.0f}, then{0.0f};
  };
  // By the surface's parameters in its patch or, for a cluster, in the triangle of `at`.
  Places places(const SurfaceLocation& at, Vec2 parameters) const {
    return {surface_raster(now_, at, parameters, 0), surface_raster(then_, at, parameters, 0)};
  }
  static Step step_between(const Places& places) {
    if (!(places.now.w > 0)) return {};
    return step_to(Vec2(places.now.x, places.now.y) / places.now.w, places.then);
  }
  // Motion of the point of drawable `d` that a sample sees at `at`; `rest` is its pixel at shutter open, z its depth.
  Step step(std::uint32_t d, Vec2 rest, float z, const SurfaceLocation& at) const;
  // The same for a drawable of kind kRigid, which needs no surface.
  Step rigid_step(std::uint32_t d, Vec2 rest, float z) const {
    const float w = orthographic_ ? 1.0f : z;
    if (!(w > 0)) return {};
    const Mat4& m = motions_[d].reprojection;
    return step_to(rest, m[0] * (rest.x * w) + m[1] * (rest.y * w) + m[2] * z + m[3]);
  }
  // The same for the points of a block. If bit i of `usable` is 0, velocity, depth and speed are 0, too.
  struct RigidPoints {
    static constexpr std::size_t kCount = 16;
    alignas(64) std::array<float, kCount> x, y, depth;
  };
  struct RigidSteps {
    alignas(64) std::array<float, RigidPoints::kCount> x, y, depth, speed;
    std::uint32_t usable;
  };
  void rigid_steps(std::uint32_t d, const RigidPoints& points, RigidSteps& steps) const;

 private:
  struct Motion {
    Kind kind = Kind::kUnusable;
    bool same_shading = true;
    Mat4 reprojection{1.0f};  // rigid: (xh, yh, depth, 1) now to (xh, yh, depth, w) then
  };
  // The step to homogeneous raster coordinates in `then`.
  static Step step_to(Vec2 rest, const Vec4& r) {
    if (!(r.w > 0)) return {};
    const Step step{rest - Vec2(r.x, r.y) / r.w, r.z, true};
    if (!std::isfinite(step.velocity.x) || !std::isfinite(step.velocity.y)) return {};
    return step;
  }
  static Motion motion_of(const scene::FrameGeometry& now, const scene::FrameGeometry& then, std::size_t drawable);

  const scene::FrameGeometry& now_;
  const scene::FrameGeometry& then_;
  std::vector<Motion> motions_;
  float shutter_ = 0;
  LightReach lights_;
  bool all_still_ = true, camera_rests_ = false, orthographic_ = false;
};

// Displacement in pixels, by the camera's motion, of each of History::kCameraPlaces places of the previous frame,
// `then`: each is taken as a point at rest in the scene, at the depth in `history`. Infinite if it is now behind the
// eye.
CameraMotion camera_motion(const scene::FrameGeometry& now, const scene::FrameGeometry& then, const History& history);

// Whether the camera's motion differs from its previous motion by more than `pixels` in most places: a cut, or a stop
// or start. The eye has not followed any surface that moves now, so that it would see coarser shading. False if either
// is unknown.
bool is_cut(const CameraMotion& before, const CameraMotion& now, float pixels);

}  // namespace tessera::tilecore

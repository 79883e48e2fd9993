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

// Where the points of a frame's surfaces were in another frame, or are for another eye: what vertex positions of both,
// interpolated at a hit, would say. Positions are those at shutter open through a pinhole, in both frames; what a
// shutter and a lens add to a sample's place is the same in both and does not count as motion.
//
// Drawables whose vertices keep their places in object space (all but deforming ones) moved as a whole: one matrix on
// the point's place in raster space is exact and needs no surface. The points of deforming ones are evaluated at both
// poses; where pixels interpolate a patch's surface between the vertices of its grid, the vertices are, and their places
// in both frames are interpolated likewise.
//
// Invariants (cited by the tests):
//   MF1  A drawable of kind kStill looks the same in both frames through every sample: no motion between them, nor
//        during the shutters.
//   MF2  A point with w <= 0 in either frame, or of a drawable without an inverse, is not usable.
//   MF3  Where a drawable's shading is the same in both frames, the pixel shader is told the same of its points, but for
//        the lights and where they are seen from.
//   MF4  Where pixels interpolate a deforming patch's surface, a point's places are those of its triangle's vertices,
//        weighed in raster space.
class MotionField {
 public:
  enum class Kind : std::uint8_t { kStill, kRigid, kDeforming, kUnusable };

  // `now` and `then` are posed from the same assembly; both outlive the field.
  MotionField(const scene::FrameGeometry& now, const scene::FrameGeometry& then);

  Kind kind(std::uint32_t drawable) const { return motions_[drawable].kind; }
  bool all_still() const { return all_still_; }
  // Every sample sees what lies behind everything as it was.
  bool camera_rests() const { return camera_rests_; }
  // False: values of its material are animated and differ, or its vertices stay where they are and their normals or
  // tangents do not. Where vertices move as well, their normals turn with them; what a colour taken over then gets
  // wrong is for the discrepancy check to find.
  bool same_shading(std::uint32_t drawable) const { return motions_[drawable].same_shading; }
  // For which share of the time between the frames the shutter is open in `now`; 0: it is not, or the frames are the
  // same moment.
  float shutter() const { return shutter_; }
  // Lights are part of what the pixel shader is told; where one that changed reaches, colours may not be taken over.
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
  // Where a point of a deforming drawable is in both frames at shutter open: (xh, yh, depth, w).
  struct Places {
    Vec4 now{0.0f}, then{0.0f};
  };
  // By the surface's parameters in its patch or, of a cluster, in the triangle of `at`.
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
  // The same for the points of a block. Where bit i of `usable` is 0 velocity, depth and speed are, too.
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
  // To homogeneous raster coordinates in `then`.
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

// By how many pixels each of History::kCameraPlaces places of the previous frame, `then`, is elsewhere in `now` because
// the camera moved: what rests there in the scene, at the depth that `history` has. Infinite: behind the eye now.
CameraMotion camera_motion(const scene::FrameGeometry& now, const scene::FrameGeometry& then, const History& history);

// Whether the camera's motion is another than it was, by more than `pixels` in most places: a cut, or it stops or
// starts. The eye has followed nothing that moves now, so that it sees coarser shading of it. Not where either is
// unknown.
bool is_cut(const CameraMotion& before, const CameraMotion& now, float pixels);

}  // namespace tessera::tilecore

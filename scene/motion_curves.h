#pragma once

#include <cstdint>
#include <vector>

#include "scene/frame_geometry.h"

namespace tessera::scene {

// How the true motion of a frame bends. The shutter is cut into pieces at every key of an animation and, in between, so
// finely that nothing turns far within a piece. There a curve is smooth, and five positions of a point show how much it
// bends and how the bend changes along the piece. That bounds the distance of any chord from the curve, also for motion
// that repeats itself, which samples alone would miss.
//
// Invariants (cited by the tests):
//   MCU1  Every key of a played channel that moves a node, a weight, a procedure or the camera's field is a time.
//   MCU2  Within a piece, rotations along a chain of nodes plus the rotation of the camera sum up to no more than
//         kPieceTurn (as far as kMaxPieces allows).
inline constexpr double kPieceTurn = 0.5;            // radians: second differences of quarters are within 0.2 %
inline constexpr std::size_t kMaxPieces = 16384;     // of a shutter
inline constexpr std::size_t kMaxBends = 32u << 20;  // pieces times drawables

// Times 0 to 1 of the shutter, ascending, both ends included.
struct CurveTime {
  double at;
  bool key = false;   // the velocity may change at once
  bool jump = false;  // places may change at once as well: a key of a step
};
std::vector<CurveTime> curve_times(const FrameGeometry& frame, int camera_node);

// How a drawable, or the background, moves on screen; all in pixels, at its worst point.
struct Bend {
  // The whole shutter is the unit of time.
  std::vector<float> acceleration;  // per piece: its maximum within the piece
  std::vector<float> kink;          // per time: change of velocity
  std::vector<float> jump;          // per time: change of place
  float zoom = 0;                   // distance from its place in the projection of shutter open
  unsigned off = 15;                // sides of the frame beyond which all of it lies at all times, a bit each
};

// Time at which the determinant of a node's transform changes its sign: fronts become backs.
struct WindingFlip {
  int node;
  double at;  // of the shutter
};

struct MotionCurves {
  std::vector<CurveTime> times;
  std::vector<Bend> drawables;  // as Assembly::drawables
  Bend background;
  std::vector<WindingFlip> flips;
};

// Measures a frame whose whole shutter is posed.
MotionCurves measure_motion(const FrameGeometry& frame, const CameraChoice& camera);

}  // namespace tessera::scene

#pragma once

#include <cstdint>
#include <vector>

#include "scene/frame_geometry.h"

namespace tessera::scene {

// How the true motion of a frame bends. The shutter is cut into pieces at every key of an animation and, in between, so
// finely that nothing turns far within a piece: there a curve is smooth, and five places of a point tell how it bends,
// and how that changes along the piece. That bounds the distance of any chord from the curve, also of motion that
// repeats itself: a curve is never taken for known because it is looked at now and then.
//
// Invariants (cited by the tests):
//   MCU1  Every key of a played channel that moves a node, a weight, a procedure or the camera's field is a time.
//   MCU2  Within a piece, rotations along a chain of nodes, that of the camera added, sum up to no more than kPieceTurn
//        (as far as kMaxPieces reach).
inline constexpr double kPieceTurn = 0.5;            // radians: second differences of quarters are within 0.2 %
inline constexpr std::size_t kMaxPieces = 16384;     // of a shutter
inline constexpr std::size_t kMaxBends = 32u << 20;  // pieces times drawables

// Times 0 to 1 of the shutter, ascending, both ends included.
struct CurveTime {
  double at;
  bool key = false;   // the velocity may change at once
  bool jump = false;  // so may places: a key of a step
};
std::vector<CurveTime> curve_times(const FrameGeometry& frame, int camera_node);

// How a drawable, or what is behind everything, moves on screen; all in pixels, of its point that is worst.
struct Bend {
  // The whole shutter is the unit of time.
  std::vector<float> acceleration;  // per piece: the most anywhere in it
  std::vector<float> kink;          // per time: change of velocity
  std::vector<float> jump;          // per time: change of place
  float zoom = 0;                   // from where the projection of shutter open has it
  unsigned off = 15;                // sides of the frame that all of it is beyond at all times
};

// Where the determinant of a node's transform changes its sign: what was a front turns into a back.
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

// Of a frame whose whole shutter is posed.
MotionCurves measure_motion(const FrameGeometry& frame, const CameraChoice& camera);

}  // namespace tessera::scene

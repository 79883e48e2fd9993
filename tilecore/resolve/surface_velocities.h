#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "base/image.h"
#include "base/rect.h"
#include "base/vec.h"
#include "scene/frame_geometry.h"
#include "tilecore/resolve/motion_field.h"
#include "tilecore/resolve/pixel_surfaces.h"
#include "tilecore/resolve/velocity_buffer.h"
#include "tilecore/tile_state.h"
#include "tilecore/visibility/sample_pattern.h"

namespace tessera::tilecore {

// The motion of what each pixel of a frame shows, for passes over images. Tiles write disjoint pixels.
//
//   velocity  pixels from the previous frame to this one, x and y, as half floats (rg16f). Infinite where the point was
//             behind the eye, or if there is no previous frame
//   depth     of the sample nearest to the pixel's middle; infinite where it sees no opaque surface
//
// Invariants (cited by the tests):
//   SV1  A pixel whose surface and camera rest has velocity 0, exactly.
//   SV2  A pixel of the background moves as a point at an infinite distance does; with an orthographic camera it rests.
//   SV3  Velocities are differences of places of surface points. They do not depend on where samples lie in pixels,
//        except through the point that a sample sees.
struct VelocityAttachment {
  // Begins a frame of `region` in pixels. `motion` from the previous frame, posed as `then`; both are nullptr if there is none,
  // and outlive the frame.
  void begin(IntRect region, const scene::FrameGeometry& now, const scene::FrameGeometry* then,
             const MotionField* motion);

  // Velocity of the background seen at a place, in pixels; infinite as above.
  Vec2 background(Vec2 pixel) const;
  // Whether the background may move: the machine then evaluates its velocities.
  bool background_turns() const { return sky_.has_value(); }

  IntRect region;
  const MotionField* motion = nullptr;
  Image velocity, depth;  // 2 channels and 1, row by row

 private:
  std::optional<DMat4>
      sky_;  // (x, y, 1, 0) of this frame's raster to the previous one's; nullopt: the background rests
};

// Finds the velocities of a tile's pixels; one instance per thread. Places and work are the resolve unit's
// (velocity_buffer.h): a point of a rigid drawable takes one matrix, a point of a deforming one its vertices in both
// frames. A blended surface has the velocity of the opaque one behind it.
class SurfaceVelocities {
 public:
  // Writes the tile's part of `out`. Call it once the tile's samples see their surfaces; hidden layers of `state` are
  // dropped. Returns the bytes of vertices of the previous frame that were read.
  std::uint64_t write(const scene::FrameGeometry& frame, const TileSamples& samples, TileState& state,
                      VelocityAttachment& out);

  // The work since the last call; `vertex_bytes` is 0, as write() has returned them.
  VelocityBuffer::Work take_work() { return std::exchange(work_, {}); }

 private:
  PixelSurfaces surfaces_;
  VelocityBuffer buffer_;
  VelocityBuffer::Work work_;
};

}  // namespace tessera::tilecore

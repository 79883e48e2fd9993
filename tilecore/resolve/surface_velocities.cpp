#include "tilecore/resolve/surface_velocities.h"

#include <algorithm>
#include <limits>

#include "base/half_float.h"

namespace tessera::tilecore {
namespace {

constexpr float kNowhere = std::numeric_limits<float>::infinity();

// Operations of four channels for a pixel of the background [by hand]: a matrix and a division, as for a rigid point.
constexpr std::uint64_t kBackgroundOperations = 5;

}  // namespace

void VelocityAttachment::begin(IntRect pixels, const scene::FrameGeometry& now, const scene::FrameGeometry* then,
                               const MotionField* field) {
  region = pixels;
  motion = field;
  if (velocity.width != region.width() || velocity.height != region.height()) {
    velocity = Image(region.width(), region.height(), 2);
    depth = Image(region.width(), region.height(), 1);
  }
  sky_.reset();
  if (then == nullptr || motion->camera_rests() || now.projection.orthographic || then->projection.orthographic) return;
  // A point at an infinite distance is a direction: it turns, and does not move.
  sky_ = then->projection.matrix() * then->views[0].world_to_camera * now.views[0].camera_to_world *
         now.projection.unprojection();
}

Vec2 VelocityAttachment::background(Vec2 pixel) const {
  if (motion == nullptr) return Vec2(kNowhere);
  if (!sky_) return Vec2(0.0f);
  const DVec4 there = *sky_ * DVec4(static_cast<double>(pixel.x), static_cast<double>(pixel.y), 1, 0);
  return there.w > 0 ? pixel - Vec2(DVec2(there.x, there.y) / there.w) : Vec2(kNowhere);
}

std::uint64_t SurfaceVelocities::write(const scene::FrameGeometry& frame, const TileSamples& samples, TileState& state,
                                       VelocityAttachment& out) {
  surfaces_.gather(frame, samples, state, out.motion);
  buffer_.start(frame, samples, state, surfaces_, out.motion);
  const IntRect& tile = surfaces_.pixels;
  const auto spp = static_cast<std::size_t>(surfaces_.spp);
  for (int top = tile.y0; top < tile.y1; top += 4)
    for (int left = tile.x0; left < tile.x1; left += 4) {
      const IntRect block{left, top, std::min(left + 4, tile.x1), std::min(top + 4, tile.y1)};
      const bool still = buffer_.evaluate(block, BlockSpeed::kMax, true).still;
      for (int y = block.y0; y < block.y1; ++y)
        for (int x = block.x0; x < block.x1; ++x) {
          const std::size_t pixel = surfaces_.index(x, y), s = pixel * spp + surfaces_.center_sample;
          Vec2 velocity = buffer_.velocity()[pixel];
          if (surfaces_.patch[pixel] == TileState::kNoPatch) {
            velocity = out.background({samples.x[s], samples.y[s]});
            if (out.background_turns()) work_.operations += kBackgroundOperations;
          } else if (out.motion == nullptr ||
                     (!still && velocity == Vec2(0.0f) && buffer_.then_depth()[pixel] == 0.0f)) {
            velocity = Vec2(kNowhere);  // the buffer leaves zeroes for a point without a place
          }
          const auto stored = out.velocity.at(x - out.region.x0, y - out.region.y0);
          stored[0] = round_to_half(velocity.x), stored[1] = round_to_half(velocity.y);
          out.depth.at(x - out.region.x0, y - out.region.y0)[0] = surfaces_.depth[pixel];
        }
    }
  const VelocityBuffer::Work more = buffer_.take_work();
  work_.operations += more.operations, work_.places += more.places;
  return more.vertex_bytes;
}

}  // namespace tessera::tilecore

#pragma once

#include <cstdint>
#include <vector>

#include "base/vec.h"
#include "scene/frame_geometry.h"

namespace tessera::tilecore {

// Irradiance over pi, what a white diffuse surface shows of it, below which a light does not count: the least
// step of an image of eight bits. A highlight of a smooth surface may show more; the discrepancy check finds it.
inline constexpr float kUnseenLight = 1.0f / 256;

// Where lights that differ between two frames fall, in either of them, and shadows of what casts and differs: what colours
// may not be taken over from the earlier one. Point and spot lights fade with distance (KHR_lights_punctual), so that each has a sphere beyond which
// nothing shows that it changed; a spot lights its cone alone. Directional lights reach everything. A drawable that is elsewhere in the
// two frames, or moves within one, may change all that point and spot lights reach which cast shadows, and what lies
// behind its bounding sphere along the rays of a directional one.
//
// Invariant (cited by the tests):
//   LR1  Where nothing reaches, irradiance of what changed is at most pi * kUnseenLight, all such lights together.
class LightReach {
 public:
  LightReach() = default;
  // Both frames are of one assembly; `now` may be seen with any projection.
  LightReach(const scene::FrameGeometry& now, const scene::FrameGeometry& then);

  bool none() const { return volumes_.empty() && !everywhere_; }
  bool everywhere() const { return everywhere_; }
  std::size_t volumes() const { return volumes_.size(); }

  // Whether any falls on the ball around `middle`, in world space.
  bool reaches(Vec3 middle, float radius) const;
  // World position of the point at depth z that frame `now` shows at `pixel`.
  Vec3 point(Vec2 pixel, float z) const {
    const float w = orthographic_ ? 1.0f : z;
    return Vec3(to_world_[0] * (pixel.x * w) + to_world_[1] * (pixel.y * w) + to_world_[2] * z + to_world_[3]);
  }

 private:
  enum class Shape : std::uint8_t { kSphere, kCone, kShaft };
  struct Volume {
    Vec3 position, direction;
    float radius;
    Shape shape;         // kShaft: a sphere, and all that is behind it along the direction
    float cosine, sine;  // of a cone's outer angle
  };
  // So many drawables that cast and move have a shaft each; more, and everything is reached.
  static constexpr std::size_t kMaxShafts = 64;

  void add(const shaders::Light& light, float least);
  // Shadows of what moves, of lights that cast.
  void add_shadows(const scene::FrameGeometry& now, const scene::FrameGeometry& then);

  std::vector<Volume> volumes_;
  bool everywhere_ = false, orthographic_ = false;
  Mat4 to_world_{1.0f};
};

}  // namespace tessera::tilecore

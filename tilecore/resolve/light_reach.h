#pragma once

#include <cstdint>
#include <vector>

#include "base/vec.h"
#include "scene/frame_geometry.h"

namespace tessera::tilecore {

// Irradiance over pi, what a white diffuse surface shows of it, below which a light does not count: the least
// step of an image of eight bits. A highlight of a smooth surface may show more; the discrepancy check finds it.
inline constexpr float kUnseenLight = 1.0f / 256;

// Where lights that differ between two frames fall, in either of them: what colours may not be taken over from the
// earlier one. Point and spot lights fade with distance (KHR_lights_punctual), so that each has a sphere beyond which
// nothing shows that it changed; a spot lights its cone alone. Directional lights reach everything.
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
  struct Volume {
    Vec3 position, direction;
    float radius;
    bool cone;
    float cosine, sine;  // of its outer angle
  };
  void add(const shaders::Light& light, float least);

  std::vector<Volume> volumes_;
  bool everywhere_ = false, orthographic_ = false;
  Mat4 to_world_{1.0f};
};

}  // namespace tessera::tilecore

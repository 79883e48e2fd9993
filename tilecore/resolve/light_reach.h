#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/vec.h"
#include "scene/frame_geometry.h"

namespace tessera::tilecore {

// Irradiance over pi, the radiance of a white diffuse surface, below which a light does not count: the least step of an
// image of eight bits. A highlight of a smooth surface may be brighter; the discrepancy check finds it.
inline constexpr float kUnseenLight = 1.0f / 256;

// The places where light may differ between two frames: colours there may not be taken from the earlier frame. A light
// that differs affects its reach in either frame. Point and spot lights fade with distance (KHR_lights_punctual), so
// each has a sphere beyond which its change is invisible; a spot affects its cone alone. Directional lights reach
// everything. A shadow caster that moves between the two frames, or within one, affects the whole reach of point and
// spot lights that cast and, for a directional one, the space behind its bounding sphere along the rays.
//
// Invariant (cited by the tests):
//   LR1  Outside of the reach, the irradiance of all changed lights together is at most pi * kUnseenLight.
class LightReach {
 public:
  LightReach() = default;
  // Both frames are of one assembly; `now` may be seen with any projection.
  LightReach(const scene::FrameGeometry& now, const scene::FrameGeometry& then);

  bool none() const { return volumes_.empty() && !everywhere_; }
  bool everywhere() const { return everywhere_; }
  std::size_t volumes() const { return volumes_.size(); }

  // Whether any changed light falls on the ball around `middle`, in world space.
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
    Shape shape;         // kShaft: a sphere and the space behind it along the direction
    float cosine, sine;  // of a cone's outer angle
  };
  // Each moving caster has a shaft, up to this number; with more, everything is reached.
  static constexpr std::size_t kMaxShafts = 64;

  void add(const shaders::Light& light, float least);
  // Adds the space in which moved drawables may change the shadow of a directional light.
  void add_shafts(const scene::FrameGeometry& now, const scene::FrameGeometry& then, std::span<const std::size_t> moved,
                  std::size_t light);

  std::vector<Volume> volumes_;
  bool everywhere_ = false, orthographic_ = false;
  Mat4 to_world_{1.0f};
};

}  // namespace tessera::tilecore

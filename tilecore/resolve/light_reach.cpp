#include "tilecore/resolve/light_reach.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tessera::tilecore {
namespace {

using shaders::Light;

// Both ends of the shutter of a light that the frame has.
struct Keys {
  const Light &open, &close;
  bool operator==(const Keys& o) const { return open == o.open && close == o.close; }
};
Keys keys_of(const scene::FrameGeometry& frame, std::size_t light) {
  return {frame.lights[0][light], frame.lights[1][light]};
}

}  // namespace

LightReach::LightReach(const scene::FrameGeometry& now, const scene::FrameGeometry& then)
    : orthographic_(now.projection.orthographic),
      to_world_(Mat4(now.views[0].camera_to_world * now.projection.unprojection())) {
  if (now.lights == then.lights) return;
  const std::size_t count = now.lights[0].size();
  // Lights come and go: which is which nobody knows. Curved motion leads elsewhere than the keys say.
  if (count != then.lights[0].size() || !now.segments.empty() || !then.segments.empty()) {
    everywhere_ = true;
    return;
  }
  std::vector<std::size_t> changed;
  for (std::size_t i = 0; i < count; ++i)
    if (!(keys_of(now, i) == keys_of(then, i))) changed.push_back(i);
  for (const std::size_t i : changed)
    for (const scene::FrameGeometry* frame : {&now, &then})
      for (std::size_t key = 0; key < 2; ++key)
        add(frame->lights[key][i], kUnseenLight / static_cast<float>(changed.size()));
}

void LightReach::add(const Light& light, float least) {
  const float brightest = std::max({light.color.x, light.color.y, light.color.z});
  if (light.type == Light::Type::kDirectional) {
    everywhere_ = everywhere_ || brightest > 0.0f;
    return;
  }
  float radius = std::sqrt(brightest / (std::numbers::pi_v<float> * least));
  if (light.range > 0.0f) radius = std::min(radius, light.range);
  if (!(radius > 0.0f)) return;
  const bool cone = light.type == Light::Type::kSpot && light.cos_outer > 0.0f;
  volumes_.push_back({light.position, light.direction, radius, cone, light.cos_outer,
                      std::sqrt(std::max(0.0f, 1.0f - light.cos_outer * light.cos_outer))});
}

bool LightReach::reaches(Vec3 middle, float radius) const {
  return everywhere_ || std::any_of(volumes_.begin(), volumes_.end(), [&](const Volume& volume) {
           const Vec3 offset = middle - volume.position;
           const float distance2 = glm::dot(offset, offset), reach = volume.radius + radius;
           // Not less: what is not a number is reached.
           if (distance2 > reach * reach) return false;
           if (!volume.cone) return true;
           // How far outside of the cone's mantle the middle is, on a plane through its axis.
           const float along = glm::dot(offset, volume.direction),
                       across = std::sqrt(std::max(0.0f, distance2 - along * along));
           return !(across * volume.cosine - along * volume.sine > radius);
         });
}

}  // namespace tessera::tilecore

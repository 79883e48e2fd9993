#include "tilecore/resolve/light_reach.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "scene/drawable_box.h"
#include "scene/light_views.h"

namespace tessera::tilecore {
namespace {

using shaders::Light;

// A light of the frame at both ends of the shutter.
struct Keys {
  const Light &open, &close;
  bool operator==(const Keys& o) const { return open == o.open && close == o.close; }
};
Keys keys_of(const scene::FrameGeometry& frame, std::size_t light) {
  return {frame.lights[0][light], frame.lights[1][light]};
}

// Whether it casts with some setting of shadows.blended.
bool may_cast(const scene::PosedDrawable& drawable) {
  return drawable.visible && scene::casts(*drawable.material, scene::BlendedCasters::kSolid);
}

// Whether a drawable may shade other places in one frame than in the other, or does within one.
bool shades_otherwise(const scene::PosedDrawable& now, const scene::PosedDrawable& then) {
  if (may_cast(now) != may_cast(then)) return true;
  if (!may_cast(now)) return false;
  if (now.deforming || then.deforming || !now.own_vertices || !then.own_vertices) return true;
  return now.to_world[0] != now.to_world[1] || now.to_world != then.to_world || now.procedure != then.procedure;
}

// The box around a drawable at both keys of both frames.
scene::SpaceBox box_around(const scene::PosedDrawable& now, const scene::PosedDrawable& then) {
  scene::SpaceBox box;
  for (const scene::PosedDrawable* drawable : {&now, &then})
    for (std::size_t key = 0; key < 2; ++key) box.add(scene::world_box(*drawable, key, scene::own_box(*drawable, key)));
  return box;
}

bool casts_at(const scene::FrameGeometry& frame, std::size_t light) {
  return light < frame.light_casts.size() && frame.light_casts[light];
}

// Drawables that may cast and differ; none where no light casts.
std::vector<std::size_t> moved_casters(const scene::FrameGeometry& now, const scene::FrameGeometry& then) {
  std::vector<std::size_t> moved;
  if (std::ranges::none_of(now.light_casts, std::identity()) && std::ranges::none_of(then.light_casts, std::identity()))
    return moved;
  for (std::size_t d = 0; d < now.drawables.size(); ++d)
    if (shades_otherwise(now.drawables[d], then.drawables[d])) moved.push_back(d);
  return moved;
}

}  // namespace

LightReach::LightReach(const scene::FrameGeometry& now, const scene::FrameGeometry& then)
    : orthographic_(now.projection.orthographic),
      to_world_(Mat4(now.views[0].camera_to_world * now.projection.unprojection())) {
  const std::vector<std::size_t> moved = moved_casters(now, then);
  const bool lights_differ = now.lights != then.lights;
  if (moved.empty() && !lights_differ) return;
  const std::size_t count = now.lights[0].size();
  // If the number of lights changes, no light has a known counterpart. With curved motion the keys do not bound the
  // path.
  if (count != then.lights[0].size() || ((!now.segments.empty() || !then.segments.empty()) && lights_differ)) {
    everywhere_ = true;
    return;
  }
  std::vector<std::size_t> changed;  // lights that differ, or that a moving drawable shadows
  for (std::size_t i = 0; i < count; ++i) {
    const bool same = keys_of(now, i) == keys_of(then, i), casts = casts_at(now, i) || casts_at(then, i);
    if (same && casts && !moved.empty() && now.lights[0][i].type == Light::Type::kDirectional)
      add_shafts(now, then, moved, i);
    else if (!same || (casts && !moved.empty()))
      changed.push_back(i);
  }
  for (const std::size_t i : changed)
    for (const scene::FrameGeometry* frame : {&now, &then})
      for (std::size_t key = 0; key < 2; ++key)
        add(frame->lights[key][i], kUnseenLight / static_cast<float>(changed.size()));
}

void LightReach::add_shafts(const scene::FrameGeometry& now, const scene::FrameGeometry& then,
                            std::span<const std::size_t> moved, std::size_t light) {
  // Within curved motion drawables are elsewhere than at the keys.
  if (moved.size() > kMaxShafts || !now.segments.empty() || !then.segments.empty()) {
    everywhere_ = true;
    return;
  }
  for (const std::size_t d : moved) {
    const scene::SpaceBox box = box_around(now.drawables[d], then.drawables[d]);
    if (!box.empty())
      volumes_.push_back({Vec3(box.middle()), now.lights[0][light].direction,
                          static_cast<float>(glm::length(box.half())) * (1 + 1e-6f), Shape::kShaft, 0, 0});
  }
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
  volumes_.push_back({light.position, light.direction, radius, cone ? Shape::kCone : Shape::kSphere, light.cos_outer,
                      std::sqrt(std::max(0.0f, 1.0f - light.cos_outer * light.cos_outer))});
}

bool LightReach::reaches(Vec3 middle, float radius) const {
  return everywhere_ || std::any_of(volumes_.begin(), volumes_.end(), [&](const Volume& volume) {
           const Vec3 offset = middle - volume.position;
           const float distance2 = glm::dot(offset, offset), reach = volume.radius + radius;
           if (volume.shape == Shape::kShaft) {
             const float behind = std::max(0.0f, glm::dot(offset, volume.direction));
             return !(distance2 - behind * behind > reach * reach);
           }
           // Not written as "less", so that NaN counts as reached.
           if (distance2 > reach * reach) return false;
           if (volume.shape == Shape::kSphere) return true;
           // Distance of the middle from the cone's mantle, to the outside, on a plane through its axis.
           const float along = glm::dot(offset, volume.direction),
                       across = std::sqrt(std::max(0.0f, distance2 - along * along));
           return !(across * volume.cosine - along * volume.sine > radius);
         });
}

}  // namespace tessera::tilecore

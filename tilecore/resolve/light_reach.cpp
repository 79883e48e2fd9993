#include "tilecore/resolve/light_reach.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
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

bool casts(const scene::PosedDrawable& drawable) {
  return drawable.visible && !drawable.material->unlit && drawable.material->alpha_mode != scene::AlphaMode::kBlend;
}

// Whether a drawable may shade other places in one frame than in the other, or does within one.
bool shades_otherwise(const scene::PosedDrawable& now, const scene::PosedDrawable& then) {
  if (casts(now) != casts(then)) return true;
  if (!casts(now)) return false;
  if (now.deforming || then.deforming || !now.own_vertices || !then.own_vertices) return true;
  return now.to_world[0] != now.to_world[1] || now.to_world != then.to_world;
}

struct Sphere {
  Vec3 middle{0.0f};
  float radius = -1;
};
// Around a drawable at both keys of both frames; a negative radius: it has no points.
Sphere sphere_around(const scene::PosedDrawable& now, const scene::PosedDrawable& then) {
  Vec3 low(std::numeric_limits<float>::infinity()), high(-low);
  for (const scene::PosedDrawable* drawable : {&now, &then})
    for (std::size_t key = 0; key < 2; ++key) {
      Vec3 of_low(std::numeric_limits<float>::infinity()), of_high(-of_low);
      for (const Vec3& p : drawable->positions[key]) of_low = glm::min(of_low, p), of_high = glm::max(of_high, p);
      if (drawable->material->displacement) {
        const auto reach = static_cast<float>(scene::displacement_limit(*drawable->material->displacement));
        of_low -= reach, of_high += reach;
      }
      for (int k = 0; k < 8 && of_low.x <= of_high.x; ++k) {
        const Vec3 corner((k & 1) != 0 ? of_high.x : of_low.x, (k & 2) != 0 ? of_high.y : of_low.y,
                          (k & 4) != 0 ? of_high.z : of_low.z);
        const Vec3 at(drawable->to_world[key] * Vec4(corner, 1.0f));
        low = glm::min(low, at), high = glm::max(high, at);
      }
    }
  if (!(low.x <= high.x)) return {};
  return {0.5f * (low + high), 0.5f * glm::length(high - low)};
}

}  // namespace

LightReach::LightReach(const scene::FrameGeometry& now, const scene::FrameGeometry& then)
    : orthographic_(now.projection.orthographic),
      to_world_(Mat4(now.views[0].camera_to_world * now.projection.unprojection())) {
  add_shadows(now, then);
  if (everywhere_ || now.lights == then.lights) return;
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

void LightReach::add_shadows(const scene::FrameGeometry& now, const scene::FrameGeometry& then) {
  if (std::ranges::none_of(now.light_casts, std::identity()) && std::ranges::none_of(then.light_casts, std::identity()))
    return;
  std::vector<std::size_t> moved;
  for (std::size_t d = 0; d < now.drawables.size() && moved.size() <= kMaxShafts; ++d)
    if (shades_otherwise(now.drawables[d], then.drawables[d])) moved.push_back(d);
  if (moved.empty()) return;
  // Procedures have no points to be found by.
  const auto unbounded = [&](std::size_t d) { return now.drawables[d].procedure != nullptr; };
  everywhere_ = moved.size() > kMaxShafts || std::ranges::any_of(moved, unbounded) || !now.segments.empty() ||
                !then.segments.empty();
  if (everywhere_) return;
  std::vector<Sphere> spheres;
  for (const std::size_t d : moved)
    if (const Sphere sphere = sphere_around(now.drawables[d], then.drawables[d]); sphere.radius >= 0)
      spheres.push_back(sphere);
  for (const scene::FrameGeometry* frame : {&now, &then})
    for (std::size_t light = 0; light < frame->light_casts.size(); ++light) {
      if (!frame->light_casts[light]) continue;
      const Light& of = frame->lights[0][light];
      if (of.type != Light::Type::kDirectional) {
        add(of, kUnseenLight);
        continue;
      }
      for (const Sphere& sphere : spheres)
        volumes_.push_back({sphere.middle, of.direction, sphere.radius, Shape::kShaft, 0, 0});
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
           // Not less: what is not a number is reached.
           if (distance2 > reach * reach) return false;
           if (volume.shape == Shape::kSphere) return true;
           // How far outside of the cone's mantle the middle is, on a plane through its axis.
           const float along = glm::dot(offset, volume.direction),
                       across = std::sqrt(std::max(0.0f, distance2 - along * along));
           return !(across * volume.cosine - along * volume.sine > radius);
         });
}

}  // namespace tessera::tilecore

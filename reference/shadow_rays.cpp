#include "reference/shadow_rays.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "scene/view.h"
#include "tilecore/shading/alpha_test.h"

namespace tessera::reference {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Hits on the first stretch behind a ray's start do not count. Its length, over the distance of the start from the
// camera, is far above the loss of double precision and far below any visible effect.
constexpr double kSkipped = 1e-9;

DMat4 world_to_space(const ReferenceScene& scene, std::size_t key) {
  scene::Projection centred = scene.posed.projections[key];
  centred.center_x = centred.center_y = 0;
  return centred.matrix() * scene.posed.views[key].world_to_camera;
}

ShadowScene::Light end_of_rays(const ReferenceScene& scene, const scene::ShadowLight& light) {
  const shaders::Light &open = scene.posed.lights[0][light.light], &close = scene.posed.lights[1][light.light];
  ShadowScene::Light out;
  out.number = light.light;
  out.directional = open.type == shaders::Light::Type::kDirectional;
  if (!out.directional && open.range > 0 && close.range > 0)
    out.range = static_cast<double>(std::max(open.range, close.range));
  const auto node = static_cast<std::size_t>(scene.frame.light_nodes[light.light]);
  for (std::size_t key = 0; key < 2; ++key) {
    // Computed in double precision, as single precision loses positions far from the world's origin.
    const DMat4 world = scene::view_from_world(scene.posed.poses[key].world[node]).camera_to_world;
    out.at[key] = DVec3(world_to_space(scene, key) * (out.directional ? DVec4(DVec3(world[2]), 0.0) : world[3]));
  }
  return out;
}

}  // namespace

ShadowScene::ShadowScene(const ReferenceScene& seen, const scene::ShadowSettings& settings, scene::MemoryBudget* budget)
    : light_count_(seen.frame.lights[0].size()), unit_(1.0 / seen.posed.projection.scale) {
  for (const scene::ShadowLight& light : scene::shadow_lights(seen.frame, settings))
    lights_.push_back(end_of_rays(seen, light));
  if (any())
    casters_ = std::make_unique<ReferenceScene>(
        seen.frame, ReferenceScene::Options{
                        .segment = seen.segment, .casters = &settings, .region = seen.region, .budget = budget});
}

void ShadowTracer::sort_ray(const ShadowScene& scene, const ShadowScene::Light& light,
                            std::span<const ShadowReceiver> receivers, std::size_t receiver) {
  const ShadowReceiver& from = receivers[receiver];
  const DVec3 units(scene.unit(), scene.unit(), 1.0);
  const DVec3 end = light.at[0] * (1.0 - from.t) + light.at[1] * from.t, way = light.directional ? end : end - from.at,
              seen_way = way * units;
  if (light.range > 0 && glm::length(seen_way) > light.range) return;
  // The ray is a function of the axis along which it is steepest, in scene units.
  int axis = 0;
  for (int k = 1; k < 3; ++k)
    if (std::abs(seen_way[k]) > std::abs(seen_way[axis])) axis = k;
  if (!(std::abs(way[axis]) > 0)) return;  // the receiver is at the light
  const int x = (axis + 1) % 3, y = (axis + 2) % 3;
  const bool above = way[axis] > 0;
  Ray ray{receiver, 0, 0, way[x] / way[axis], way[y] / way[axis], 0, 0};
  ray.origin_x = from.at[x] - from.at[axis] * ray.direction_x;
  ray.origin_y = from.at[y] - from.at[axis] * ray.direction_y;
  const DVec3 size = glm::abs(from.at) * units;
  const double skipped = kSkipped * std::max({size.x, size.y, size.z}) / units[axis];
  const double light_end = light.directional ? (above ? kInfinity : -kInfinity) : end[axis];
  ray.from = above ? from.at[axis] + skipped : light_end;
  ray.to = above ? light_end : from.at[axis] - skipped;
  rays_[static_cast<std::size_t>(2 * axis + (above ? 1 : 0))].push_back(ray);
}

void ShadowTracer::trace_rays(const ShadowScene& scene, std::span<const ShadowReceiver> receivers,
                              std::span<const Ray> rays, std::vector<float>& shares) {
  const ReferenceScene& casters = scene.casters();
  for (std::size_t first = 0; first < rays.size(); first += ShadowPacket::kRays) {
    for (std::size_t r = 0; r < ShadowPacket::kRays; ++r) {
      const Ray& ray = rays[std::min(first + r, rays.size() - 1)];
      packet_.origin_x[r] = ray.origin_x, packet_.origin_y[r] = ray.origin_y;
      packet_.direction_x[r] = ray.direction_x, packet_.direction_y[r] = ray.direction_y;
      packet_.from[r] = ray.from, packet_.to[r] = ray.to;
      packet_.t[r] = receivers[ray.receiver].t;
      packet_.patch[r] = receivers[ray.receiver].patch, packet_.triangle[r] = receivers[ray.receiver].triangle;
    }
    trace_shadows(casters, packet_);
    const std::size_t count = std::min(ShadowPacket::kRays, rays.size() - first);
    for (const RayPacket::Crossing& c : packet_.crossings) {
      if (c.ray >= count || packet_.blocked[c.ray] != 0) continue;
      const scene::Material& material =
          *casters.frame.drawable_of(casters.triangles[static_cast<std::size_t>(c.triangle)].patch).material;
      const double time = receivers[rays[first + c.ray].receiver].shutter_time;
      if (tilecore::finest_alpha(casters.frame, casters.location(c.triangle, c.b1, c.b2, time)) >=
          material.alpha_cutoff)
        packet_.blocked[c.ray] = 1;
    }
    for (std::size_t r = 0; r < count; ++r)
      if (packet_.blocked[r] != 0) shares[rays[first + r].receiver] = 0.0f;
  }
}

void ShadowTracer::trace(const ShadowScene& scene, std::span<const ShadowReceiver> receivers,
                         tilecore::KnownShadows& shares) {
  shares.by_light.resize(scene.light_count());
  for (std::vector<float>& light : shares.by_light) light.clear();
  for (const ShadowScene::Light& light : scene.lights()) {
    std::vector<float>& lit = shares.by_light[light.number];
    lit.assign(receivers.size(), 1.0f);
    for (std::vector<Ray>& rays : rays_) rays.clear();
    for (std::size_t k = 0; k < receivers.size(); ++k) sort_ray(scene, light, receivers, k);
    for (std::size_t k = 0; k < rays_.size(); ++k) {
      packet_.axis = static_cast<int>(k / 2), packet_.light_above = k % 2 == 1;
      trace_rays(scene, receivers, rays_[k], lit);
    }
  }
}

}  // namespace tessera::reference

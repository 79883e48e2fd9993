#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "reference/reference_kernel.h"
#include "reference/reference_scene.h"
#include "scene/light_views.h"
#include "tilecore/shading/pixel_shader.h"

namespace tessera::reference {

// The casters of a scene and its lights that cast shadows: all data that shadow rays need.
//
// A ray runs from the point that a sample sees to the light, at the sample's time, in double precision. It runs in
// the space of ReferenceScene, which is linear in the scene's points. There casters are the same triangles, with the
// same grids, that samples see, and a light is a point that moves on a straight line between the motion keys. So no
// light needs a view of its own, and a surface meets itself only where the ray starts.
//
// Casters are all surfaces of scene::casts(), inside or outside the view; points and lines are as wide as the camera
// sees them. An alpha test reads the finest level of its texture, as a ray covers no pixel. Rays ignore the
// `distance` of a capture: beyond the end of its maps the machine lights everything, which is its error.
//
// Invariants (cited by the tests):
//   SHR1  The hit of a shadow ray does not depend on the tree.
//   SHR2  A plane without objects on it is lit everywhere, however grazing the light.
class ShadowScene {
 public:
  // A light, the end of shadow rays.
  struct Light {
    std::uint32_t number = 0;  // number in FrameGeometry::lights
    bool directional = false;
    std::array<DVec3, 2> at;  // its position, or the direction towards it, at both motion keys
    double range = 0;         // scene units; 0: unlimited
  };

  // `seen` must outlive it. `settings` choose the faces and the blended surfaces that cast; sizes, filters and biases
  // apply to maps only. `budget`: see ReferenceScene::Options.
  ShadowScene(const ReferenceScene& seen, const scene::ShadowSettings& settings, scene::MemoryBudget* budget = nullptr);

  bool any() const { return !lights_.empty(); }
  std::span<const Light> lights() const { return lights_; }
  std::size_t light_count() const { return light_count_; }  // lights of the frame, whether they cast or not
  const ReferenceScene& casters() const { return *casters_; }
  double unit() const { return unit_; }  // scene units per unit along x and y

 private:
  std::vector<Light> lights_;
  std::size_t light_count_ = 0;
  double unit_ = 1;
  std::unique_ptr<ReferenceScene> casters_;  // nullptr where no light casts
};

// Start of a shadow ray.
struct ShadowReceiver {
  DVec3 at;                 // in the scene's space
  double t = 0;             // time between its motion keys
  double shutter_time = 0;  // time of the whole shutter
  std::uint32_t patch = 0, triangle = 0;
};

// Traces a thread's shadow rays and keeps its scratch memory.
class ShadowTracer {
 public:
  // Finds the share of each light at each receiver, 0 or 1.
  void trace(const ShadowScene& scene, std::span<const ShadowReceiver> receivers, tilecore::KnownShadows& shares);

 private:
  struct Ray {
    std::size_t receiver;
    double origin_x, origin_y, direction_x, direction_y, from, to;
  };
  void sort_ray(const ShadowScene& scene, const ShadowScene::Light& light, std::span<const ShadowReceiver> receivers,
                std::size_t receiver);
  // Traces rays along an axis.
  void trace_rays(const ShadowScene& scene, std::span<const ShadowReceiver> receivers, std::span<const Ray> rays,
                  std::vector<float>& shares);

  std::array<std::vector<Ray>, 6> rays_;  // by axis; the last three have the light above
  ShadowPacket packet_;
};

}  // namespace tessera::reference

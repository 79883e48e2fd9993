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

// The casters of a scene and its lights that cast: all that shadow rays ask for.
//
// A ray runs from what a sample sees to the light, at the sample's time, in double precision. It lives in the space of the
// scene that samples look at, which is linear in the scene's points: there casters are the very triangles that samples
// see, with the same grids, and a light is one more point that moves on a straight line between the motion keys. So no
// light needs a view of its own, and a surface meets itself nowhere but where the ray starts.
//
// Casters are those of scene::casts() wherever they are; points and lines are as wide as the camera sees them.
// An alpha test reads the finest level of its texture, as a ray covers no pixel. Rays know no `distance` of a capture:
// where maps end and everything is lit, the machine errs.
//
// Invariants (cited by the tests):
//   SHR1  What a shadow ray meets does not depend on the tree.
//   SHR2  A plane that nothing stands on is lit wherever it is, however grazing the light.
class ShadowScene {
 public:
  // Ends of shadow rays.
  struct Light {
    std::uint32_t number = 0;  // of FrameGeometry::lights
    bool directional = false;
    std::array<DVec3, 2> at;  // its place, or the direction towards it, at both motion keys
    double range = 0;         // scene units; 0: unlimited
  };

  // `seen` must outlive it. `settings`: the faces and the blended surfaces that cast; sizes, filters and biases belong to
  // maps. `budget`: as ReferenceScene has it.
  ShadowScene(const ReferenceScene& seen, const scene::ShadowSettings& settings, scene::MemoryBudget* budget = nullptr);

  bool any() const { return !lights_.empty(); }
  std::span<const Light> lights() const { return lights_; }
  std::size_t light_count() const { return light_count_; }  // of the frame, whether they cast or not
  const ReferenceScene& casters() const { return *casters_; }
  double unit() const { return unit_; }  // scene units of one along x and y

 private:
  std::vector<Light> lights_;
  std::size_t light_count_ = 0;
  double unit_ = 1;
  std::unique_ptr<ReferenceScene> casters_;  // nullptr where no light casts
};

// Where shadow rays begin.
struct ShadowReceiver {
  DVec3 at;                 // in the scene's space
  double t = 0;             // of its motion keys
  double shutter_time = 0;  // of the whole shutter
  std::uint32_t patch = 0, triangle = 0;
};

// A thread's shadow rays. Keeps its scratch memory.
class ShadowTracer {
 public:
  // The share of each light at each receiver, 0 or 1.
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

  std::array<std::vector<Ray>, 6> rays_;  // by axis; those whose light is above behind those whose light is below
  ShadowPacket packet_;
};

}  // namespace tessera::reference

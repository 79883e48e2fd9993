#include "scene/motion_segments.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/parallel.h"
#include "scene/subpixel.h"
#include "scene/wires.h"
#include "shaders_cpp/procedures/procedures.h"

namespace tessera::scene {
namespace {

constexpr std::size_t kProbes = 3;   // times inside the shutter
constexpr std::size_t kPoints = 64;  // of a primitive

struct Probe {
  double t;  // of the shutter
  Pose pose;
  PosedProcedures procedures;
  View view;
  Projection projection;
};

// What a projection shows of a point, and whether it is in front of the near plane.
struct OnScreen {
  DVec2 pixel;
  bool in_front;
};

OnScreen on_screen(const DVec4& raster, const Projection& projection) {
  const double w = projection.orthographic ? 1.0 : std::max(raster.w, projection.near);
  return {DVec2(raster.x, raster.y) / w, projection.orthographic || raster.w >= projection.near};
}

// Which sides of the frame a point is beyond: bits.
unsigned beyond(const DVec2& p, const FrameRequest& request) {
  return (p.x < 0 ? 1u : 0u) | (p.x > request.width ? 2u : 0u) | (p.y < 0 ? 4u : 0u) | (p.y > request.height ? 8u : 0u);
}

// Distances in pixels.
struct Deviation {
  double from_chord = 0;  // of the projected points from linear motion between the motion keys
  double from_zoom = 0;   // of where the keys are from where the projection of shutter open has them
  unsigned off = 15;      // sides that everything is beyond at all times

  Deviation merged(const Deviation& o) const {
    return {std::max(from_chord, o.from_chord), std::max(from_zoom, o.from_zoom), off & o.off};
  }
};

class DeviationMeter {
 public:
  DeviationMeter(const FrameGeometry& frame, const CameraChoice& camera) : frame_(frame) {
    const Capture& capture = *frame.assembly->capture;
    const FrameRequest& request = frame.request;
    for (std::size_t k = 0; k < 2; ++k)
      projections_[k] = make_projection(camera.at(capture, k == 0 ? request.open_time : request.close_time),
                                        request.width, request.height);
    for (std::size_t k = 0; k < kProbes; ++k) {
      Probe& probe = probes_[k];
      probe.t = static_cast<double>(k + 1) / static_cast<double>(kProbes + 1);
      const double time = request.open_time + (request.close_time - request.open_time) * probe.t;
      probe.pose = pose_at(capture, time);
      probe.procedures = pose_procedures(capture, time, time);
      probe.view = camera.view(probe.pose);
      probe.projection = make_projection(camera.at(capture, time), request.width, request.height);
    }
  }

  // The drawables of one primitive, which share its vertices.
  void measure(const DrawnPrimitive& drawn, std::vector<Deviation>& out) const {
    const Capture& capture = *frame_.assembly->capture;
    const PosedDrawable& first = frame_.drawables[drawn.first_drawable];
    const Drawable& drawable = *first.drawable;
    const bool wire = first.primitive->wire != Primitive::Wire::kSurface;
    const bool changes = first.procedure == nullptr && (wire || is_deforming(capture, drawable.node, *first.primitive));
    std::array<Deformed, kProbes> deformed;
    if (changes)
      for (std::size_t k = 0; k < kProbes; ++k) {
        deform(capture, drawable.node, *first.primitive, probes_[k].pose, deformed[k]);
        if (wire)
          spread_wires(*first.primitive,
                       object_to_world(capture, drawable.node, drawable.instance, *first.primitive, probes_[k].pose),
                       probes_[k].view, probes_[k].projection, deformed[k]);
      }
    for (std::uint32_t i = 0; i < drawn.count; ++i) {
      const std::size_t d = drawn.drawable(i);
      const PosedDrawable& posed = frame_.drawables[d];
      if (posed.visible) out[d] = measure_drawable(posed, deformed);
    }
  }

  // What lies behind everything, as it turns with the camera: the image's corners and middle, infinitely far away.
  Deviation measure_background() const {
    const FrameRequest& request = frame_.request;
    const Motion motion = motion_of([](const Pose&, const View&) { return DMat4(1.0); });
    Deviation worst;
    if (frame_.projection.orthographic || motion.still()) return worst;
    for (int k = 0; k < 9; ++k) {
      const DVec3 along((0.5 * (k % 3) * request.width - frame_.projection.center_x) / frame_.projection.scale,
                        -(0.5 * (k / 3) * request.height - frame_.projection.center_y) / frame_.projection.scale, -1);
      const DVec4 far(DMat3(frame_.views[0].camera_to_world) * along, 0.0);
      measure_point(
          motion, {far, far}, [&](std::size_t) { return far; }, worst);
    }
    worst.off = 0;
    return worst;
  }

 private:
  // To raster space, at the motion keys (with their own projections and with that of shutter open) and at the probes.
  struct Motion {
    std::array<DMat4, 2> key, unzoomed;
    std::array<DMat4, kProbes> between;

    bool still() const {
      return key[0] == key[1] && key[0] == unzoomed[0] &&
             std::all_of(between.begin(), between.end(), [&](const DMat4& m) { return m == key[0]; });
    }
  };
  template <class World>
  Motion motion_of(const World& world) const {
    Motion motion;
    for (std::size_t k = 0; k < 2; ++k) {
      const DMat4 camera = frame_.views[k].world_to_camera * world(frame_.poses[k], frame_.views[k]);
      motion.key[k] = projections_[k].matrix() * camera;
      motion.unzoomed[k] = frame_.projection.matrix() * camera;
    }
    for (std::size_t k = 0; k < kProbes; ++k)
      motion.between[k] =
          probes_[k].projection.matrix() * probes_[k].view.world_to_camera * world(probes_[k].pose, probes_[k].view);
    return motion;
  }

  template <class AtProbe>
  void measure_point(const Motion& motion, const std::array<DVec4, 2>& at_key, const AtProbe& at_probe,
                     Deviation& worst) const {
    Deviation here;
    std::array<DVec4, 2> ends;
    for (std::size_t k = 0; k < 2; ++k) {
      ends[k] = motion.key[k] * at_key[k];
      const OnScreen seen = on_screen(ends[k], frame_.projection),
                     without = on_screen(motion.unzoomed[k] * at_key[k], frame_.projection);
      here.off &= beyond(seen.pixel, frame_.request);
      if (seen.in_front) here.from_zoom = std::max(here.from_zoom, glm::distance(seen.pixel, without.pixel));
    }
    for (std::size_t k = 0; k < kProbes; ++k) {
      const double t = probes_[k].t;
      const OnScreen seen = on_screen(motion.between[k] * at_probe(k), frame_.projection),
                     straight = on_screen(ends[0] * (1.0 - t) + ends[1] * t, frame_.projection);
      here.off &= beyond(seen.pixel, frame_.request);
      if (seen.in_front || straight.in_front)
        here.from_chord = std::max(here.from_chord, glm::distance(seen.pixel, straight.pixel));
    }
    worst = worst.merged(here);
  }

  Deviation measure_drawable(const PosedDrawable& posed, const std::array<Deformed, kProbes>& deformed) const {
    const Motion motion = motion_of([&](const Pose& pose, const View& view) { return world_of(posed, pose, view); });
    Deviation worst;
    if (posed.procedure != nullptr) {
      measure_procedure(posed, motion, worst);
      return worst;
    }
    if (deformed[0].positions.empty() && motion.still()) return worst;
    const std::size_t count = posed.positions[0].size(), step = std::max<std::size_t>(1, count / kPoints);
    for (std::size_t v = 0; v < count; v += step) {
      const auto at_probe = [&](std::size_t k) {
        return DVec4(deformed[k].positions.empty() ? posed.positions[0][v] : deformed[k].positions[v], 1.0);
      };
      measure_point(motion, {DVec4(posed.positions[0][v], 1.0), DVec4(posed.positions[1][v], 1.0)}, at_probe, worst);
    }
    return worst;
  }

  // Nine points of each piece, where its numbers put them at the motion keys and at the probes.
  void measure_procedure(const PosedDrawable& posed, const Motion& motion, Deviation& worst) const {
    const Capture& capture = *frame_.assembly->capture;
    const std::size_t number = posed.drawable->geometry;
    const bool animated = !frame_.procedures.keys.empty() && frame_.procedures.keys[number][0] != nullptr;
    if (!animated && motion.still()) return;
    for (std::size_t piece = 0; piece < posed.procedure->pieces.size(); ++piece)
      for (int k = 0; k < 9; ++k) {
        const auto point = [&](const Procedure& at) {
          const auto p = shaders::shape_point(at.shape, at.pieces[piece].input, 0.5 * (k % 3), 0.5 * (k / 3));
          return DVec4(p.x, p.y, p.z, 1.0);
        };
        const DVec4 open = point(*posed.procedure), close = animated ? point(*posed.procedure_close) : open;
        measure_point(
            motion, {open, close},
            [&](std::size_t probe) {
              return animated ? point(probes_[probe].procedures.at(capture, number, 0)) : open;
            },
            worst);
      }
  }

  DMat4 world_of(const PosedDrawable& posed, const Pose& pose, const View& view) const {
    return vertices_to_world(*frame_.assembly->capture, posed.drawable->node, posed.drawable->instance,
                             *posed.primitive, pose, view);
  }

  const FrameGeometry& frame_;
  std::array<Projection, 2> projections_;  // at shutter open and close
  std::array<Probe, kProbes> probes_;
};

}  // namespace

SegmentPlan plan_segments(const FrameGeometry& frame, const CameraChoice& camera) {
  const FrameRequest& request = frame.request;
  const Assembly& assembly = *frame.assembly;
  if (request.motion_segments == 1 || request.open_time == request.close_time ||
      assembly.capture->played_animations.empty())
    return {};
  std::vector<Deviation> deviation(assembly.drawables.size());
  const DeviationMeter meter(frame, camera);
  parallel_for(assembly.drawn.size(), [&](std::size_t d) { meter.measure(assembly.drawn[d], deviation); });
  const bool automatic = request.motion_segments == 0;
  const double limit = automatic ? request.motion_error : static_cast<double>(kStillPixels);
  SegmentPlan plan;
  plan.curved.resize(deviation.size());
  double worst = 0;
  const auto is_curved = [&](const Deviation& of) {
    if (of.off != 0 || !(of.from_chord > limit || of.from_zoom > limit)) return false;
    worst = std::max(worst, of.from_chord);
    plan.count = 2;
    return true;
  };
  for (std::size_t d = 0; d < deviation.size(); ++d) {
    // What the sampling controller draws has its footprints on the whole shutter's motion.
    const bool sampled = frame.drawables[d].procedure != nullptr && request.sample_procedures;
    plan.curved[d] = !sampled && is_curved(deviation[d]);
  }
  is_curved(meter.measure_background());
  if (plan.count == 1) return {};
  // More segments than the limit has never harm; not finite: whatever moves so wildly is not shown well by any number.
  const double wanted = std::isfinite(worst) ? std::ceil(std::sqrt(worst / limit)) : 1.0 * kMaxMotionSegments;
  plan.count =
      automatic ? static_cast<int>(std::clamp(wanted, 2.0, 1.0 * kMaxMotionSegments)) : request.motion_segments;
  return plan;
}

}  // namespace tessera::scene

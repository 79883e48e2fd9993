#include "scene/light_views.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "base/parallel.h"
#include "scene/drawable_box.h"

namespace tessera::scene {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// A spot light whose cone is wider than this gets the faces of a cube: 120 degrees plus the rounding of the cosine.
constexpr double kWidestCone = 2.0943951023931953 + 1e-6;
// The nearest depth of a perspective map, over the farthest.
constexpr double kNearShare = 1e-4;
constexpr double kLogarithmic = 0.85;

struct Range {
  double low = kInfinity, high = -kInfinity;
  bool empty() const { return !(low <= high); }
  double middle() const { return 0.5 * (low + high); }
  void add(double value) { low = std::min(low, value), high = std::max(high, value); }
  void add(const Range& other) { low = std::min(low, other.low), high = std::max(high, other.high); }
  Range intersect(const Range& other) const { return {std::max(low, other.low), std::min(high, other.high)}; }
};

// A drawable's box in the world, along whose axes it lies.
struct DrawableBox {
  DVec3 middle{0.0}, half{-1.0};  // negative: nothing is drawn
  bool casts = false, receives = false;

  bool empty() const { return half.x < 0; }
  // The places of its points along an axis, counted from the world's origin.
  Range along(const DVec3& axis) const {
    const double at = glm::dot(axis, middle), reach = glm::dot(glm::abs(axis), half);
    return {at - reach, at + reach};
  }
};

std::vector<DrawableBox> drawable_boxes(const FrameGeometry& frame, const ShadowSettings& settings) {
  const Assembly& assembly = *frame.assembly;
  std::vector<DrawableBox> boxes(frame.drawables.size());
  parallel_for(assembly.drawn.size(), [&](std::size_t d) {
    const DrawnPrimitive& drawn = assembly.drawn[d];
    const SpaceBox own = own_box(frame.drawables[drawn.first_drawable], 0);
    for (std::uint32_t i = 0; i < drawn.count; ++i) {
      const PosedDrawable& drawable = frame.drawables[drawn.drawable(i)];
      const SpaceBox world = drawable.visible ? world_box(drawable, 0, own) : SpaceBox();
      if (!world.empty())
        boxes[drawn.drawable(i)] = {world.middle(), world.half(), casts(*drawable.material, settings.blended),
                                    !drawable.material->unlit};
    }
  });
  return boxes;
}

DMat4 light_world(const FrameGeometry& frame, const ShadowLight& light) {
  return view_from_world(frame.poses[0].world[static_cast<std::size_t>(frame.light_nodes[light.light])])
      .camera_to_world;
}

// The share of a map's side that lies within its border.
double inner_share(int size) { return std::max(size - 2.0 * kShadowBorder, 0.5 * size) / size; }

// ---- Spot and point lights --------------------------------------------------------------------------------------

CameraChoice perspective(const DMat4& world, double tangent, const Range& depth) {
  CameraChoice choice;
  choice.fixed_world = world;
  choice.camera.vertical_fov = static_cast<float>(2.0 * std::atan(tangent));
  choice.camera.far = static_cast<float>(depth.high);
  choice.camera.near = static_cast<float>(std::max(depth.low, kNearShare * depth.high));
  return choice;
}

// The depths, seen from a place along an axis, between which boxes that cast lie in front of it.
Range depths_in_front(const std::vector<DrawableBox>& boxes, const DVec3& eye, const DVec3& forward) {
  Range depth;
  for (const DrawableBox& box : boxes) {
    if (box.empty() || !box.casts) continue;
    Range of = box.along(forward);
    of.low -= glm::dot(forward, eye), of.high -= glm::dot(forward, eye);
    if (of.high > 0) depth.add(of);
  }
  if (depth.empty()) depth = {0, 1};
  depth.high = std::max(depth.high * (1 + 1e-3), 1e-30);
  depth.low = std::max(depth.low * (1 - 1e-3), 0.0);
  return depth;
}

double cone_of(const shaders::Light& light) {
  return 2.0 * std::acos(std::clamp(static_cast<double>(light.cos_outer), -1.0, 1.0));
}

std::vector<LightView> cone_or_cube(const FrameGeometry& frame, const ShadowLight& light,
                                    const std::vector<DrawableBox>& boxes) {
  const shaders::Light& lit = frame.lights[0][light.light];
  const DMat4 world = light_world(frame, light);
  const int size = light.request.size;
  std::vector<LightView> views;
  const auto add = [&](const DMat4& from, double tangent) {
    Range depth = depths_in_front(boxes, DVec3(from[3]), -DVec3(from[2]));
    // Beyond its range a light has no shadows; a corner of a face is farther along its axis than the face's middle.
    if (lit.range > 0) depth.high = std::min(depth.high, static_cast<double>(lit.range) * (1 + 1e-3));
    views.push_back({static_cast<int>(views.size()), size, perspective(from, tangent / inner_share(size), depth)});
  };
  if (!needs_cube(lit)) {
    add(world, std::max(std::tan(0.5 * cone_of(lit)), 1e-4));
    return views;
  }
  const DVec4& place = world[3];
  for (const auto& [back, up] : std::to_array<std::pair<DVec3, DVec3>>({{{-1, 0, 0}, {0, 1, 0}},
                                                                        {{1, 0, 0}, {0, 1, 0}},
                                                                        {{0, -1, 0}, {0, 0, 1}},
                                                                        {{0, 1, 0}, {0, 0, 1}},
                                                                        {{0, 0, -1}, {0, 1, 0}},
                                                                        {{0, 0, 1}, {0, 1, 0}}}))
    add(DMat4(DVec4(glm::cross(up, back), 0), DVec4(up, 0), DVec4(back, 0), place), 1.0);
  return views;
}

// ---- Directional lights -----------------------------------------------------------------------------------------

// A part of the camera's view between two depths.
struct Slice {
  double near, far;
};

std::vector<Slice> split(double near, double far, int count) {
  std::vector<Slice> slices;
  double begin = near;
  for (int k = 1; k <= count; ++k) {
    const double share = static_cast<double>(k) / count,
                 end = k == count ? far
                                  : kLogarithmic * near * std::pow(far / near, share) +
                                        (1 - kLogarithmic) * (near + (far - near) * share);
    slices.push_back({begin, end});
    begin = end;
  }
  return slices;
}

// Half the width and the height of the view at a depth.
DVec2 half_seen(const Projection& projection, double depth) {
  return DVec2(projection.center_x, projection.center_y) / projection.scale * (projection.orthographic ? 1.0 : depth);
}

std::array<DVec3, 8> corners(const Projection& projection, const View& view, const Slice& slice) {
  std::array<DVec3, 8> out;
  for (std::size_t k = 0; k < 8; ++k) {
    const double depth = (k & 4u) != 0 ? slice.far : slice.near;
    const DVec2 half = half_seen(projection, depth);
    out[k] = DVec3(view.camera_to_world *
                   DVec4((k & 1u) != 0 ? half.x : -half.x, (k & 2u) != 0 ? half.y : -half.y, -depth, 1.0));
  }
  return out;
}

// The sphere around a slice, which stays as large while the camera moves.
struct Sphere {
  DVec3 middle;
  double radius;
};
Sphere sphere_around(const Projection& projection, const View& view, const Slice& slice) {
  const double near = glm::length(half_seen(projection, slice.near)),
               far = glm::length(half_seen(projection, slice.far));
  // The centre lies on the camera's axis, equally far from the front and the back corners, but not behind the back
  // ones.
  const double length = std::max(slice.far - slice.near, 1e-300);
  const double depth =
      std::clamp(0.5 * (slice.near + slice.far + (far - near) * (far + near) / length), slice.near, slice.far);
  const double radius = std::max(std::hypot(depth - slice.near, near), std::hypot(slice.far - depth, far));
  return {DVec3(view.camera_to_world * DVec4(0, 0, -depth, 1.0)), radius};
}

// A square along the light's axes x and y.
struct Square {
  double x = 0, y = 0, half = 0;
};

class CascadePlanner {
 public:
  CascadePlanner(const FrameGeometry& frame, const ShadowLight& light, const ShadowSettings& settings,
                 const std::vector<DrawableBox>& boxes)
      : frame_(frame), light_(light), settings_(settings), boxes_(boxes), world_(light_world(frame, light)) {}

  std::vector<LightView> views() const {
    const auto [near, far] = depths();
    std::vector<LightView> views;
    for (const Slice& slice : split(near, far, light_.request.cascades)) {
      const Square square = settings_.fit == ShadowFit::kSphere ? around_sphere(slice) : around_box(slice);
      views.push_back({static_cast<int>(views.size()), light_.request.size, camera(square)});
    }
    return views;
  }

 private:
  DVec3 axis(int k) const { return DVec3(world_[k]); }

  // Depths of the camera at which shadows are received.
  Slice depths() const {
    const Projection& projection = frame_.projection;
    Range depth;
    for (const View& view : frame_.views) {
      const DVec3 forward = -DVec3(view.camera_to_world[2]);
      const double eye = glm::dot(forward, DVec3(view.camera_to_world[3]));
      for (const DrawableBox& box : boxes_)
        if (!box.empty() && box.receives) {
          const Range of = box.along(forward);
          depth.add({of.low - eye, of.high - eye});
        }
    }
    double far = depth.empty() ? 0 : depth.high;
    if (light_.request.distance > 0) {
      // Spheres stay as large while the camera walks, wherever the scene ends.
      const double distance = light_.request.distance;
      far = settings_.fit == ShadowFit::kSphere ? distance : std::min(far, distance);
    }
    if (projection.far > 0) far = std::min(far, projection.far);
    const double near = std::max(projection.near, 1e-9 * std::abs(far));
    return {near, std::max(far, near * (1 + 1e-6))};
  }

  Square around_sphere(const Slice& slice) const {
    const Sphere open = sphere_around(frame_.projections[0], frame_.views[0], slice),
                 close = sphere_around(frame_.projections[1], frame_.views[1], slice);
    const double between = glm::length(close.middle - open.middle);
    const DVec3 middle = 0.5 * (open.middle + close.middle);
    const double half = (std::max(open.radius, close.radius) + 0.5 * between) / inner_share(light_.request.size);
    // Steps of whole texels of the map as it will be rounded.
    const double texel = 2.0 * static_cast<double>(static_cast<float>(half)) / light_.request.size;
    return {std::floor(glm::dot(axis(0), middle) / texel) * texel,
            std::floor(glm::dot(axis(1), middle) / texel) * texel, half};
  }

  Square around_box(const Slice& slice) const {
    Range x, y;
    for (std::size_t key = 0; key < 2; ++key)
      for (const DVec3& p : corners(frame_.projections[key], frame_.views[key], slice))
        x.add(glm::dot(axis(0), p)), y.add(glm::dot(axis(1), p));
    if (settings_.fit == ShadowFit::kReceivers) {
      Range receiver_x, receiver_y;
      for (const DrawableBox& box : boxes_) {
        if (box.empty() || !box.receives) continue;
        const Range of_x = box.along(axis(0)).intersect(x), of_y = box.along(axis(1)).intersect(y);
        if (!of_x.empty() && !of_y.empty()) receiver_x.add(of_x), receiver_y.add(of_y);
      }
      if (!receiver_x.empty()) x = receiver_x, y = receiver_y;
    }
    return {x.middle(), y.middle(),
            std::max({0.5 * (x.high - x.low), 0.5 * (y.high - y.low), 1e-30}) / inner_share(light_.request.size)};
  }

  CameraChoice camera(const Square& square) const {
    const Range x{square.x - square.half, square.x + square.half}, y{square.y - square.half, square.y + square.half};
    Range back;
    for (const DrawableBox& box : boxes_)
      if (!box.empty() && (box.casts || box.receives) && !box.along(axis(0)).intersect(x).empty() &&
          !box.along(axis(1)).intersect(y).empty())
        back.add(box.along(axis(2)));
    if (back.empty()) back = {0, 1};
    const double margin = std::max(1e-3 * (back.high - back.low), 1e-6 * std::abs(back.high) + 1e-30);
    CameraChoice choice;
    choice.camera.type = Camera::Type::kOrthographic;
    choice.camera.x_mag = choice.camera.y_mag = static_cast<float>(square.half);
    choice.camera.near = static_cast<float>(margin);
    choice.camera.far = static_cast<float>((back.high - back.low) + 3 * margin);
    choice.fixed_world = world_;
    choice.fixed_world[3] = DVec4(axis(0) * square.x + axis(1) * square.y + axis(2) * (back.high + 2 * margin), 1.0);
    return choice;
  }

  const FrameGeometry& frame_;
  const ShadowLight& light_;
  const ShadowSettings& settings_;
  const std::vector<DrawableBox>& boxes_;
  DMat4 world_;
};

std::vector<Material> caster_materials(const FrameGeometry& frame, const ShadowSettings& settings) {
  std::vector<Material> materials = frame.materials.empty() ? frame.assembly->materials : frame.materials;
  for (Material& material : materials) {
    if (material.alpha_mode == AlphaMode::kBlend && settings.blended == BlendedCasters::kSolid)
      material.alpha_mode = AlphaMode::kOpaque;
    material.double_sided = material.double_sided || settings.faces == CasterFaces::kBoth;
  }
  return materials;
}

}  // namespace

bool needs_cube(const shaders::Light& light) {
  return light.type == shaders::Light::Type::kPoint ||
         (light.type == shaders::Light::Type::kSpot && cone_of(light) > kWidestCone);
}

bool casts(const Material& material, BlendedCasters blended) {
  return !material.unlit && (material.alpha_mode != AlphaMode::kBlend || blended == BlendedCasters::kSolid);
}

std::optional<ShadowRequest> shadow_request(const Capture& capture, int light, ShadowCasters casters) {
  if (casters == ShadowCasters::kOff) return std::nullopt;
  const auto& requests = capture.settings.shadows;
  if (const auto named = std::ranges::find(requests, light, &ShadowRequest::light); named != requests.end())
    return *named;
  if (casters != ShadowCasters::kAll) return std::nullopt;
  const bool directional = capture.lights[static_cast<std::size_t>(light)].type == shaders::Light::Type::kDirectional;
  return ShadowRequest{.light = light, .cascades = directional ? 4 : 1};
}

ShadowRequest sized_request(const Capture& capture, ShadowRequest request, const ShadowSettings& settings) {
  if (settings.size > 0) request.size = settings.size;
  const shaders::Light& light = capture.lights[static_cast<std::size_t>(request.light)];
  if (settings.cascades > 0 && light.type == shaders::Light::Type::kDirectional) request.cascades = settings.cascades;
  return request;
}

std::vector<ShadowLight> shadow_lights(const FrameGeometry& frame, const ShadowSettings& settings) {
  const Capture& capture = *frame.assembly->capture;
  std::vector<ShadowLight> lights;
  for (std::uint32_t k = 0; k < frame.light_nodes.size(); ++k) {
    const int light = capture.nodes[static_cast<std::size_t>(frame.light_nodes[k])].light;
    if (const auto request = shadow_request(capture, light, frame.request.shadow_casters))
      lights.push_back({k, sized_request(capture, *request, settings)});
  }
  return lights;
}

std::vector<double> shadow_times(const FrameGeometry& frame, const ShadowSettings& settings) {
  const auto moves = [](const PosedDrawable& d) {
    return d.visible && (d.deforming || d.curved || d.to_world[0] != d.to_world[1]);
  };
  std::vector<double> times;
  if (!frame.moving_lights && std::ranges::none_of(frame.drawables, moves)) return times;
  for (int k = 0; k < settings.times; ++k) times.push_back((k + 0.5) / settings.times);
  return times;
}

std::vector<std::vector<LightView>> light_views(const FrameGeometry& frame, std::span<const ShadowLight> lights,
                                                const ShadowSettings& settings) {
  if (lights.empty()) return {};
  const std::vector<DrawableBox> boxes = drawable_boxes(frame, settings);
  std::vector<std::vector<LightView>> views;
  for (const ShadowLight& light : lights)
    views.push_back(frame.lights[0][light.light].type == shaders::Light::Type::kDirectional
                        ? CascadePlanner(frame, light, settings, boxes).views()
                        : cone_or_cube(frame, light, boxes));
  return views;
}

std::unique_ptr<FrameGeometry> pose_for_light(const FrameGeometry& frame, const LightView& view,
                                              const ShadowSettings& settings) {
  std::unique_ptr<FrameGeometry> posed = pose_view(
      frame, {view.camera, view.size, caster_materials(frame, settings), settings.grids == CasterGrids::kCamera});
  for (PosedDrawable& drawable : posed->drawables) {
    drawable.visible = drawable.visible && casts(*drawable.material, settings.blended);
    if (settings.faces == CasterFaces::kBack) drawable.mirrored = !drawable.mirrored;
  }
  return posed;
}

Projection light_projection(const LightView& view) { return make_projection(view.camera.camera, view.size, view.size); }

DMat4 raster_to_light(const FrameGeometry& frame, std::size_t key, const LightView& view) {
  return light_projection(view).matrix() * view_from_world(view.camera.fixed_world).world_to_camera *
         frame.views[key].camera_to_world * frame.projections[key].unprojection();
}

}  // namespace tessera::scene

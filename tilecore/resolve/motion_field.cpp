#include "tilecore/resolve/motion_field.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "base/check.h"

namespace tessera::tilecore {
namespace {

using scene::FrameGeometry;
using scene::PosedDrawable;

template <class T>
bool same_values(std::span<const T> a, std::span<const T> b) {
  if (a.data() == b.data() && a.size() == b.size()) return true;
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size_bytes()) == 0;
}

bool same_projection(const scene::Projection& a, const scene::Projection& b) {
  return a.orthographic == b.orthographic && a.center_x == b.center_x && a.center_y == b.center_y &&
         a.scale == b.scale && a.lens_scale == b.lens_scale && a.inverse_focus == b.inverse_focus;
}

// Numbers of the capture's materials of which a value differs.
std::vector<int> changed_materials(const FrameGeometry& now, const FrameGeometry& then) {
  std::vector<int> changed;
  for (std::size_t i = 0; i < now.material_values.size(); ++i) {
    const scene::MaterialValue& value = now.material_values[i];
    const bool same = i < then.material_values.size() && then.material_values[i] == value;
    if (!same && (changed.empty() || changed.back() != value.material)) changed.push_back(value.material);
  }
  return changed;
}

int capture_material(const FrameGeometry& frame, const PosedDrawable& drawable) {
  const scene::Material* const first =
      frame.materials.empty() ? frame.assembly->materials.data() : frame.materials.data();
  return frame.assembly->material_source[static_cast<std::size_t>(drawable.material - first)];
}

bool finite(const DMat4& m) {
  for (int c = 0; c < 4; ++c)
    for (int r = 0; r < 4; ++r)
      if (!std::isfinite(m[c][r])) return false;
  return true;
}

}  // namespace

MotionField::Motion MotionField::motion_of(const FrameGeometry& now, const FrameGeometry& then, std::size_t d) {
  const PosedDrawable &a = now.drawables[d], &b = then.drawables[d];
  Motion motion;
  // Along a curve: where the surface was at shutter open is not where its segment began.
  const bool rigid = !a.curved && !b.curved && !a.deforming && !b.deforming &&
                     same_values(a.positions[0], b.positions[0]) &&
                     (a.procedure == b.procedure || scene::same_shape(*a.procedure, *b.procedure));
  if (!rigid) {
    motion.kind = Kind::kDeforming;
    return motion;
  }
  if (!a.moving && !b.moving && a.to_raster[0] == b.to_raster[0] && a.to_world[0] == b.to_world[0] &&
      same_projection(now.projection, then.projection)) {
    motion.kind = Kind::kStill;
    return motion;
  }
  const DMat4 camera_now = now.views[0].world_to_camera * DMat4(a.to_world[0]),
              camera_then = then.views[0].world_to_camera * DMat4(b.to_world[0]);
  const double determinant = glm::determinant(camera_now);
  if (!(std::abs(determinant) > 0)) return motion;
  const DMat4 m = then.projection.matrix() * camera_then * glm::inverse(camera_now) * now.projection.unprojection();
  if (!finite(m)) return motion;
  motion.kind = Kind::kRigid;
  motion.reprojection = Mat4(m);
  return motion;
}

MotionField::MotionField(const FrameGeometry& now, const FrameGeometry& then)
    : now_(now), then_(then), orthographic_(now.projection.orthographic) {
  TESSERA_CHECK(now.drawables.size() == then.drawables.size(), "motion is between two poses of one assembly");
  motions_.reserve(now.drawables.size());
  const std::vector<int> changed = changed_materials(now, then);
  for (std::size_t d = 0; d < now.drawables.size(); ++d) {
    motions_.push_back(motion_of(now, then, d));
    Motion& motion = motions_.back();
    const PosedDrawable &a = now.drawables[d], &b = then.drawables[d];
    motion.same_shading = (same_values(a.normals[0], b.normals[0]) && same_values(a.tangents[0], b.tangents[0])) ||
                          !same_values(a.positions[0], b.positions[0]);
    if (a.procedure != b.procedure && !scene::same_look(*a.procedure, *b.procedure)) motion.same_shading = false;
    if (!changed.empty() && std::find(changed.begin(), changed.end(), capture_material(now, a)) != changed.end())
      motion.same_shading = false;
    all_still_ = all_still_ && motions_.back().kind == Kind::kStill;
  }
  const auto rests = [&](const scene::View& view) { return view.world_to_camera == then.views[0].world_to_camera; };
  camera_rests_ = same_projection(now.projection, then.projection) && rests(now.views[0]) && rests(now.views[1]) &&
                  rests(then.views[1]);
  lights_ = LightReach(now, then);
  const double interval = std::abs(now.request.open_time - then.request.open_time);
  if (interval > 0) shutter_ = static_cast<float>((now.request.close_time - now.request.open_time) / interval);
}

MotionField::Step MotionField::step(std::uint32_t d, Vec2 rest, float z, const SurfaceLocation& at) const {
  switch (motions_[d].kind) {
    case Kind::kStill:
      return {Vec2(0.0f), z, true};
    case Kind::kUnusable:
      return {};
    case Kind::kRigid:
      return rigid_step(d, rest, z);
    case Kind::kDeforming:
      break;
  }
  return step_between(places(at, surface_parameters(now_, at)));
}

// ---- The camera -------------------------------------------------------------------------------------------------

CameraMotion camera_motion(const scene::FrameGeometry& now, const scene::FrameGeometry& then, const History& history) {
  const DMat4 to_world = then.views[0].camera_to_world * then.projection.unprojection(),
              to_raster = now.projection.matrix() * now.views[0].world_to_camera;
  constexpr float kFar = 1e6f;  // where nothing was seen
  constexpr int kSide = 3;
  CameraMotion motion{true, {}};
  static_assert(std::tuple_size_v<decltype(motion.pixels)> == kSide * kSide);
  const IntRect& region = history.region;
  for (int i = 0; i < kSide * kSide; ++i) {
    const int x = region.x0 + region.width() * (2 * (i % kSide) + 1) / (2 * kSide),
              y = region.y0 + region.height() * (2 * (i / kSide) + 1) / (2 * kSide);
    const float depth = std::abs(history.depth[history.pixel(x, y)]);
    const double z = static_cast<double>(std::isfinite(depth) ? depth : kFar),
                 w = then.projection.orthographic ? 1.0 : z;
    const DVec2 pixel(x + 0.5, y + 0.5);
    const DVec4 raster = to_raster * (to_world * DVec4(pixel.x * w, pixel.y * w, z, 1.0));
    motion.pixels[static_cast<std::size_t>(i)] = raster.w > 0 ? Vec2(DVec2(raster.x, raster.y) / raster.w - pixel)
                                                              : Vec2(std::numeric_limits<float>::infinity());
  }
  return motion;
}

bool is_cut(const CameraMotion& before, const CameraMotion& now, float pixels) {
  if (!before.known || !now.known) return false;
  std::size_t elsewhere = 0;
  for (std::size_t i = 0; i < now.pixels.size(); ++i) {
    const Vec2 change = now.pixels[i] - before.pixels[i];
    elsewhere += std::hypot(change.x, change.y) > pixels;  // not where both are infinite
  }
  return 2 * elsewhere > now.pixels.size();
}

}  // namespace tessera::tilecore

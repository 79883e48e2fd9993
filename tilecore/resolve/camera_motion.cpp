#include "tilecore/resolve/camera_motion.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tessera::tilecore {

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

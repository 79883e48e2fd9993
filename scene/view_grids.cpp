#include "scene/view_grids.h"

#include <algorithm>
#include <array>

#include "base/parallel.h"

namespace tessera::scene {
namespace {

// Margin around the image in which a curve counts as seen, over the image's width: moving patches may enter during the
// shutter.
constexpr float kMargin = 1.0f / 16;

// The planes around the camera's view, for points of a drawable.
class SeenPlanes {
 public:
  SeenPlanes(const FrameGeometry& scene, const PosedDrawable& drawable) {
    const Mat4& m = drawable.to_raster[0];
    const auto row = [&](int r) { return Vec4(m[0][r], m[1][r], m[2][r], m[3][r]); };
    const Vec4 x = row(0), y = row(1), w = row(3);
    const auto width = static_cast<float>(scene.request.width), height = static_cast<float>(scene.request.height),
               margin = kMargin * width;
    planes_ = {x + margin * w, (width + margin) * w - x, y + margin * w, (height + margin) * w - y, w};
    const Material& material = *drawable.material;
    const auto reach = static_cast<float>(material.displacement ? displacement_limit(*material.displacement) : 0.0);
    for (std::size_t k = 0; k < planes_.size(); ++k) reach_[k] = reach * glm::length(Vec3(planes_[k]));
  }

  // False where all points of a set lie behind one plane, farther than displacement reaches.
  template <class PointAt>
  bool sees(std::size_t count, const PointAt& point_at) const {
    for (std::size_t k = 0; k < planes_.size(); ++k) {
      bool behind = true;
      for (std::size_t i = 0; i < count && behind; ++i)
        behind = glm::dot(planes_[k], Vec4(point_at(i), 1.0f)) + reach_[k] < 0;
      if (behind) return false;
    }
    return true;
  }

 private:
  std::array<Vec4, 5> planes_;
  std::array<float, 5> reach_;
};

// The grid of a patch in a view, from the scene's grid and the view's own.
TessellationPattern shared_pattern(const SeenPlanes& planes, std::span<const Vec3, 16> points,
                                   const TessellationPattern& of_scene, const TessellationPattern& of_view,
                                   bool patch_seen) {
  // First control point and step of each edge, as TessellationPattern numbers them.
  constexpr std::array<std::array<std::size_t, 2>, 4> kEdgeCurves = {{{0, 1}, {12, 1}, {0, 4}, {3, 4}}};
  TessellationPattern pattern = of_scene;
  for (std::size_t e = 0; e < kEdgeCurves.size(); ++e)
    if (!planes.sees(4, [&](std::size_t i) { return points[kEdgeCurves[e][0] + i * kEdgeCurves[e][1]]; }))
      pattern.edge[e] = std::min(of_scene.edge[e], of_view.edge[e]);
  if (patch_seen) return pattern;
  pattern.nu = std::max({std::min(of_scene.nu, of_view.nu), pattern.edge[0], pattern.edge[1]});
  pattern.nv = std::max({std::min(of_scene.nv, of_view.nv), pattern.edge[2], pattern.edge[3]});
  return pattern;
}

}  // namespace

void keep_grids(const FrameGeometry& scene, FrameGeometry& view) {
  const Assembly& assembly = *scene.assembly;
  parallel_for(scene.patterns.size(), [&](std::size_t g) {
    const std::uint32_t patch = assembly.grid_patches[g];
    const PosedDrawable& drawable = scene.drawable_of(patch);
    if (drawable.procedure != nullptr) {
      if (!scene.request.sample_procedures) view.patterns[g] = scene.patterns[g];
      return;
    }
    const SeenPlanes planes(scene, drawable);
    const auto points = scene.control_points(drawable, patch, 0);
    const bool seen = planes.sees(16, [&](std::size_t i) { return points[i]; });
    view.patterns[g] = shared_pattern(planes, points, scene.patterns[g], view.patterns[g], seen);
    const float lod = scene.displacement_lod[g];
    view.displacement_lod[g] = seen ? lod : std::max(lod, view.displacement_lod[g]);
  });
}

}  // namespace tessera::scene

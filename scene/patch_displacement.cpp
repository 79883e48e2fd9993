#include "scene/patch_displacement.h"

#include <algorithm>
#include <cmath>

namespace tessera::scene {

PatchDisplacement patch_displacement(const FrameGeometry& frame, const PosedDrawable& drawable, std::uint32_t patch) {
  PatchDisplacement out;
  out.material = &*drawable.material->displacement;
  const std::vector<Vec2>& texcoords =
      drawable.primitive->vertices.texcoords[static_cast<std::size_t>(out.material->texcoord)];
  const std::size_t first = std::size_t{16} * (patch - drawable.drawable->first_patch);
  constexpr std::array<std::size_t, 4> kCorners = {0, 3, 12, 15};
  for (std::size_t c = 0; c < 4; ++c) out.corner[c] = out.material->transform.apply(texcoords[first + kCorners[c]]);

  out.lod = frame.displacement_lod[frame.grid_of(patch)];
  return out;
}

float choose_displacement_lod(const FrameGeometry& frame, const PosedDrawable& drawable, std::uint32_t patch) {
  const PatchDisplacement d = patch_displacement(frame, drawable, patch);
  const auto& base = d.material->texture->levels().front();
  const Vec2 size(static_cast<float>(base.width), static_cast<float>(base.height));
  const auto texels = [&](std::size_t a, std::size_t b) { return glm::length((d.corner[b] - d.corner[a]) * size); };
  const TessellationPattern& pattern = frame.pattern_of(patch);
  const float along_u = std::max(texels(0, 1), texels(2, 3)) / static_cast<float>(pattern.nu);
  const float along_v = std::max(texels(0, 2), texels(1, 3)) / static_cast<float>(pattern.nv);
  const float spacing = std::max(along_u, along_v);
  const float lod = spacing > 1.0f && std::isfinite(spacing) ? std::log2(spacing) : 0.0f;
  return std::max(lod + static_cast<float>(frame.request.tessellation.displacement_bias), 0.0f);
}

}  // namespace tessera::scene

#include "tilecore/shading/shader_features.h"

#include <algorithm>
#include <vector>

#include "tilecore/shading/surface.h"

namespace tessera::tilecore {
namespace {

using hardware::ShaderFeatures;
using scene::TextureSlot;

bool same_coordinate(const TextureSlot& a, const TextureSlot& b) {
  return a.texcoord == b.texcoord && a.transform.matrix == b.transform.matrix &&
         a.transform.offset == b.transform.offset;
}

std::size_t light_kind(const shaders::Light& light) {
  const bool limited = light.range > 0.0f;
  if (light.type == shaders::Light::Type::kDirectional) return 0;
  return (light.type == shaders::Light::Type::kPoint ? 1u : 3u) + (limited ? 1u : 0u);
}

ShaderFeatures::ShadowFilter filter_of(shaders::ShadowFilter filter) {
  switch (filter) {
    case shaders::ShadowFilter::kNearest:
      return ShaderFeatures::ShadowFilter::kNearest;
    case shaders::ShadowFilter::k3x3:
      return ShaderFeatures::ShadowFilter::k3x3;
    default:
      return ShaderFeatures::ShadowFilter::k2x2;
  }
}

// `reads`: whether a texture is there; it counts coordinates.
template <class Reads>
void add_layers(const scene::Material& material, const Reads& reads, ShaderFeatures& f) {
  using Slot = scene::MaterialTexture;
  for (std::size_t effect = 0; effect < scene::kMaterialEffectCount; ++effect)
    if (material.effects[effect]) f.layers.push_back(scene::kMaterialEffectNames[effect]);
  const auto slots = material.slots();
  for (std::size_t slot = scene::kCoreTextureCount; slot < slots.size(); ++slot) {
    const auto which = static_cast<Slot>(slot);
    if (!reads(*slots[slot], scene::is_read(material, which))) continue;
    if (which == Slot::kClearcoatNormal)
      f.coat_normals = true;
    else
      ++f.layer_textures;
  }
}

}  // namespace

ShaderFeatures material_features(const scene::Material& material, bool height_normals) {
  ShaderFeatures f;
  f.unlit = material.unlit;
  f.height_normals = height_normals;
  // The normal of an unlit surface has no effect.
  const bool lit = !material.unlit;
  std::vector<const TextureSlot*> read;
  const auto reads = [&](const TextureSlot& slot, bool wanted) {
    if (!wanted || slot.texture == nullptr) return false;
    if (std::none_of(read.begin(), read.end(), [&](const auto* other) { return same_coordinate(*other, slot); }))
      read.push_back(&slot);
    return true;
  };
  f.base_color = reads(material.base_color_texture, true);
  if (reads(material.normal_texture, lit)) f.normals = ShaderFeatures::Normals::kMapped;
  f.metallic_roughness =
      reads(material.metallic_roughness_texture, lit && !material.has(scene::MaterialEffect::kSpecularGlossiness));
  f.occlusion = reads(material.occlusion_texture, lit);
  f.emissive = reads(material.emissive_texture, lit || material.glows_unlit);
  if (lit && material.effects.any()) add_layers(material, reads, f);
  TextureSlot heights;
  if (height_normals) {
    heights.texcoord = material.displacement->texcoord, heights.transform = material.displacement->transform;
    if (std::none_of(read.begin(), read.end(), [&](const auto* other) { return same_coordinate(*other, heights); }))
      read.push_back(&heights);
  }
  f.coordinates = static_cast<std::uint8_t>(std::max<std::size_t>(read.size(), 1));
  return f;
}

namespace {

ShaderFeatures::Surface surface_of(const scene::PosedDrawable& drawable) {
  using Surface = ShaderFeatures::Surface;
  if (drawable.procedure != nullptr) return Surface::kComputed;
  if (!has_grid(drawable)) return Surface::kTriangles;
  return drawable.material->displacement ? Surface::kDisplacedPatch : Surface::kPatch;
}

ShaderFeatures::Motion motion_of(const scene::PosedDrawable& drawable) {
  using Motion = ShaderFeatures::Motion;
  return !drawable.moving ? Motion::kStill : drawable.deforming ? Motion::kDeforming : Motion::kMoving;
}

}  // namespace

ShaderFeatures domain_features(const scene::PosedDrawable& drawable) {
  return {.stage = ShaderFeatures::Stage::kDomain, .surface = surface_of(drawable), .motion = motion_of(drawable)};
}

ShaderFeatures draw_features(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable, bool quads,
                             bool height_normals) {
  ShaderFeatures f = material_features(*drawable.material, height_normals);
  using In = ShaderFeatures;
  const bool computed = drawable.procedure != nullptr;
  f.surface = surface_of(drawable);
  f.motion = motion_of(drawable);
  f.quads = quads;
  f.vertex_colors = !computed && !drawable.primitive->vertices.colors.empty();
  if (f.normals == ShaderFeatures::Normals::kMapped && f.surface == In::Surface::kTriangles &&
      !drawable.tangents[0].empty())
    f.normals = ShaderFeatures::Normals::kMappedAlongTangents;
  for (const shaders::Light& light : frame.lights[0]) ++f.lights[light_kind(light)];
  f.lights_move = frame.moving_lights;
  return f;
}

void keep_lights(const scene::FrameGeometry& frame, std::span<const std::uint32_t> numbers, ShaderFeatures& features) {
  features.lights = {};
  for (const std::uint32_t number : numbers) ++features.lights[light_kind(frame.lights[0][number])];
}

void add_shadows(const FrameShadows& shadows, const scene::FrameGeometry& frame,
                 const std::span<const std::uint32_t>* listed, ShaderFeatures& features) {
  if (features.unlit) return;
  const auto times = static_cast<std::size_t>(shadows.times());
  const shaders::ShadowView* const views = shadows.of(frame);
  for (std::size_t k = 0; k < shadows.views(); ++k) {
    const shaders::ShadowView& view = views[k];
    if (!view.casts()) continue;
    if (listed != nullptr && !std::ranges::binary_search(*listed, k / times)) continue;
    ShaderFeatures::ShadowCasters& casters = features.shadows[view.perspective ? 1 : 0];
    ++casters.lookups;
    if (view.layers > 1) ++casters.layered;
    casters.layers = static_cast<std::uint16_t>(casters.layers + view.layers);
    features.shadow_filter = filter_of(view.filter);
  }
}

}  // namespace tessera::tilecore

#pragma once

#include <algorithm>
#include <array>
#include <bitset>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/vec.h"
#include "shaders_cpp/texture.h"

namespace tessera::scene {

// ---- Textures ---------------------------------------------------------------------------------------------------

// Format of a texture in the file, and its levels there.
enum class TextureFormat : std::uint8_t { kPng, kJpeg, kWebp, kKtx2Etc1s, kKtx2Uastc };
struct TextureSource {
  TextureFormat format = TextureFormat::kPng;
  int levels = 1;  // mip levels in the file
};

// KHR_texture_transform as a file has it: uv' = offset + R(rotation) * (scale * uv).
struct TextureShift {
  Vec2 offset{0.0f}, scale{1.0f};
  float rotation = 0.0f;
  shaders::TextureTransform transform() const {
    const float c = std::cos(rotation), s = std::sin(rotation);
    // Columns of R * S. The rotation is counter-clockwise as seen with v pointing down, R = [c s; -s c]; viewers agree
    // on this and the Khronos test model asks for it, the GLSL in the extension's text turns the other way.
    return {glm::mat2(c * scale[0], -s * scale[0], s * scale[1], c * scale[1]), offset};
  }
};

// A texture as a material uses it.
struct TextureSlot {
  std::shared_ptr<const shaders::Texture> texture;  // null: factor only
  TextureSource source;
  shaders::Sampler sampler;
  int texcoord = 0;
  TextureShift shift;  // source of `transform`, for animations of it
  shaders::TextureTransform transform;
};

// TESSERA_displacement: offset along the unit normal = scale * height + bias, height from the red channel.
struct Displacement {
  std::shared_ptr<const shaders::ScalarTexture> texture;
  TextureSource source;
  shaders::Sampler sampler;
  int texcoord = 0;
  shaders::TextureTransform transform;
  float scale = 1.0f;
  float bias = 0.0f;
};

// Upper bound of the distance between a displaced surface and its patches, in the mesh's units.
inline double displacement_limit(const Displacement& displacement) {
  const auto bias = static_cast<double>(displacement.bias), scale = static_cast<double>(displacement.scale);
  return std::max(std::abs(bias), std::abs(bias + scale));
}

// ---- Effects of extensions --------------------------------------------------------------------------------------

#include "scene/material_effects.inc"
using MaterialEffects = std::bitset<kMaterialEffectCount>;

// ---- Materials --------------------------------------------------------------------------------------------------

enum class AlphaMode : std::uint8_t { kOpaque, kMask, kBlend };

struct Material {
  std::string name;
  Vec4 base_color{1.0f};
  float metallic = 1.0f, roughness = 1.0f;
  Vec3 emissive{0.0f};
  Vec3 emissive_factor{0.0f};      // source of `emissive`, for animations of it:
  float emissive_strength = 1.0f;  // KHR_materials_emissive_strength
  float normal_scale = 1.0f, occlusion_strength = 1.0f;
  TextureSlot base_color_texture, metallic_roughness_texture, normal_texture, occlusion_texture, emissive_texture;
  AlphaMode alpha_mode = AlphaMode::kOpaque;
  float alpha_cutoff = 0.5f;
  bool double_sided = false;
  bool unlit = false;
  bool glows_unlit = false;  // unlit, and its emission is added: points and lines without normals
  std::optional<Displacement> displacement;

  MaterialEffects effects;  // none for an unlit material
#define EFFECT(Name, member, ...) Name member;
#include "scene/material_extensions.def"

  bool has(MaterialEffect effect) const { return effects[static_cast<std::size_t>(effect)]; }

  // Indexed by MaterialTexture.
  std::array<TextureSlot*, kMaterialTextureCount> slots() { return slots_of<TextureSlot*>(*this); }
  std::array<const TextureSlot*, kMaterialTextureCount> slots() const { return slots_of<const TextureSlot*>(*this); }

 private:
  template <class Slot, class Self>
  static std::array<Slot, kMaterialTextureCount> slots_of(Self& m) {
    std::array<Slot, kMaterialTextureCount> slots;
    std::size_t slot = 0;
#define CORE_TEXTURE(of, ...) slots[slot++] = &m.of;
#define EFFECT(Name, member, ...) \
  {                               \
    [[maybe_unused]] auto& effect = m.member;
#define TEXTURE(of, ...) slots[slot++] = &effect.of;
#define END_EFFECT(...) }
#include "scene/material_extensions.def"
    return slots;
  }
};

inline constexpr std::array<std::string_view, kMaterialEffectCount> kMaterialEffectNames = {
#define EFFECT(Name, member, ...) #member,
#include "scene/material_extensions.def"
};
inline constexpr std::array<std::string_view, kMaterialTextureCount> kMaterialTextureNames = {
#define CORE_TEXTURE(member, Slot, slot, ...) #slot,
#define TEXTURE(member, Slot, slot, ...) #slot,
#include "scene/material_extensions.def"
};

// Whether the material's pixel shader reads a slot, if there is a texture.
bool is_read(const Material& material, MaterialTexture slot);

// The layers that a material's factors and textures ask for. Specular-glossiness stays as it is, because no factor or
// texture shows it.
MaterialEffects effects_in_force(const Material& material);

// Drops the effects that need a missing effect.
MaterialEffects drop_unsupported(MaterialEffects effects);

EffectFlags flags_of(const MaterialEffects& effects);

// Removes a layer, by its name in kMaterialEffectNames, and the layers that need it; any other name changes nothing.
void leave_out(std::string_view effect, Material& material);

// ---- Rows of material_extensions.def ----------------------------------------------------------------------------

struct NumberRange {
  double low, high;
  bool above_low = false;     // `low` itself is outside
  bool zero_besides = false;  // 0 is allowed too and stands for infinity

  float nearest(double value) const;  // the nearest value within the range
};

// A number or colour of a material.
struct MaterialNumber {
  std::string pointer;  // within the material (RFC 6901)
  int components;
  float value;  // default where the object lacks it
  NumberRange range;
  std::optional<MaterialEffect>
      effect;     // its effect; a material whose number moves has the effect from the first frame on
  bool animated;  // KHR_animation_pointer may name it
  float* (*of)(Material&);

  const float* in(const Material& material) const { return of(const_cast<Material&>(material)); }
};
const std::vector<MaterialNumber>& material_numbers();

// The place of a material's texture in the file, and the meaning of its texels.
struct MaterialTextureRow {
  std::string object, name;  // pointer to the object that may have it, within the material; its member there
  MaterialTexture slot;
  shaders::ColorSpace space;
  bool of_extension;
  bool replaces;  // another row has the same slot
};
const std::vector<MaterialTextureRow>& material_textures();

}  // namespace tessera::scene

#pragma once

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

#include "base/vec.h"
#include "shaders_cpp/texture.h"

namespace tessera::scene {

// ---- Textures ---------------------------------------------------------------------------------------------------

// What a texture is in the file.
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
  TextureShift shift;  // what `transform` is made from, for animations of it
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
  Vec3 emissive_factor{0.0f};      // what `emissive` is made from, for animations of it:
  float emissive_strength = 1.0f;  // KHR_materials_emissive_strength
  float normal_scale = 1.0f, occlusion_strength = 1.0f;
  TextureSlot base_color_texture, metallic_roughness_texture, normal_texture, occlusion_texture, emissive_texture;
  AlphaMode alpha_mode = AlphaMode::kOpaque;
  float alpha_cutoff = 0.5f;
  bool double_sided = false;
  bool unlit = false;
  bool glows_unlit = false;  // unlit, and its emission is added: points and lines without normals
  std::optional<Displacement> displacement;

  MaterialEffects effects;  // none where it is unlit
  SpecularGlossiness specular_glossiness;
  Dielectric dielectric;
  Clearcoat clearcoat;
  Sheen sheen;
  Anisotropy anisotropy;
  Iridescence iridescence;
  Transmission transmission;
  Volume volume;
  DiffuseTransmission diffuse_transmission;

  bool has(MaterialEffect effect) const { return effects[static_cast<std::size_t>(effect)]; }

  // By MaterialTexture.
  std::array<TextureSlot*, kMaterialTextureCount> slots() { return slots_of<TextureSlot*>(*this); }
  std::array<const TextureSlot*, kMaterialTextureCount> slots() const { return slots_of<const TextureSlot*>(*this); }

 private:
  template <class Slot, class Self>
  static std::array<Slot, kMaterialTextureCount> slots_of(Self& m) {
    return {&m.base_color_texture,
            &m.metallic_roughness_texture,
            &m.normal_texture,
            &m.occlusion_texture,
            &m.emissive_texture,
            &m.specular_glossiness.texture,
            &m.dielectric.texture,
            &m.dielectric.color_texture,
            &m.clearcoat.texture,
            &m.clearcoat.roughness_texture,
            &m.clearcoat.normal_texture,
            &m.sheen.color_texture,
            &m.sheen.roughness_texture,
            &m.anisotropy.texture,
            &m.iridescence.texture,
            &m.iridescence.thickness_texture,
            &m.transmission.texture,
            &m.volume.thickness_texture,
            &m.diffuse_transmission.texture,
            &m.diffuse_transmission.color_texture};
  }
};

inline constexpr std::array<std::string_view, kMaterialEffectCount> kMaterialEffectNames = {
    "specular_glossiness", "dielectric",   "clearcoat", "sheen",      "anisotropy",
    "iridescence",         "transmission", "volume",    "dispersion", "diffuse_transmission"};
inline constexpr std::array<std::string_view, kMaterialTextureCount> kMaterialTextureNames = {
    "base_color",
    "metallic_roughness",
    "normal",
    "occlusion",
    "emissive",
    "specular_glossiness",
    "specular",
    "specular_color",
    "clearcoat",
    "clearcoat_roughness",
    "clearcoat_normal",
    "sheen_color",
    "sheen_roughness",
    "anisotropy",
    "iridescence",
    "iridescence_thickness",
    "transmission",
    "thickness",
    "diffuse_transmission",
    "diffuse_transmission_color"};

// Whether the material's pixel shader reads a slot, if there is a texture.
bool is_read(const Material& material, MaterialTexture slot);

// Those that a material's factors and textures ask for; without KHR_materials_pbrSpecularGlossiness.
MaterialEffects effects_in_force(const Material& material);

}  // namespace tessera::scene

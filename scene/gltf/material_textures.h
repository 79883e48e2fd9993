#pragma once

#include <array>
#include <string_view>

#include <nlohmann/json.hpp>

#include "scene/material.h"

namespace tessera::scene::gltf {

// Where a material's texture is in the file, and what its numbers are.
struct MaterialTextureName {
  std::string_view owner;  // object or extension of the material; empty: the material itself
  std::string_view name;
  shaders::ColorSpace space;

  bool extends() const { return owner.starts_with("KHR_"); }
};

// By MaterialTexture.
inline constexpr std::array<MaterialTextureName, kMaterialTextureCount> kMaterialTextures = {{
    {"pbrMetallicRoughness", "baseColorTexture", shaders::ColorSpace::kSrgb},
    {"pbrMetallicRoughness", "metallicRoughnessTexture", shaders::ColorSpace::kLinear},
    {"", "normalTexture", shaders::ColorSpace::kLinear},
    {"", "occlusionTexture", shaders::ColorSpace::kLinear},
    {"", "emissiveTexture", shaders::ColorSpace::kSrgb},
    {"KHR_materials_pbrSpecularGlossiness", "specularGlossinessTexture", shaders::ColorSpace::kSrgb},
    {"KHR_materials_specular", "specularTexture", shaders::ColorSpace::kLinear},
    {"KHR_materials_specular", "specularColorTexture", shaders::ColorSpace::kSrgb},
    {"KHR_materials_clearcoat", "clearcoatTexture", shaders::ColorSpace::kLinear},
    {"KHR_materials_clearcoat", "clearcoatRoughnessTexture", shaders::ColorSpace::kLinear},
    {"KHR_materials_clearcoat", "clearcoatNormalTexture", shaders::ColorSpace::kLinear},
    {"KHR_materials_sheen", "sheenColorTexture", shaders::ColorSpace::kSrgb},
    {"KHR_materials_sheen", "sheenRoughnessTexture", shaders::ColorSpace::kLinear},
    {"KHR_materials_anisotropy", "anisotropyTexture", shaders::ColorSpace::kLinear},
    {"KHR_materials_iridescence", "iridescenceTexture", shaders::ColorSpace::kLinear},
    {"KHR_materials_iridescence", "iridescenceThicknessTexture", shaders::ColorSpace::kLinear},
    {"KHR_materials_transmission", "transmissionTexture", shaders::ColorSpace::kLinear},
    {"KHR_materials_volume", "thicknessTexture", shaders::ColorSpace::kLinear},
    {"KHR_materials_diffuse_transmission", "diffuseTransmissionTexture", shaders::ColorSpace::kLinear},
    {"KHR_materials_diffuse_transmission", "diffuseTransmissionColorTexture", shaders::ColorSpace::kSrgb},
}};

// The object of a material that names the texture, or null.
inline const nlohmann::json* owner_of(const nlohmann::json& material, const MaterialTextureName& texture) {
  const nlohmann::json* at = &material;
  const auto enter = [&](std::string_view name) {
    if (at == nullptr) return;
    const auto found = at->find(std::string(name));
    at = found == at->end() ? nullptr : &*found;
  };
  if (texture.extends()) enter("extensions");
  if (!texture.owner.empty()) enter(texture.owner);
  return at;
}

}  // namespace tessera::scene::gltf

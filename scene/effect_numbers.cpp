#include "scene/effect_numbers.h"

#include <limits>

namespace tessera::scene {
namespace {

using Effect = MaterialEffect;

constexpr double kNoLimit = static_cast<double>(std::numeric_limits<float>::max());
constexpr double kLeastDistance = 1e-6;

}  // namespace

std::span<const EffectNumber> effect_numbers() {
  static constexpr EffectNumber kNumbers[] = {
      {"/extensions/KHR_materials_anisotropy/anisotropyStrength", 1, 0, 1, Effect::kAnisotropy,
       [](Material& m) { return &m.anisotropy.strength; }},
      {"/extensions/KHR_materials_anisotropy/anisotropyRotation", 1, -kNoLimit, kNoLimit, Effect::kAnisotropy,
       [](Material& m) { return &m.anisotropy.rotation; }},
      {"/extensions/KHR_materials_clearcoat/clearcoatFactor", 1, 0, 1, Effect::kClearcoat,
       [](Material& m) { return &m.clearcoat.factor; }},
      {"/extensions/KHR_materials_clearcoat/clearcoatRoughnessFactor", 1, 0, 1, Effect::kClearcoat,
       [](Material& m) { return &m.clearcoat.roughness; }},
      {"/extensions/KHR_materials_clearcoat/clearcoatNormalTexture/scale", 1, -kNoLimit, kNoLimit, Effect::kClearcoat,
       [](Material& m) { return &m.clearcoat.normal_scale; }},
      {"/extensions/KHR_materials_diffuse_transmission/diffuseTransmissionFactor", 1, 0, 1,
       Effect::kDiffuseTransmission, [](Material& m) { return &m.diffuse_transmission.factor; }},
      {"/extensions/KHR_materials_diffuse_transmission/diffuseTransmissionColorFactor", 3, 0, kNoLimit,
       Effect::kDiffuseTransmission, [](Material& m) { return &m.diffuse_transmission.color.x; }},
      {"/extensions/KHR_materials_dispersion/dispersion", 1, 0, kNoLimit, Effect::kDispersion,
       [](Material& m) { return &m.volume.dispersion; }},
      {"/extensions/KHR_materials_ior/ior", 1, 1, kNoLimit, Effect::kDielectric,
       [](Material& m) { return &m.dielectric.ior; }},
      {"/extensions/KHR_materials_iridescence/iridescenceFactor", 1, 0, 1, Effect::kIridescence,
       [](Material& m) { return &m.iridescence.factor; }},
      {"/extensions/KHR_materials_iridescence/iridescenceIor", 1, 1, kNoLimit, Effect::kIridescence,
       [](Material& m) { return &m.iridescence.ior; }},
      {"/extensions/KHR_materials_iridescence/iridescenceThicknessMinimum", 1, 0, kNoLimit, Effect::kIridescence,
       [](Material& m) { return &m.iridescence.min_thickness; }},
      {"/extensions/KHR_materials_iridescence/iridescenceThicknessMaximum", 1, 0, kNoLimit, Effect::kIridescence,
       [](Material& m) { return &m.iridescence.max_thickness; }},
      {"/extensions/KHR_materials_sheen/sheenColorFactor", 3, 0, 1, Effect::kSheen,
       [](Material& m) { return &m.sheen.color.x; }},
      {"/extensions/KHR_materials_sheen/sheenRoughnessFactor", 1, 0, 1, Effect::kSheen,
       [](Material& m) { return &m.sheen.roughness; }},
      {"/extensions/KHR_materials_specular/specularFactor", 1, 0, 1, Effect::kDielectric,
       [](Material& m) { return &m.dielectric.specular; }},
      {"/extensions/KHR_materials_specular/specularColorFactor", 3, 0, kNoLimit, Effect::kDielectric,
       [](Material& m) { return &m.dielectric.specular_color.x; }},
      {"/extensions/KHR_materials_transmission/transmissionFactor", 1, 0, 1, Effect::kTransmission,
       [](Material& m) { return &m.transmission.factor; }},
      {"/extensions/KHR_materials_volume/thicknessFactor", 1, 0, kNoLimit, Effect::kVolume,
       [](Material& m) { return &m.volume.thickness; }},
      {"/extensions/KHR_materials_volume/attenuationDistance", 1, kLeastDistance, kNoLimit, Effect::kVolume,
       [](Material& m) { return &m.volume.attenuation_distance; }},
      {"/extensions/KHR_materials_volume/attenuationColor", 3, 0, 1, Effect::kVolume,
       [](Material& m) { return &m.volume.attenuation_color.x; }},
  };
  return kNumbers;
}

}  // namespace tessera::scene

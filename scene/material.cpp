#include "scene/material.h"

namespace tessera::scene {

MaterialEffects effects_in_force(const Material& m) {
  MaterialEffects out;
  const auto set = [&](MaterialEffect effect, bool on) { out[static_cast<std::size_t>(effect)] = on; };
  const Dielectric& d = m.dielectric;
  set(MaterialEffect::kDielectric, d.ior != 1.5f || d.specular != 1.0f || d.specular_color != Vec3(1.0f) ||
                                       d.texture.texture != nullptr || d.color_texture.texture != nullptr);
  set(MaterialEffect::kClearcoat, m.clearcoat.factor > 0.0f);
  set(MaterialEffect::kSheen, m.sheen.color != Vec3(0.0f));
  set(MaterialEffect::kAnisotropy, m.anisotropy.strength != 0.0f);
  set(MaterialEffect::kIridescence, m.iridescence.factor > 0.0f);
  const bool transmits = m.transmission.factor > 0.0f, spreads = m.diffuse_transmission.factor > 0.0f;
  set(MaterialEffect::kTransmission, transmits);
  set(MaterialEffect::kDiffuseTransmission, spreads);
  // A surface of no thickness has nothing inside.
  const bool volume = (transmits || spreads) && m.volume.thickness > 0.0f;
  set(MaterialEffect::kVolume, volume);
  set(MaterialEffect::kDispersion, transmits && volume && m.volume.dispersion > 0.0f);
  return out;
}

bool is_read(const Material& material, MaterialTexture slot) {
  using Slot = MaterialTexture;
  using Effect = MaterialEffect;
  switch (slot) {
    case Slot::kBaseColor:
    case Slot::kNormal:
      return true;
    case Slot::kEmissive:
      return !material.unlit || material.glows_unlit;
    case Slot::kMetallicRoughness:
      return !material.unlit && !material.has(Effect::kSpecularGlossiness);
    case Slot::kOcclusion:
      return !material.unlit;
    case Slot::kSpecularGlossiness:
      return material.has(Effect::kSpecularGlossiness);
    case Slot::kSpecular:
    case Slot::kSpecularColor:
      return material.has(Effect::kDielectric) && !material.has(Effect::kSpecularGlossiness);
    case Slot::kClearcoat:
    case Slot::kClearcoatRoughness:
    case Slot::kClearcoatNormal:
      return material.has(Effect::kClearcoat);
    case Slot::kSheenColor:
    case Slot::kSheenRoughness:
      return material.has(Effect::kSheen);
    case Slot::kAnisotropy:
      return material.has(Effect::kAnisotropy);
    case Slot::kIridescence:
    case Slot::kIridescenceThickness:
      return material.has(Effect::kIridescence);
    case Slot::kTransmission:
      return material.has(Effect::kTransmission);
    case Slot::kThickness:
      return material.has(Effect::kVolume);
    case Slot::kDiffuseTransmission:
    case Slot::kDiffuseTransmissionColor:
      return material.has(Effect::kDiffuseTransmission);
  }
  return false;
}

}  // namespace tessera::scene

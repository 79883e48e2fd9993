#include "scene/material.h"

#include <algorithm>

namespace tessera::scene {
namespace {

using enum MaterialEffect;

// The effect of each texture; core textures have none.
constexpr std::array<std::optional<MaterialEffect>, kMaterialTextureCount> effect_of_textures() {
  std::array<std::optional<MaterialEffect>, kMaterialTextureCount> effects;
  std::size_t slot = kCoreTextureCount;
  MaterialEffect effect{};
#define EFFECT(Name, ...) effect = k##Name;
#define TEXTURE(...) effects[slot++] = effect;
#include "scene/material_extensions.def"
  return effects;
}

// Whether `effects` has the other effects that an effect needs.
bool is_supported(MaterialEffect effect, const MaterialEffects& effects) {
  const auto has = [&](MaterialEffect other) { return effects[static_cast<std::size_t>(other)]; };
  const bool needs[] = {
#define EFFECT(Name, member, asked, needed) (needed),
#include "scene/material_extensions.def"
  };
  return needs[static_cast<std::size_t>(effect)];
}

}  // namespace

// An effect that others need needs none itself, or comes before them.
MaterialEffects drop_unsupported(MaterialEffects effects) {
  for (std::size_t effect = 0; effect < kMaterialEffectCount; ++effect)
    effects[effect] = effects[effect] && is_supported(static_cast<MaterialEffect>(effect), effects);
  return effects;
}

MaterialEffects effects_in_force(const Material& m) {
  MaterialEffects effects;
#define EFFECT(Name, member, asked, needed)               \
  {                                                       \
    [[maybe_unused]] const Name& e = m.member;            \
    effects[static_cast<std::size_t>(k##Name)] = (asked); \
  }
#include "scene/material_extensions.def"
  return drop_unsupported(effects);
}

void leave_out(std::string_view effect, Material& m) {
  const auto found = std::find(kMaterialEffectNames.begin(), kMaterialEffectNames.end(), effect);
  if (found == kMaterialEffectNames.end()) return;
  m.effects[static_cast<std::size_t>(found - kMaterialEffectNames.begin())] = false;
  m.effects = drop_unsupported(m.effects);
}

EffectFlags flags_of(const MaterialEffects& effects) {
  EffectFlags flags;
#define EFFECT(Name, member, ...) flags.member = effects[static_cast<std::size_t>(k##Name)];
#include "scene/material_extensions.def"
  return flags;
}

bool is_read(const Material& material, MaterialTexture slot) {
  static constexpr auto kEffects = effect_of_textures();
  if (const auto effect = kEffects[static_cast<std::size_t>(slot)])
    return material.has(*effect) && is_supported(*effect, material.effects);
  switch (slot) {
    case MaterialTexture::kEmissive:
      return !material.unlit || material.glows_unlit;
    case MaterialTexture::kMetallicRoughness:
      return !material.unlit && !material.has(kSpecularGlossiness);
    case MaterialTexture::kOcclusion:
      return !material.unlit;
    default:
      return true;
  }
}

// ---- Rows -------------------------------------------------------------------------------------------------------

float NumberRange::nearest(double value) const {
  constexpr double kLeastFactor = 1e-6;
  return static_cast<float>(std::clamp(value, above_low ? std::max(low, kLeastFactor) : low, high));
}

namespace {

constexpr double kMost = static_cast<double>(std::numeric_limits<float>::max());
constexpr NumberRange kAny{-kMost, kMost}, kShare{0, 1}, kNotNegative{0, kMost}, kPositive{0, kMost, true},
    kIndex{1, kMost}, kIndexOrInfinite{1, kMost, false, true};

struct Rows {
  std::vector<MaterialNumber> numbers;
  std::vector<MaterialTextureRow> textures;
};

Rows read_rows() {
  using enum shaders::ColorSpace;
  Rows rows;
  // The object that was opened last.
  std::string object;
  std::optional<MaterialEffect> effect;
  bool of_extension = false, archived = false;
  const auto add_number = [&](const char* name, int components, float value, const NumberRange& range,
                              float* (*of)(Material&)) {
    // glTF's object model names no properties of archived extensions.
    rows.numbers.push_back({object + "/" + name, components, value, range, effect, !archived, of});
  };
  const auto add_texture = [&](const char* name, MaterialTexture slot, shaders::ColorSpace space, bool replaces) {
    rows.textures.push_back({object, name, slot, space, of_extension, replaces});
  };
#define CORE(pointer) object = pointer;
#define EXTENSION(name, status, ...) \
  object = "/extensions/" #name;     \
  of_extension = true;               \
  archived = std::string_view(#status) == "kArchived";
#define EFFECT(Name, member, ...) \
  {                               \
    effect = k##Name;             \
    constexpr auto kOf = &Material::member;
#define END_EFFECT(...) \
  effect.reset();       \
  }
#define CORE_NUMBER(member, components, name, value, range) \
  add_number(name, components, value, range, [](Material& m) -> float* { return &m.member; });
#define NUMBER(member, name, value, range) \
  add_number(name, 1, value, range, [](Material& m) -> float* { return &(m.*kOf).member; });
#define COLOR(member, name, value, range) \
  add_number(name, 3, value, range, [](Material& m) -> float* { return &(m.*kOf).member.x; });
#define CORE_TEXTURE(member, Slot, slot, name, space) add_texture(name, MaterialTexture::k##Slot, space, false);
#define TEXTURE(member, Slot, slot, name, space) add_texture(name, MaterialTexture::k##Slot, space, false);
#define REPLACING_TEXTURE(Slot, name, space) add_texture(name, MaterialTexture::k##Slot, space, true);
#include "scene/material_extensions.def"
  return rows;
}

const Rows& all_rows() {
  static const Rows kRows = read_rows();
  return kRows;
}

}  // namespace

const std::vector<MaterialNumber>& material_numbers() { return all_rows().numbers; }
const std::vector<MaterialTextureRow>& material_textures() { return all_rows().textures; }

}  // namespace tessera::scene

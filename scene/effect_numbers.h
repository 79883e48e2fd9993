#pragma once

#include <span>
#include <string_view>

#include "scene/material.h"

namespace tessera::scene {

// A factor of a material's extension, as KHR_animation_pointer names and moves it. Values are clamped to [low, high].
struct EffectNumber {
  std::string_view pointer;  // within the material; those of textures are paths of their own
  int components;
  double low, high;
  MaterialEffect effect;  // what it belongs to; a material has it from the first frame on if it moves
  float* (*of)(Material&);
};
std::span<const EffectNumber> effect_numbers();

}  // namespace tessera::scene

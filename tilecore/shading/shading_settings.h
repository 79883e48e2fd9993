#pragma once

#include <cstdint>

#include "base/key_table.h"

namespace tessera::tilecore {

// When samples of a pixel share one pixel-shader invocation.
enum class ShadingRate : std::uint8_t {
  kPixel,   // one run per pixel and surface (multisampling); moving and defocused surfaces: per pixel-sized piece
  kSample,  // one run per visible sample
  kCache,   // one run per shading cell, shared by all samples that see it while the shading cache holds it
};

// Of interpolated attributes on their way to the pixel shader.
enum class AttributePrecision : std::uint8_t { kFloat, kHalf };

// Keys shading.*.
struct ShadingSettings {
  ShadingRate rate = ShadingRate::kPixel;
  double cell_pixels = 1.0;
  AttributePrecision attributes = AttributePrecision::kFloat;
};
Keys<ShadingSettings> shading_keys();

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr auto kEnumWords<tilecore::ShadingRate> = std::to_array<std::string_view>({"pixel", "sample", "cache"});
template <>
inline constexpr auto kEnumWords<tilecore::AttributePrecision> = std::to_array<std::string_view>({"float", "half"});

}  // namespace tessera

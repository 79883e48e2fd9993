#pragma once

#include <cstdint>

#include "base/key_table.h"

namespace tessera::tilecore {

// Which samples of a pixel share one pixel-shader invocation.
enum class ShadingRate : std::uint8_t {
  kPixel,      // as kPrimitive, but fragments of adjacent triangles of a smooth surface are merged first
  kPrimitive,  // one run per pixel and primitive (multisampling); moving and defocused surfaces: per pixel-sized piece
  kSample,     // one run per visible sample
  kCache,      // one run per shading cell, shared by all samples that see it while the shading cache holds it
};

// Source of derivatives of texture coordinates.
enum class ShadingDerivatives : std::uint8_t {
  kAnalytic,  // the surface itself
  kQuad,      // differences between the invocations of 2x2 pixels, with helper invocations where pixels are not covered
};

// Source of the surface of a Bezier patch in a pixel-shader invocation.
enum class ShadingSurface : std::uint8_t {
  kEvaluated,     // it evaluates the patch again, at its own parameters
  kInterpolated,  // it interpolates the vertices of the triangle that it sees, as for a mesh
  kFrame,         // the same, but without the displacement, whose gradient it looks up
};

// Precision of interpolated attributes before the pixel shader.
enum class AttributePrecision : std::uint8_t { kFloat, kHalf };

// Frames whose tiles have light lists (light_lists.h).
enum class LightLists : std::uint8_t {
  kOff,
  kRanged,  // with at least kFewestRangedLights point or spot lights that have a range
  kAll,     // with any of these
};
// [measured] On mid-mobile lists cost `eggs` 5 % of its cycles, with one such light, and save `garden_lamps` 13 %, with eight
// spots.
inline constexpr int kFewestRangedLights = 8;

// How opaque surfaces come to be shaded (docs/passes.md, Shading paths).
enum class ShadingPath : std::uint8_t {
  kVisibility,       // samples name the triangle that they see, and pixels are shaded when all of that is known
  kPrepass,          // the same, behind a pass that stores depths
  kGbuffer,          // a fill half leaves material and normal in the tile memory, a light half reads them there
  kGbufferExternal,  // likewise, but the G-buffer is stored, and a pass of its own loads and lights it
};

// Contents of a sample of the G-buffer (gbuffer.h).
enum class GbufferLayout : std::uint8_t {
  kExact,   // 64 bytes: the visibility record, and material and normal in single precision
  kPacked,  // gbuffer.bits, of which the values take 16 bytes
};

// Keys shading.*.
struct ShadingSettings {
  ShadingRate rate = ShadingRate::kPixel;
  ShadingDerivatives derivatives = ShadingDerivatives::kAnalytic;
  double cell_pixels = 1.0;
  ShadingSurface surface = ShadingSurface::kInterpolated;
  AttributePrecision attributes = AttributePrecision::kFloat;
  LightLists light_lists = LightLists::kRanged;
  ShadingPath path = ShadingPath::kVisibility;
  GbufferLayout layout = GbufferLayout::kExact;
  int gbuffer_bits = kPackedBits;  // of a sample of the packed G-buffer: a multiple of 32

  // Bits that the packed values take, and without emission, which surfaces that emit then shade forward.
  static constexpr int kPackedBits = 128, kBitsWithoutEmission = 96;

  bool has_gbuffer() const { return path == ShadingPath::kGbuffer || path == ShadingPath::kGbufferExternal; }
  // Bytes of a sample of the G-buffer; 0: there is none.
  std::uint64_t gbuffer_bytes() const {
    if (!has_gbuffer()) return 0;
    return layout == GbufferLayout::kExact ? 64 : static_cast<std::uint64_t>(gbuffer_bits / 8);
  }
  bool keeps_emission() const { return layout == GbufferLayout::kExact || gbuffer_bits >= kPackedBits; }
  // Words of 32 bits of a packed sample behind its values; -1: it lacks the one of emission.
  int further_words() const { return layout == GbufferLayout::kExact ? 0 : (gbuffer_bits - kPackedBits) / 32; }
};
Keys<ShadingSettings> shading_keys();

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr auto kEnumWords<tilecore::ShadingRate> = std::to_array<std::string_view>({"pixel", "primitive",
                                                                                           "sample", "cache"});
template <>
inline constexpr auto kEnumWords<tilecore::ShadingDerivatives> = std::to_array<std::string_view>({"analytic", "quad"});
template <>
inline constexpr auto kEnumWords<tilecore::ShadingSurface> = std::to_array<std::string_view>({"evaluated",
                                                                                              "interpolated", "frame"});
template <>
inline constexpr auto kEnumWords<tilecore::AttributePrecision> = std::to_array<std::string_view>({"float", "half"});
template <>
inline constexpr auto kEnumWords<tilecore::LightLists> = std::to_array<std::string_view>({"off", "ranged", "all"});
template <>
inline constexpr auto kEnumWords<tilecore::ShadingPath> =
    std::to_array<std::string_view>({"visibility", "prepass", "gbuffer", "gbuffer_external"});
template <>
inline constexpr auto kEnumWords<tilecore::GbufferLayout> = std::to_array<std::string_view>({"exact", "packed"});

}  // namespace tessera

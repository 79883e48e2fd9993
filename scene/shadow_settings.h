#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "base/key_table.h"
#include "shaders_cpp/shadow_map.h"

namespace tessera::scene {

// How a directional light's maps are fitted to the camera's view.
enum class ShadowFit : std::uint8_t { kSphere, kFrustum, kReceivers };
using shaders::ShadowFilter;
// The lights that cast shadows: the ones that the capture names, none, or all.
enum class ShadowCasters : std::uint8_t { kAuto, kOff, kAll };
// How a map holds a depth.
enum class DepthFormat : std::uint8_t { kD16, kD24, kD32F };
// The sides of single-sided surfaces that cast shadows.
enum class CasterFaces : std::uint8_t { kBoth, kFront, kBack };
// The view that chooses the cells of patches in a map: the light's or the camera's.
enum class CasterGrids : std::uint8_t { kLight, kCamera };
// Whether blended surfaces cast shadows.
enum class BlendedCasters : std::uint8_t { kNothing, kSolid };

// Bytes of a depth in memory.
constexpr int depth_bytes(DepthFormat format) { return format == DepthFormat::kD16 ? 2 : 4; }
// The step between two depths of a range of length `range`; 0 for single precision.
constexpr double depth_step(DepthFormat format, double range) {
  return format == DepthFormat::kD32F ? 0.0 : range / (format == DepthFormat::kD16 ? 65535.0 : 16777215.0);
}

// How shadows are cast; keys shadows.*. The capture (TESSERA_capture.shadows) or effects.shadows chooses the lights
// that cast them.
struct ShadowSettings {
  ShadowFilter filter = ShadowFilter::k2x2;
  DepthFormat format = DepthFormat::kD32F;
  int size = 0;      // texels along a map's side; 0: as the capture says
  int cascades = 0;  // of directional lights; 0: as the capture says
  ShadowFit fit = ShadowFit::kSphere;
  CasterFaces faces = CasterFaces::kBoth;
  BlendedCasters blended = BlendedCasters::kNothing;
  CasterGrids grids = CasterGrids::kCamera;
  int times = 1;              // maps of each light over a shutter in which something moves
  double bias = 1.0;          // factor on the bias that is computed from the receiver's slope and the depths' precision
  double offset = 0.0;        // scene units that are added to the bias
  double max_slope = 1000.0;  // limit on the slope of a receiver's plane, depth over width, in the bias

  bool operator==(const ShadowSettings&) const = default;
};
Keys<ShadowSettings> shadow_keys();

}  // namespace tessera::scene

namespace tessera {

template <>
inline constexpr auto kEnumWords<scene::ShadowCasters> = std::to_array<std::string_view>({"auto", "off", "all"});
template <>
inline constexpr auto kEnumWords<scene::ShadowFit> = std::to_array<std::string_view>({"sphere", "frustum",
                                                                                      "receivers"});
template <>
inline constexpr auto kEnumWords<scene::ShadowFilter> = std::to_array<std::string_view>({"nearest", "2x2", "3x3"});
template <>
inline constexpr auto kEnumWords<scene::DepthFormat> = std::to_array<std::string_view>({"d16", "d24", "d32f"});
template <>
inline constexpr auto kEnumWords<scene::CasterFaces> = std::to_array<std::string_view>({"both", "front", "back"});
template <>
inline constexpr auto kEnumWords<scene::CasterGrids> = std::to_array<std::string_view>({"light", "camera"});
template <>
inline constexpr auto kEnumWords<scene::BlendedCasters> = std::to_array<std::string_view>({"none", "solid"});

}  // namespace tessera

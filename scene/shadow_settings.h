#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "base/key_table.h"
#include "shaders_cpp/shadow_map.h"

namespace tessera::scene {

// How a directional light's maps are laid over what the camera sees.
enum class ShadowFit : std::uint8_t { kSphere, kFrustum, kReceivers };
using shaders::ShadowFilter;
// Which lights cast shadows: those that the capture names, none, or all of them.
enum class ShadowCasters : std::uint8_t { kAuto, kOff, kAll };
// How a map holds a depth.
enum class DepthFormat : std::uint8_t { kD16, kD24, kD32F };
// Which sides of single-sided surfaces cast.
enum class CasterFaces : std::uint8_t { kBoth, kFront, kBack };
// Whose cells patches have in a map: those that the light's view asks for, or the camera's.
enum class CasterGrids : std::uint8_t { kLight, kCamera };
// Whether blended surfaces cast.
enum class BlendedCasters : std::uint8_t { kNothing, kSolid };

// Bytes of a depth in memory.
constexpr int depth_bytes(DepthFormat format) { return format == DepthFormat::kD16 ? 2 : 4; }
// The step between two depths of a range that is `range` long; 0 where steps are those of single precision.
constexpr double depth_step(DepthFormat format, double range) {
  return format == DepthFormat::kD32F ? 0.0 : range / (format == DepthFormat::kD16 ? 65535.0 : 16777215.0);
}

// How shadows are cast; keys shadows.*. Which lights cast is said by the capture (TESSERA_capture.shadows) or by
// effects.shadows.
struct ShadowSettings {
  ShadowFilter filter = ShadowFilter::k2x2;
  DepthFormat format = DepthFormat::kD32F;
  int size = 0;      // texels along a map's side; 0: as the capture says
  int cascades = 0;  // of directional lights; 0: as the capture says
  ShadowFit fit = ShadowFit::kSphere;
  CasterFaces faces = CasterFaces::kBoth;
  BlendedCasters blended = BlendedCasters::kNothing;
  CasterGrids grids = CasterGrids::kCamera;
  int times = 1;              // maps of each light over a shutter in which anything moves
  double bias = 1.0;          // factor on the bias that follows from the receiver's slope and the depths' precision
  double offset = 0.0;        // scene units that are added to the bias
  double max_slope = 1000.0;  // of a receiver's plane, depth over width, as the bias takes it

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

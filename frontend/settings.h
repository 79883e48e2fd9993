#pragma once

#include <cstdint>

#include "base/key_table.h"

namespace tessera::frontend {

// How a sub-patch's displaced surface is boxed. All are conservative; they differ in tightness and cost.
enum class BoundMethod : std::uint8_t {
  kAabb,      // object axes, displacement in every direction
  kObb,       // axes from the corners, displacement in every direction
  kTpatch,    // axes from the corners, displacement along the normals that two tangent cones allow
  kNpatch,    // the same with the normal's own control vectors
  kInterval,  // object axes, the domain shader instantiated with Enclosure
};

// Which sub-patches are worth a further split, and in which order.
enum class SplitCriterion : std::uint8_t {
  kScreenExtent,  // the widest on screen first: for binning
  kFrustum,       // those that straddle a side of the view or the near plane: for view culling
  kNearest,       // the nearest first: for occlusion
  kNormalSpread,  // those whose tangents turn most, single-sided ones only: for back-face culling
  kSurfaceArea,   // the largest box in the world first: for ray tracing
};

// How the front end bounds, splits and culls; keys frontend.*.
struct Settings {
  BoundMethod bound_method = BoundMethod::kNpatch;
  SplitCriterion split_criterion = SplitCriterion::kScreenExtent;
  double split_pixels = 128;  // a sub-patch that is no wider on screen, at shutter open and close, is not split further
  int split_depth = 8;    // most splits on the way from a base patch to a sub-patch, not counting those for max_cells
  int split_budget = 64;  // most sub-patches that the criterion may make of one base patch
  bool backface_culling = true;
  bool previous_depth_culling = false;
};
Keys<Settings> settings_keys();

// With what it takes of the units around it.
struct FrontEndSpec : Settings {
  int max_cells = 16;  // a side of the largest sub-patch that a tile core takes: split further, whatever the criterion
  std::uint64_t burst_bytes = 64;
  std::int64_t l2_bytes = 1 << 20, l2_ways = 16;  // records and tables of heights are read through it
};

}  // namespace tessera::frontend

namespace tessera {

template <>
inline constexpr auto kEnumWords<frontend::BoundMethod> = std::to_array<std::string_view>({"aabb", "obb", "tpatch",
                                                                                           "npatch", "interval"});
template <>
inline constexpr auto kEnumWords<frontend::SplitCriterion> =
    std::to_array<std::string_view>({"screen_extent", "frustum", "nearest", "normal_spread", "surface_area"});

}  // namespace tessera

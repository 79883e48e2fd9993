#pragma once

#include <cstdint>

#include "base/key_table.h"

namespace tessera::frontend {

// Method that boxes a sub-patch's displaced surface. All are conservative; they differ in tightness and cost.
enum class BoundMethod : std::uint8_t {
  kAabb,      // object axes, displacement in every direction
  kObb,       // axes from the corners, displacement in every direction
  kTpatch,    // axes from the corners, displacement along the normals that two tangent cones allow
  kNpatch,    // the same with the normal's own control vectors
  kInterval,  // object axes, the domain shader instantiated with Enclosure
};

// Criterion that chooses sub-patches for a further split, and their order.
enum class SplitCriterion : std::uint8_t {
  kScreenExtent,  // the widest on screen first: for binning
  kFrustum,       // the straddlers of a side of the view or the near plane: for view culling
  kNearest,       // the nearest first: for occlusion
  kNormalSpread,  // the largest turn of tangents first, single-sided only: for back-face culling
  kSurfaceArea,   // the largest box in the world first: for ray tracing
};

// Settings of bounding, splitting and culling; keys frontend.*.
struct Settings {
  BoundMethod bound_method = BoundMethod::kNpatch;
  SplitCriterion split_criterion = SplitCriterion::kScreenExtent;
  double split_pixels = 128;  // a sub-patch no wider on screen, at shutter open and close, is not split further
  int split_depth = 8;        // most splits between a base patch and a sub-patch, not counting those for max_cells
  int split_budget = 64;      // most sub-patches that the criterion may make of one base patch
  bool backface_culling = true;
  bool previous_depth_culling = false;
};
Keys<Settings> settings_keys();

// The front end's settings and the sizes it takes from neighbouring units.
struct FrontEndSpec : Settings {
  int max_cells = 16;  // a side of the largest sub-patch that a tile core takes: split further, whatever the criterion
  std::uint64_t burst_bytes = 64;
  std::int64_t l2_bytes = 1 << 20, l2_ways = 16;  // records and tables of heights are read through it
  // By drawable: 1 leaves it out, as passes of baselines do that draw a part of the surfaces; empty: none.
  std::vector<std::uint8_t> left_out{};
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

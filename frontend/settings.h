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
  kCost,          // those whose halves cost the machine least against the whole: for binning
};

// How the front end bounds, splits and culls; keys frontend.*.
struct Settings {
  // Part of the tile cores' work on entries and boxes that the frame waits for, as kCost prices it; the rest hides behind
  // busier units [assumed]: that of the least cycles over the shipped captures, which hang on it by 0.1 %.
  static constexpr double kSplitCoreShare = 0.4;

  BoundMethod bound_method = BoundMethod::kNpatch;
  SplitCriterion split_criterion = SplitCriterion::kScreenExtent;
  double split_pixels = 128;  // a sub-patch that is no wider on screen, at shutter open and close, is not split further
  int split_depth = 8;    // most splits on the way from a base patch to a sub-patch, not counting those for max_cells
  int split_budget = 64;  // most sub-patches that the criterion may make of one base patch
  bool backface_culling = true;
  bool previous_depth_culling = false;
};
Keys<Settings> settings_keys();

// What the units behind the front end ask for, in cycles of the whole machine, and how the screen is cut into bins, each
// of which has a list of sub-patches. As it stands everything is free.
struct SplitPrices {
  double bin_width = 32, bin_height = 32;  // pixels
  bool rectangles = false;                 // lists of all bins of a bounding rectangle hold a sub-patch
  double bound = 0;                        // of a sub-patch, without what it fetches
  double byte = 0;                         // over the external memory interface
  double entry = 0;                        // of a list, appended and taken, without its bytes
  double entry_bytes = 0, entry_time_bytes = 0, record_bytes = 0;
  double box = 0;  // that a bin builds
  double boxes_per_cell = 0;
};

// With what it takes of the units around it.
struct FrontEndSpec : Settings {
  int max_cells = 16;  // a side of the largest sub-patch that a tile core takes: split further, whatever the criterion
  std::uint64_t burst_bytes = 64;
  SplitPrices prices;
  std::int64_t l2_bytes = 1 << 20, l2_ways = 16;  // tables of heights are read through it
};

}  // namespace tessera::frontend

namespace tessera {

template <>
inline constexpr auto kEnumWords<frontend::BoundMethod> = std::to_array<std::string_view>({"aabb", "obb", "tpatch",
                                                                                           "npatch", "interval"});
template <>
inline constexpr auto kEnumWords<frontend::SplitCriterion> =
    std::to_array<std::string_view>({"screen_extent", "frustum", "nearest", "normal_spread", "surface_area", "cost"});

}  // namespace tessera

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/counter.h"
#include "frontend/bounds/coarse_depth.h"
#include "scene/tessellation_pattern.h"

namespace tessera::frontend {

// What a guess hid, kept in memory until the frame's own depths say whether it was right: a sub-patch, a group of base
// patches (scene/patch_groups.h) or an instance, none of them looked into.
struct Deferred {
  enum Kind : std::uint8_t { kSubPatch, kGroup, kInstance };

  Kind kind = kSubPatch;
  std::uint8_t level = 0;    // of a group
  std::uint8_t segment = 0;  // FrameGeometry::segment()
  bool whole = false;        // a sub-patch of all cells of its patch, which its record says
  std::uint32_t number = 0;  // base patch, a group's first one, or the instance's first drawable
  scene::CellRange range{};  // of a sub-patch that is not whole
  BlockFootprint footprint;

  bool operator==(const Deferred&) const = default;
};

// Records of it, little endian, one behind the other. 64 bits for patches and groups that move by the whole shutter's
// frame, where the fields fit:
//
//   bits    field
//   0..23   number
//   24..26  level; 7: the whole patch
//   27..42  nearest depth
//   43..56  first block, counted row by row over the grid
//   57..59  columns less 1
//   60..62  rows less 1
//   63      1
//
// Anything else takes 128:
//
//   0..31   number
//   32..59  a sub-patch's i0, j0, i1, j1, 7 bits each, all 0 if whole; or a group's level
//   60..61  kind
//   62      segment, highest bit
//   63      0
//   64..79  nearest depth
//   80..123 first column, first row, last column, last row, 11 bits each
//   124..127 segment, lower bits
//
// `grid`: blocks of the frame.
inline constexpr int kMaxGridSide = 2048;  // blocks
void pack_deferred(const Deferred& deferred, const IntRect& grid, std::vector<std::uint8_t>& out);
std::vector<Deferred> unpack_deferred(std::span<const std::uint8_t> bytes, const IntRect& grid);

struct PreviousDepthCounters {
  std::uint64_t blocks_reprojected = 0;
  std::uint64_t blocks_tested = 0;
  std::uint64_t groups_culled = 0;
  std::uint64_t instances_culled = 0;
  std::uint64_t patches_culled = 0;
  std::uint64_t deferred_bytes = 0;
  std::uint64_t tiles_again = 0;
};

}  // namespace tessera::frontend

namespace tessera {

template <>
inline constexpr bool kAbsentWhenIdle<frontend::PreviousDepthCounters> = true;
template <>
inline constexpr auto kCounterFields<frontend::PreviousDepthCounters> = std::to_array<
    CounterField<frontend::PreviousDepthCounters>>({
    {"frontend.depth_blocks_reprojected", &frontend::PreviousDepthCounters::blocks_reprojected, Combine::kSum, "blocks",
     "Blocks of the previous frame's farthest depths that were put where the view at hand has them.", ""},
    {"frontend.depth_blocks_tested", &frontend::PreviousDepthCounters::blocks_tested, Combine::kSum, "blocks",
     "Blocks whose farthest depth was compared with the nearest one of an instance, a group or a sub-patch, in both "
     "passes.",
     ""},
    {"frontend.groups_culled_previous_depth", &frontend::PreviousDepthCounters::groups_culled, Combine::kSum, "groups",
     "Groups of base patches that the previous frame's depths hid, and this frame's as well.", ""},
    {"frontend.instances_culled_previous_depth", &frontend::PreviousDepthCounters::instances_culled, Combine::kSum,
     "instances", "Instances that the previous frame's depths hid, and this frame's as well.", ""},
    {"frontend.patches_culled_previous_depth", &frontend::PreviousDepthCounters::patches_culled, Combine::kSum,
     "patches", "Base patches of these groups and instances: their records were not read.", ""},
    {"frontend.deferred_bytes", &frontend::PreviousDepthCounters::deferred_bytes, Combine::kSum, "bytes",
     "Bytes of the records of what was deferred, written once and read once, before rounding to bursts.", ""},
    {"frontend.second_pass_tiles", &frontend::PreviousDepthCounters::tiles_again, Combine::kSum, "tiles",
     "Tiles that were rendered again because something deferred may be visible there.", ""},
});
TESSERA_COUNTERS_COVER(frontend::PreviousDepthCounters);

}  // namespace tessera

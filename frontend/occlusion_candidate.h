#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/counter.h"
#include "frontend/bounds/coarse_depth.h"

namespace tessera::frontend {

// A group of base patches (scene/cluster_bounds.h) or an instance that a guess hid. It is kept in memory, unopened,
// until the frame's own depths show whether the guess was right.
struct OcclusionCandidate {
  enum Kind : std::uint8_t { kGroup, kInstance };

  Kind kind = kGroup;
  std::uint8_t level = 0;     // of a group, below 8
  std::uint16_t segment = 0;  // FrameGeometry::segment()
  std::uint32_t number = 0;   // a group's first base patch, or the instance's first drawable
  BlockFootprint footprint;

  bool operator==(const OcclusionCandidate&) const = default;
};

// Packed records, back to back, 16 bytes each, little endian:
//
//   bits     field
//   0..31    number
//   32..47   nearest depth
//   48..50   level
//   51       kind
//   52..63   segment
//   64..79   first column of blocks
//   80..95   first row
//   96..111  last column
//   112..127 last row
inline constexpr std::size_t kDeferredBytes = 16;
void pack_candidates(const OcclusionCandidate& deferred, std::vector<std::uint8_t>& out);
std::vector<OcclusionCandidate> unpack_candidates(std::span<const std::uint8_t> bytes);

struct PreviousDepthCounters {
  std::uint64_t blocks_reprojected = 0;
  std::uint64_t blocks_tested = 0;
  std::uint64_t groups_culled = 0;
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
     "Blocks of the previous frame's farthest depths that were reprojected into the view of this frame.", ""},
    {"frontend.depth_blocks_tested", &frontend::PreviousDepthCounters::blocks_tested, Combine::kSum, "blocks",
     "Blocks whose farthest depth was compared with the nearest one of an instance, a group or a sub-patch, in both "
     "passes.",
     ""},
    {"frontend.groups_culled_previous_depth", &frontend::PreviousDepthCounters::groups_culled, Combine::kSum, "groups",
     "Groups of base patches, and instances, that the previous frame's depths hid, and this frame's as well.", ""},
    {"frontend.patches_culled_previous_depth", &frontend::PreviousDepthCounters::patches_culled, Combine::kSum,
     "patches", "Base patches of these groups and instances: their records were not read.", ""},
    {"frontend.deferred_bytes", &frontend::PreviousDepthCounters::deferred_bytes, Combine::kSum, "bytes",
     "Bytes of the records of deferred groups and instances, written once and read once, before rounding to bursts.",
     ""},
    {"frontend.second_pass_tiles", &frontend::PreviousDepthCounters::tiles_again, Combine::kSum, "tiles",
     "Tiles that were rendered again because a deferred group or instance may be visible there.", ""},
});
TESSERA_COUNTERS_COVER(frontend::PreviousDepthCounters);

}  // namespace tessera

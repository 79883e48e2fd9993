#pragma once

#include <cstdint>
#include <vector>

#include "base/counter.h"
#include "frontend/bounds/sub_patch_bounder.h"
#include "frontend/occlusion_candidate.h"
#include "frontend/settings.h"
#include "memory/ledger.h"
#include "scene/frame_geometry.h"

namespace tessera::frontend {

// Patches of drawables whose vertices rest are tested in groups (scene/cluster_bounds.h) before any of their records is
// fetched: a drawable far outside the view costs the logarithm of its patches.
//
// Invariants (cited by the tests):
//   PC1  A dropped patch appears nowhere in the frame: a group's body holds every vertex that the machine computes of
//        its patches, at both motion keys.
//   PC2  The boxes of a group are contiguous: reading them is one record, testing each is counted. The boxes below a group
//        that is outside are neither read nor tested.
//   PC3  Patches that stay keep their order.

// [assumed] A box of six floats, and the header of a group's boxes: their number and the address of the boxes below.
inline constexpr std::uint64_t kPatchGroupBoxBytes = sizeof(scene::PatchGroups::Box), kPatchGroupHeaderBytes = 8;

struct PatchGroupCounters {
  std::uint64_t groups_tested = 0;
  std::uint64_t patches_culled = 0;
};

// Base patches [first, end).
struct PatchRun {
  std::uint32_t first, end;
};

// The hierarchy of patch groups of a drawable as this frame poses it; null if its vertices do not rest or are few.
const scene::PatchGroups* resting_groups(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable);

// A group's box in the drawable's object space, displaced by up to `offset`.
MovingBox group_box(const scene::PatchGroups::Box& box, double offset);

// Culls the patches of `drawables`, rising numbers. `read` holds the remaining patches, in order. Groups that `depth`,
// a guess unless null, hides are deferred.
struct PatchCulling {
  std::vector<PatchRun> read;
  std::vector<OcclusionCandidate> deferred;
  PatchGroupCounters counters;
  PreviousDepthCounters previous_depth;
  memory::Ledger ledger;
};
PatchCulling cull_patches(const scene::FrameGeometry& frame, const std::vector<std::uint32_t>& drawables,
                          const PyramidLibrary& pyramids, const FrontEndSpec& spec, const CoarseDepth* depth = nullptr);

// Number of base patches of a deferred group.
std::uint64_t group_patches(const scene::FrameGeometry& frame, const OcclusionCandidate& group);

// The remaining patches of a deferred group; `depth` is the frame's own, and the groups that it hides are dropped. The
// group's own box is not tested again.
PatchCulling cull_group(const scene::FrameGeometry& frame, const OcclusionCandidate& group,
                        const PyramidLibrary& pyramids, const FrontEndSpec& spec, const CoarseDepth& depth);

}  // namespace tessera::frontend

namespace tessera {

template <>
inline constexpr bool kAbsentWhenIdle<frontend::PatchGroupCounters> = true;
template <>
inline constexpr auto kCounterFields<frontend::PatchGroupCounters> =
    std::to_array<CounterField<frontend::PatchGroupCounters>>({
        {"frontend.patch_groups_tested", &frontend::PatchGroupCounters::groups_tested, Combine::kSum, "groups",
         "Groups of neighbouring base patches whose common box was tested against the view before their records were "
         "read.",
         ""},
        {"frontend.patches_culled_in_groups", &frontend::PatchGroupCounters::patches_culled, Combine::kSum, "patches",
         "Base patches of groups outside the view; neither their records were read nor their own bounds computed.", ""},
    });
TESSERA_COUNTERS_COVER(frontend::PatchGroupCounters);

}  // namespace tessera

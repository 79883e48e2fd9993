#pragma once

#include <cstdint>
#include <vector>

#include "base/counter.h"
#include "frontend/instance_culling.h"
#include "frontend/occlusion_candidate.h"
#include "frontend/patch_culling.h"
#include "frontend/patch_record.h"
#include "frontend/patch_splitter.h"
#include "memory/ledger.h"
#include "scene/frame_geometry.h"
#include "scene/limits.h"

namespace tessera::frontend {

// [assumed] Caches of the front end for table lines and neighbours' records; they are empty at the beginning of each
// block of base patches.
inline constexpr std::uint32_t kPatchesPerBlock = 64;
inline constexpr std::int64_t kTableCacheBytes = 16384, kTableCacheWays = 4, kCachedRecords = 16;

// The front end's work on one frame after posing, for each of its motion segments: it drops instances and groups of
// patches that cannot be seen, splits every base patch of the others, bounds the pieces and drops invisible ones.
// Sub-patches come out in the order of their base patches, segment by segment.
//
// Instances and groups that `guess`, if there is one, hides are deferred: instances before their mesh is read, groups
// before their patches' records are. Sub-patches are not deferred: a record and list entries cost no more than the
// record of a deferred candidate, and tile cores drop them by nearer depths. Throws LimitError when the sub-patches
// need more memory than `budget` has; the excess is at most the sub-patches of 32768 base patches.
struct FrontEndResult {
  std::vector<BoundedSubPatch> sub_patches;
  std::vector<std::uint8_t> deferred;      // pack_candidates(), segment by segment
  std::vector<std::uint32_t> table_lines;  // FrontendCounters::table_lines, by number within the tables, in order
  // Lines of records that the L2 lacked, by number within the records, in order; and the number of lines of all
  // records.
  std::vector<std::uint32_t> record_misses;
  std::uint32_t records_end = 0;
  FrontendCounters counters;
  PreviousDepthCounters previous_depth;
  InstanceCounters instances;
  PatchGroupCounters groups;
  memory::Ledger ledger;
};
FrontEndResult run_front_end(const scene::FrameGeometry& frame, const PyramidLibrary& pyramids,
                             const FrontEndSpec& spec, const CoarseDepth* guess = nullptr,
                             scene::MemoryBudget* budget = nullptr);

// Sub-patches of the deferred candidates that the frame's own, now known, depth does not hide. Counts into `front_end`
// and charges its reads there.
//
// Invariant (cited by the tests):
//   SP1  A deferred sub-patch that is not returned appears nowhere in the frame.
std::vector<BoundedSubPatch> second_pass_visible(const scene::FrameGeometry& frame, const PyramidLibrary& pyramids,
                                                 const FrontEndSpec& spec, const CoarseDepth& depth,
                                                 FrontEndResult& front_end);

}  // namespace tessera::frontend

namespace tessera {

template <>
inline constexpr auto kCounterFields<frontend::FrontendCounters> =
    std::to_array<CounterField<frontend::FrontendCounters>>({
        {"frontend.base_patches", &frontend::FrontendCounters::base_patches, Combine::kSum, "patches",
         "Base patches read: Bezier patches and clusters of passive meshes.",
         "MaliGeomTotalPrim; PowerVR Triangles In; Adreno pre-clipped polygons; Apple primitives in; Vulkan "
         "tessellation control patches"},
        {"frontend.bounds_computed", &frontend::FrontendCounters::bounds_computed, Combine::kSum, "bounds",
         "Bounding volumes computed for sub-patches.", ""},
        {"frontend.splits", &frontend::FrontendCounters::splits, Combine::kSum, "splits",
         "Sub-patches halved, because they were too large for a tile core or by the split criterion.", ""},
        {"frontend.culled_frustum", &frontend::FrontendCounters::culled_frustum, Combine::kSum, "sub-patches",
         "Sub-patches dropped because their bound lies outside the view or its depth range at all times.",
         "MaliGeomFaceXYPlaneCullPrim, MaliGeomZPlaneCullPrim; Adreno % primitives trivially rejected; V3D "
         "PTB-primitives-discarded-outside-viewport; Apple primitives culled"},
        {"frontend.culled_backface", &frontend::FrontendCounters::culled_backface, Combine::kSum, "sub-patches",
         "Sub-patches dropped because they face away from the whole lens at all times.",
         "MaliGeomFaceXYPlaneCullPrim; PowerVR Triangle Ratio; V3D PTB-primitives-discarded-reversed; Apple primitives "
         "culled"},
        {"frontend.second_pass_visible", &frontend::FrontendCounters::second_pass_visible, Combine::kSum, "groups",
         "Groups and instances that the previous frame's depths hid but this frame's did not: their parts are tested, "
         "and tiles in which a part is visible are rendered again.",
         ""},
        {"frontend.cells", &frontend::FrontendCounters::cells, Combine::kSum, "cells",
         "Cells of the grids of all base patches; each takes about one domain evaluation when it is tessellated.", ""},
        {"frontend.cells_culled_frustum", &frontend::FrontendCounters::cells_culled_frustum, Combine::kSum, "cells",
         "Cells of the sub-patches that frontend.culled_frustum counts.", ""},
        {"frontend.cells_culled_backface", &frontend::FrontendCounters::cells_culled_backface, Combine::kSum, "cells",
         "Cells of the sub-patches that frontend.culled_backface counts.", ""},
        {"frontend.sub_patches", &frontend::FrontendCounters::sub_patches, Combine::kSum, "sub-patches",
         "Sub-patches sent to the binner.",
         "MaliGeomVisiblePrim; PowerVR Triangles Out; Adreno PERF_LRZ_VISIBLE_PRIM_AFTER_LRZ; V3D "
         "PTB-primitives-binned; Apple primitives rendered"},
        {"frontend.sub_patches_moving", &frontend::FrontendCounters::sub_patches_moving, Combine::kSum, "sub-patches",
         "Sub-patches sent to the binner whose kernels need motion.", ""},
        {"frontend.sub_patches_defocused", &frontend::FrontendCounters::sub_patches_defocused, Combine::kSum,
         "sub-patches", "Sub-patches sent to the binner whose kernels need the lens.", ""},
        {"frontend.sub_patches_displaced", &frontend::FrontendCounters::sub_patches_displaced, Combine::kSum,
         "sub-patches", "Sub-patches sent to the binner whose vertices are displaced.", ""},
        {"frontend.sub_patches_alpha_tested", &frontend::FrontendCounters::sub_patches_alpha_tested, Combine::kSum,
         "sub-patches", "Sub-patches sent to the binner whose hits look up alpha.", ""},
        {"frontend.sub_patches_blended", &frontend::FrontendCounters::sub_patches_blended, Combine::kSum, "sub-patches",
         "Sub-patches sent to the binner that are kept as layers.", ""},
        {"frontend.motion_elided", &frontend::FrontendCounters::motion_elided, Combine::kSum, "sub-patches",
         "Sub-patches of moving drawables whose vertices all move by no more than a sub-pixel: they need no code for "
         "motion.",
         ""},
        {"frontend.defocus_elided", &frontend::FrontendCounters::defocus_elided, Combine::kSum, "sub-patches",
         "Sub-patches that are wholly in focus although the camera has a lens: they need no code for it.", ""},
        {"frontend.displacement_elided", &frontend::FrontendCounters::displacement_elided, Combine::kSum, "sub-patches",
         "Sub-patches with a displacement map that is zero wherever they read it: they need no code for displacement.",
         ""},
        {"frontend.alpha_test_elided", &frontend::FrontendCounters::alpha_test_elided, Combine::kSum, "sub-patches",
         "Sub-patches of masked materials that are opaque all over: they need no alpha test.", ""},
        {"frontend.table_lines", &frontend::FrontendCounters::table_lines, Combine::kSum, "bursts",
         "Bursts of tables of heights that the front end's own caches miss and that it requests from the L2.", ""},
        {"frontend.record_lines", &frontend::FrontendCounters::record_lines, Combine::kSum, "bursts",
         "Bursts of records that the front end requests from the L2: records that bound base patches, and neighbours' "
         "records that its own cache misses.",
         ""},
        {"frontend.record_misses", &frontend::FrontendCounters::record_misses, Combine::kSum, "bursts",
         "Bursts of frontend.record_lines that the L2 lacks.", ""},
        {"frontend.elements_decoded", &frontend::FrontendCounters::elements_decoded, Combine::kSum, "elements",
         "Positions that the front end's decoder makes from records, with geometry.encoding.", ""},
    });
TESSERA_COUNTERS_COVER(frontend::FrontendCounters);

}  // namespace tessera

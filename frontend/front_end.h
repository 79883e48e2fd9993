#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "frontend/bounds/minmax_pyramid.h"
#include "frontend/bounds/screen_bounds.h"
#include "frontend/frame_geometry.h"
#include "hardware/configuration.h"
#include "hardware/counter.h"
#include "hardware/ledger.h"

namespace tessera::frontend {

struct FrontendCounters {
  std::uint64_t base_patches = 0;
  std::uint64_t bounds_computed = 0;
  std::uint64_t culled_frustum = 0;
  std::uint64_t sub_patches = 0;
};

// A sub-patch as it goes to the binner: which cells, and where on screen they may appear.
struct BoundedSubPatch {
  std::uint32_t base_patch;
  CellRange range;
  ScreenBounds bounds;    // over the whole shutter and lens
  MovingCorners corners;  // of its moving box; bounds.grow pixels around their projections hold everything that is drawn
};

// Min-max pyramids of every displacement texture of a capture; built once.
class PyramidLibrary {
 public:
  explicit PyramidLibrary(const Assembly& assembly);
  const MinMaxPyramid& of(const shaders::ScalarTexture& texture) const { return *pyramids_.at(&texture); }

 private:
  std::map<const shaders::ScalarTexture*, std::unique_ptr<MinMaxPyramid>> pyramids_;
};

// Bytes of a base patch's record in memory: a header, then control points or cluster vertices at one or two keys, then
// the cells of a cluster. What the front end and every tile core that needs the patch fetch.
std::uint64_t patch_record_bytes(const FrameGeometry& frame, std::uint32_t patch);

// Bound of one sub-patch in raster space at both keys (OBB), with the rounding margin that goes with it.
struct SubPatchBody {
  MovingCorners corners;
  RoundingMargin margin;
};
SubPatchBody sub_patch_body(const FrameGeometry& frame, const PyramidLibrary& pyramids, std::uint32_t patch, const CellRange& range);

// The cell ranges that a base patch is cut into: halves of the longer side until neither exceeds `max_cells`; a
// cluster stays whole.
std::vector<CellRange> cut_patch(const FrameGeometry& frame, std::uint32_t patch, int max_cells);

// The front end's work on one frame after posing: cut every base patch, bound the pieces, drop what is outside the
// view. Configured by tessellator.sub_patch_cells. Sub-patches come out in the order of their base patches.
struct FrontEndResult {
  std::vector<BoundedSubPatch> sub_patches;
  FrontendCounters counters;
  hardware::Ledger ledger;
};
FrontEndResult run_front_end(const FrameGeometry& frame, const PyramidLibrary& pyramids, const hardware::GpuConfiguration& gpu);

}  // namespace tessera::frontend

namespace tessera::hardware {

template <>
inline constexpr auto kCounterFields<frontend::FrontendCounters> = std::to_array<CounterField<frontend::FrontendCounters>>({
    {"frontend.base_patches", &frontend::FrontendCounters::base_patches, Combine::kSum, "patches",
     "Base patches read: Bezier patches and clusters of passive meshes.",
     "MaliGeomTotalPrim; PowerVR Triangles In; Vulkan tessellation control patches"},
    {"frontend.bounds_computed", &frontend::FrontendCounters::bounds_computed, Combine::kSum, "bounds",
     "Bounding volumes computed for sub-patches.", ""},
    {"frontend.culled_frustum", &frontend::FrontendCounters::culled_frustum, Combine::kSum, "sub-patches",
     "Sub-patches dropped because their bound lies outside the view or its depth range at all times.",
     "MaliGeomFaceXYPlaneCullPrim, MaliGeomZPlaneCullPrim; V3D PTB-primitives-discarded-outside-viewport"},
    {"frontend.sub_patches", &frontend::FrontendCounters::sub_patches, Combine::kSum, "sub-patches",
     "Sub-patches sent to the binner.", "MaliGeomVisiblePrim; V3D PTB-primitives-binned"},
});
TESSERA_COUNTERS_COVER(frontend::FrontendCounters);

}  // namespace tessera::hardware

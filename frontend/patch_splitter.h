#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "frontend/bounds/back_face.h"
#include "frontend/bounds/coarse_depth.h"
#include "frontend/bounds/screen_bounds.h"
#include "frontend/bounds/sub_patch_bounder.h"
#include "frontend/settings.h"
#include "frontend/sub_patch_effects.h"

namespace tessera::frontend {

// Counts of base patches, sub-patches and cells. A cell counts as one domain evaluation, as with one vertex per cell.
struct FrontendCounters {
  std::uint64_t base_patches = 0;
  std::uint64_t bounds_computed = 0;
  std::uint64_t splits = 0;
  std::uint64_t culled_frustum = 0;
  std::uint64_t culled_backface = 0;
  std::uint64_t second_pass_visible = 0;
  std::uint64_t cells = 0;
  std::uint64_t cells_culled_frustum = 0;
  std::uint64_t cells_culled_backface = 0;
  std::uint64_t sub_patches = 0;
  std::uint64_t sub_patches_moving = 0;
  std::uint64_t sub_patches_defocused = 0;
  std::uint64_t sub_patches_displaced = 0;
  std::uint64_t sub_patches_alpha_tested = 0;
  std::uint64_t sub_patches_blended = 0;
  std::uint64_t motion_elided = 0;
  std::uint64_t defocus_elided = 0;
  std::uint64_t displacement_elided = 0;
  std::uint64_t alpha_test_elided = 0;
  std::uint64_t table_lines = 0;
  std::uint64_t record_lines = 0, record_misses = 0;
  std::uint64_t elements_decoded = 0;
};

// A sub-patch as the binner gets it: its cells, and its bounds on screen.
struct BoundedSubPatch {
  std::uint32_t base_patch;
  scene::CellRange range;
  ScreenBounds bounds;                         // over the whole shutter and lens
  MovingBox box;                               // in object space
  std::uint8_t effects = kAllSubPatchEffects;  // that its kernels need: bits of SubPatchEffect
  std::uint16_t segment = 0;                   // FrameGeometry::segment() by whose frame it moves

  // Corners of its moving box; everything drawn lies within bounds.grow pixels of their projections. Computed at each
  // call: they take three times the room of the box, and a frame may have millions of sub-patches. `frame`: the whole
  // shutter's.
  MovingCorners corners(const scene::FrameGeometry& frame) const {
    return box_corners(box, frame.segment(segment).drawable_of(base_patch).to_raster);
  }
};

// Splits base patches into sub-patches, best first by a priority queue, and culls on the way: a dropped part is never
// split, bounded or binned again. A split halves the cells, at the longer side on screen; the tessellation itself never
// changes. Raises neither the invalid nor the divide-by-zero flag if its bounds do not. Owns scratch memory; one
// instance per thread.
class PatchSplitter {
 public:
  // `depth`, unless null: the frame's own depths; the sub-patches that it hides are dropped unsplit. `fetches`, unless
  // null, gets the reads of bounding besides the patch.
  PatchSplitter(const scene::FrameGeometry& frame, const PyramidLibrary& pyramids, const FrontEndSpec& settings,
                const CoarseDepth* depth = nullptr, HeightTableCache* fetches = nullptr)
      : frame_(frame),
        pyramids_(pyramids),
        settings_(settings),
        depth_(depth),
        bounder_(frame, pyramids, settings.bound_method, fetches),
        back_face_(frame, fetches),
        effects_(frame, pyramids) {}
  PatchSplitter(const PatchSplitter&) = delete;
  PatchSplitter(PatchSplitter&&) = default;

  // Appends the sub-patches of one base patch.
  void split(std::uint32_t patch, std::vector<BoundedSubPatch>& out, FrontendCounters& counters);
  // Number of blocks of `depth` tested since the last call.
  std::uint64_t take_blocks_tested() { return std::exchange(blocks_tested_, 0); }

 private:
  using Halves = std::array<SiblingBound, 2>;
  struct Node {
    double priority;  // of splitting; <= 0: it is not split
    std::uint32_t order;
    int depth;
    BoundedSubPatch piece;
    MovingCorners corners;
    Halves* halves;  // null: not bounded yet
  };
  // Bounds and tests a range; nullopt when culled. `bound`, unless null, is a bound found before.
  std::optional<Node> visit(std::uint32_t patch, const scene::CellRange& range, const SiblingBound* bound, int depth,
                            FrontendCounters& counters);
  // The halves of a node that is being split, bounded together with the halves of the node that is likely the next.
  Halves* bound_halves(Node& node, bool mandatory, bool next_as_well);
  Halves* take_halves();
  void give_back(Halves* halves) { spare_.push_back(halves); }
  double priority(const BoundedSubPatch& piece, const MovingCorners& corners, int depth) const;
  bool splits_along_u(const Node& node, bool mandatory) const;
  void count_effects(std::uint8_t effects, FrontendCounters& counters) const;

  const scene::FrameGeometry& frame_;
  const PyramidLibrary& pyramids_;
  FrontEndSpec settings_;
  const CoarseDepth* depth_;
  SubPatchBounder bounder_;
  BackFaceTest back_face_;
  EffectSelector effects_;
  std::vector<Node> heap_;
  std::deque<Halves> halves_;  // all pairs, in use or spare
  std::vector<Halves*> spare_;
  std::uint32_t visited_ = 0;
  std::uint64_t blocks_tested_ = 0;
};

// Area of a moving box's faces in the world, the larger of both keys.
double box_area(const MovingBox& box, const std::array<Mat4, 2>& to_world);

// The halves of a range.
std::array<scene::CellRange, 2> halves(const scene::CellRange& range, bool along_u);

}  // namespace tessera::frontend

#include "frontend/patch_culling.h"

#include <algorithm>

#include "base/parallel.h"
#include "frontend/bounds/drawable_box.h"

namespace tessera::frontend {
namespace {

using scene::kPatchesPerGroup;
using scene::PatchGroups;

void append(const PatchRun& patches, std::vector<PatchRun>& runs) {
  if (!runs.empty() && runs.back().end == patches.first)
    runs.back().end = patches.end;
  else
    runs.push_back(patches);
}

// Walks the groups of one drawable.
class GroupWalk {
 public:
  GroupWalk(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable, const PyramidLibrary& pyramids,
            std::uint64_t burst_bytes, const CoarseDepth* depth, PatchCulling& out)
      : frame_(frame),
        drawable_(drawable),
        groups_(*resting_groups(frame, drawable)),
        offset_(largest_offset(drawable, pyramids)),
        burst_bytes_(burst_bytes),
        depth_(depth),
        out_(out) {}

  void run() { test(groups_.levels.size() - 1, 0, groups_.levels.back().size()); }
  // Tests the content of the group that begins with `first_patch`.
  void run_group(std::size_t level, std::uint32_t first_patch) {
    below(level, static_cast<std::size_t>((first_patch - drawable_.drawable->first_patch) / span(level)));
  }

 private:
  // Boxes [first, end) of a level, which are contiguous.
  void test(std::size_t level, std::size_t first, std::size_t end) {
    const std::vector<PatchGroups::Box>& boxes = groups_.levels[level];
    out_.ledger.read(
        memory::Unit::kFrontend, memory::Purpose::kPatchData,
        memory::burst_bytes(0, kPatchGroupHeaderBytes + (end - first) * kPatchGroupBoxBytes, burst_bytes_));
    for (std::size_t b = first; b < end; ++b) {
      ++out_.counters.groups_tested;
      const std::optional<ScreenBounds> bounds =
          bounds_in_view(box_body(frame_, drawable_, group_box(boxes[b], offset_)), frame_);
      if (!bounds) {
        out_.counters.patches_culled += patches_in(level, b);
      } else if (!hidden(*bounds, level, b)) {
        below(level, b);
      }
    }
  }

  void below(std::size_t level, std::size_t box) {
    if (level == 0) return append(patches_of(0, box), out_.read);
    const std::size_t first = box * kPatchesPerGroup;
    test(level - 1, first, std::min(first + kPatchesPerGroup, groups_.levels[level - 1].size()));
  }

  bool hidden(const ScreenBounds& bounds, std::size_t level, std::size_t box) {
    if (depth_ == nullptr) return false;
    const BlockFootprint footprint = depth_->footprint(bounds);
    if (!depth_->hides(footprint, out_.previous_depth.blocks_tested)) return false;
    ++out_.previous_depth.groups_culled;
    out_.previous_depth.patches_culled += patches_in(level, box);
    out_.deferred.push_back(
        {OcclusionCandidate::kGroup, static_cast<std::uint8_t>(level), 0, patches_of(level, box).first, footprint});
    return true;
  }

  static std::uint64_t span(std::size_t level) {
    std::uint64_t patches = kPatchesPerGroup;
    for (std::size_t k = 0; k < level; ++k) patches *= kPatchesPerGroup;
    return patches;
  }
  PatchRun patches_of(std::size_t level, std::size_t box) const {
    const std::uint64_t count = drawable_.drawable->patch_count;
    const auto at = [&](std::uint64_t patch) {
      return drawable_.drawable->first_patch + static_cast<std::uint32_t>(std::min(patch, count));
    };
    return {at(box * span(level)), at((box + 1) * span(level))};
  }
  std::uint64_t patches_in(std::size_t level, std::size_t box) const {
    const PatchRun patches = patches_of(level, box);
    return patches.end - patches.first;
  }

  const scene::FrameGeometry& frame_;
  const scene::PosedDrawable& drawable_;
  const PatchGroups& groups_;
  double offset_;
  std::uint64_t burst_bytes_;
  const CoarseDepth* depth_;
  PatchCulling& out_;
};

}  // namespace

const PatchGroups* resting_groups(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable) {
  const scene::Drawable& drawn = *drawable.drawable;
  if (drawable.procedure != nullptr || !drawable.own_vertices) return nullptr;
  const std::vector<PatchGroups>& all = drawn.kind == scene::Primitive::Kind::kBezierPatches
                                            ? frame.assembly->bezier_groups
                                            : frame.assembly->cluster_groups;
  return all[drawn.geometry].levels.empty() ? nullptr : &all[drawn.geometry];
}

MovingBox group_box(const PatchGroups::Box& box, double offset) {
  MovingBox moving = empty_box({DVec3(1, 0, 0), DVec3(0, 1, 0), DVec3(0, 0, 1)});
  for (std::size_t key = 0; key < 2; ++key)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      moving.low[key][axis] = static_cast<double>(box.low[axis]) - offset;
      moving.high[key][axis] = static_cast<double>(box.high[axis]) + offset;
    }
  return moving;
}

PatchCulling cull_patches(const scene::FrameGeometry& frame, const std::vector<std::uint32_t>& drawables,
                          const PyramidLibrary& pyramids, const FrontEndSpec& spec, const CoarseDepth* depth) {
  std::vector<std::uint32_t> grouped;
  for (const std::uint32_t d : drawables)
    if (resting_groups(frame, frame.drawables[d]) != nullptr) grouped.push_back(d);
  std::vector<PatchCulling> walked(grouped.size());
  parallel_for(grouped.size(), [&](std::size_t k) {
    GroupWalk(frame, frame.drawables[grouped[k]], pyramids, spec.burst_bytes, depth, walked[k]).run();
  });
  PatchCulling all;
  std::size_t next = 0;
  for (const std::uint32_t d : drawables) {
    if (next == grouped.size() || grouped[next] != d) {
      const scene::Drawable& drawn = *frame.drawables[d].drawable;
      append({drawn.first_patch, drawn.first_patch + drawn.patch_count}, all.read);
      continue;
    }
    for (const PatchRun& run : walked[next].read) append(run, all.read);
    all.deferred.insert(all.deferred.end(), walked[next].deferred.begin(), walked[next].deferred.end());
    merge(all.counters, walked[next].counters);
    merge(all.previous_depth, walked[next].previous_depth);
    all.ledger += walked[next].ledger;
    ++next;
  }
  return all;
}

std::uint64_t group_patches(const scene::FrameGeometry& frame, const OcclusionCandidate& group) {
  const scene::Drawable& drawn = *frame.drawable_of(group.number).drawable;
  std::uint64_t patches = kPatchesPerGroup;
  for (int k = 0; k < group.level; ++k) patches *= kPatchesPerGroup;
  return std::min(patches, std::uint64_t{drawn.first_patch} + drawn.patch_count - group.number);
}

PatchCulling cull_group(const scene::FrameGeometry& frame, const OcclusionCandidate& group,
                        const PyramidLibrary& pyramids, const FrontEndSpec& spec, const CoarseDepth& depth) {
  PatchCulling left;
  GroupWalk(frame, frame.drawable_of(group.number), pyramids, spec.burst_bytes, &depth, left)
      .run_group(group.level, group.number);
  left.deferred.clear();
  return left;
}

}  // namespace tessera::frontend

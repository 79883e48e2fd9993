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
struct Walked {
  std::vector<PatchRun> read;
  PatchGroupCounters counters;
  std::uint64_t bytes = 0;
};
class GroupWalk {
 public:
  GroupWalk(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable, const PatchGroups& groups,
            const PyramidLibrary& pyramids, std::uint64_t burst_bytes, Walked& out)
      : frame_(frame),
        drawable_(drawable),
        groups_(groups),
        offset_(largest_offset(drawable, pyramids)),
        burst_bytes_(burst_bytes),
        out_(out) {}

  void run() { test(groups_.levels.size() - 1, 0, groups_.levels.back().size()); }

 private:
  // Boxes [first, end) of a level, which lie together.
  void test(std::size_t level, std::size_t first, std::size_t end) {
    const std::vector<PatchGroups::Box>& boxes = groups_.levels[level];
    out_.bytes += memory::burst_bytes(0, kPatchGroupHeaderBytes + (end - first) * kPatchGroupBoxBytes, burst_bytes_);
    for (std::size_t b = first; b < end; ++b) {
      ++out_.counters.groups_tested;
      if (outside_view(box_body(frame_, drawable_, group_box(boxes[b], offset_)), frame_)) {
        ++out_.counters.groups_culled;
        const PatchRun patches = patches_of(level, b);
        out_.counters.patches_culled += patches.end - patches.first;
      } else if (level > 0) {
        const std::size_t below = b * kPatchesPerGroup;
        test(level - 1, below, std::min(below + kPatchesPerGroup, groups_.levels[level - 1].size()));
      } else {
        append(patches_of(0, b), out_.read);
      }
    }
  }

  PatchRun patches_of(std::size_t level, std::size_t box) const {
    std::uint64_t span = kPatchesPerGroup;
    for (std::size_t k = 0; k < level; ++k) span *= kPatchesPerGroup;
    const std::uint64_t count = drawable_.drawable->patch_count;
    const auto at = [&](std::uint64_t patch) {
      return drawable_.drawable->first_patch + static_cast<std::uint32_t>(std::min(patch, count));
    };
    return {at(box * span), at((box + 1) * span)};
  }

  const scene::FrameGeometry& frame_;
  const scene::PosedDrawable& drawable_;
  const PatchGroups& groups_;
  double offset_;
  std::uint64_t burst_bytes_;
  Walked& out_;
};

}  // namespace

const PatchGroups* resting_groups(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable) {
  const scene::Drawable& drawn = *drawable.drawable;
  if (drawable.procedure != nullptr || drawable.deforming ||
      drawable.positions[0].data() != drawable.primitive->vertices.positions.data())
    return nullptr;
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
                          const PyramidLibrary& pyramids, const FrontEndSpec& spec) {
  std::vector<std::uint32_t> grouped;
  for (const std::uint32_t d : drawables)
    if (resting_groups(frame, frame.drawables[d]) != nullptr) grouped.push_back(d);
  std::vector<Walked> walked(grouped.size());
  parallel_for(grouped.size(), [&](std::size_t k) {
    const scene::PosedDrawable& drawable = frame.drawables[grouped[k]];
    GroupWalk(frame, drawable, *resting_groups(frame, drawable), pyramids, spec.burst_bytes, walked[k]).run();
  });
  PatchCulling all;
  std::uint64_t bytes = 0;
  std::size_t next = 0;
  for (const std::uint32_t d : drawables) {
    if (next == grouped.size() || grouped[next] != d) {
      const scene::Drawable& drawn = *frame.drawables[d].drawable;
      append({drawn.first_patch, drawn.first_patch + drawn.patch_count}, all.read);
      continue;
    }
    for (const PatchRun& run : walked[next].read) append(run, all.read);
    merge(all.counters, walked[next].counters);
    bytes += walked[next].bytes;
    ++next;
  }
  all.ledger.read(memory::Unit::kFrontend, memory::Purpose::kPatchData, bytes);
  return all;
}

}  // namespace tessera::frontend

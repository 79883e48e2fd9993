#include "binner/binner.h"

#include <algorithm>

#include "base/parallel.h"

namespace tessera::binner {
namespace {

// Whether the sub-patch moves for the tile core, whose kernels do not move a sub-patch that the front end found at
// rest.
bool moves(const scene::FrameGeometry& frame, const frontend::BoundedSubPatch& sub_patch) {
  return (sub_patch.effects & frontend::kEffectMotion) != 0 && frame.drawable_of(sub_patch.base_patch).moving;
}

// `frame`: the frame of the segment by which the sub-patch moves.
ListEntry make_entry(const scene::FrameGeometry& frame, const frontend::BoundedSubPatch& sub_patch) {
  const scene::PosedDrawable& drawable = frame.drawable_of(sub_patch.base_patch);
  ListEntry entry;
  entry.base_patch = sub_patch.base_patch;
  entry.segment = sub_patch.segment;
  entry.range = sub_patch.range;
  entry.whole = sub_patch.range == scene::patch_cells(frame, sub_patch.base_patch);
  entry.near_depth = sub_patch.bounds.near_z;
  entry.blocks = BlockRange::of(sub_patch.bounds);
  entry.flags = 0;
  const auto flag = [&](bool on, ListEntry::Flag which) { entry.flags |= on ? which : 0; };
  flag(moves(frame, sub_patch), ListEntry::kMoving);
  flag((sub_patch.effects & frontend::kEffectDefocus) != 0 && frame.projection.lens_scale != 0, ListEntry::kDefocused);
  flag((sub_patch.effects & frontend::kEffectDisplacement) != 0 && drawable.material->displacement.has_value(),
       ListEntry::kDisplaced);
  flag(
      (sub_patch.effects & frontend::kEffectAlphaTest) != 0 && drawable.material->alpha_mode == scene::AlphaMode::kMask,
      ListEntry::kAlphaMask);
  flag(drawable.material->alpha_mode == scene::AlphaMode::kBlend, ListEntry::kBlended);
  return entry;
}

}  // namespace

void Binner::count(const Placed& placed) {
  BinnerCounters& counters = buffer_.counters();
  counters.tile_overlaps += placed.covered;
  counters.tiles_dropped += placed.dropped;
}

void Binner::compute_coverage_batch(const scene::FrameGeometry& frame,
                                    std::span<const frontend::BoundedSubPatch> sub_patches, std::size_t first) {
  constexpr std::size_t kBlock = 64;
  ahead_first_ = first;
  ahead_.resize(std::min(kAhead, sub_patches.size() - first));
  parallel_for((ahead_.size() + kBlock - 1) / kBlock, [&](std::size_t block) {
    TileCoverageUnit unit = coverage_;
    for (std::size_t i = block * kBlock; i < std::min(ahead_.size(), (block + 1) * kBlock); ++i) {
      const frontend::BoundedSubPatch& sub_patch = sub_patches[first + i];
      const scene::FrameGeometry& posed = frame.segment(sub_patch.segment);
      const TileCoverage& coverage =
          unit.cover({sub_patch.bounds, sub_patch.corners(frame)}, moves(posed, sub_patch), grid_);
      hierarchy_.place(coverage, frontend::patch_record_bytes(posed, sub_patch.base_patch), ahead_[i].placements);
      ahead_[i].covered = coverage.covered;
      ahead_[i].dropped = coverage.dropped_exact + coverage.dropped_time;
    }
  });
}

bool Binner::run(const scene::FrameGeometry& frame, std::span<const frontend::BoundedSubPatch> sub_patches,
                 Cursor& cursor) {
  if (cursor.sub_patch == 0 && cursor.entry == 0) ahead_.clear();
  for (; cursor.sub_patch < sub_patches.size(); ++cursor.sub_patch, cursor.entry = 0) {
    if (cursor.sub_patch < ahead_first_ || cursor.sub_patch >= ahead_first_ + ahead_.size())
      compute_coverage_batch(frame, sub_patches, cursor.sub_patch);
    const Placed& placed = ahead_[cursor.sub_patch - ahead_first_];
    const frontend::BoundedSubPatch& sub_patch = sub_patches[cursor.sub_patch];
    const bool begun = cursor.entry > 0;  // before a partial render: its tiles are counted
    const bool all =
        buffer_.append(make_entry(frame.segment(sub_patch.segment), sub_patch), placed.placements, cursor.entry);
    if (!all) {
      buffer_.finish();
      if (!begun && cursor.entry > 0) count(placed);
      return false;
    }
    if (!begun) count(placed);
  }
  buffer_.finish();
  return true;
}

std::vector<ListEntry> Binner::read_tile(const scene::FrameGeometry& frame, TileIndex tile, memory::Ledger& ledger,
                                         std::uint64_t& bytes_read) const {
  std::vector<ListEntry> entries;
  hierarchy_.for_each_queue_of(tile, [&](QueueIndex queue) { buffer_.read_queue(queue, entries, ledger, bytes_read); });
  for (ListEntry& entry : entries)
    if (entry.whole) entry.range = scene::patch_cells(frame.segment(entry.segment), entry.base_patch);
  return entries;
}

}  // namespace tessera::binner

#include "binner/binner.h"

namespace tessera::binner {
namespace {

QueueEntry make_entry(const frontend::FrameGeometry& frame, const frontend::BoundedSubPatch& sub_patch) {
  const frontend::PosedDrawable& drawable = frame.drawable_of(sub_patch.base_patch);
  QueueEntry entry;
  entry.base_patch = sub_patch.base_patch;
  entry.range = sub_patch.range;
  entry.near_depth = sub_patch.bounds.near_z;
  entry.far_depth = sub_patch.bounds.far_z;
  if (drawable.moving) entry.flags |= QueueEntry::kMoving;
  if (sub_patch.bounds.crosses_near) entry.flags |= QueueEntry::kCrossesNear;
  if (drawable.material->alpha_mode == frontend::AlphaMode::kMask) entry.flags |= QueueEntry::kAlphaMask;
  if (drawable.material->alpha_mode == frontend::AlphaMode::kBlend) entry.flags |= QueueEntry::kBlended;
  return entry;
}

}  // namespace

void Binner::count(const TileCoverage& coverage) {
  BinnerCounters& counters = buffer_.counters();
  counters.tile_overlaps += coverage.covered;
  counters.tiles_dropped_exact += coverage.dropped_exact;
  counters.tiles_dropped_time += coverage.dropped_time;
}

bool Binner::run(const frontend::FrameGeometry& frame, std::span<const frontend::BoundedSubPatch> sub_patches, Cursor& cursor) {
  for (; cursor.sub_patch < sub_patches.size(); ++cursor.sub_patch, cursor.entry = 0) {
    const frontend::BoundedSubPatch& sub_patch = sub_patches[cursor.sub_patch];
    QueueEntry entry = make_entry(frame, sub_patch);
    const TileCoverage& coverage = coverage_.cover(sub_patch, (entry.flags & QueueEntry::kMoving) != 0, grid_);
    hierarchy_.place(coverage, frontend::patch_record_bytes(frame, sub_patch.base_patch), placements_);
    const bool begun = cursor.entry > 0;  // before a partial render: its tiles are counted
    for (; cursor.entry < placements_.size(); ++cursor.entry) {
      const QueueHierarchy::Placement& placement = placements_[cursor.entry];
      entry.t0 = static_cast<std::uint8_t>(placement.times.first);
      entry.t1 = static_cast<std::uint8_t>(placement.times.last);
      if (!buffer_.append(placement.queue, entry)) {
        buffer_.finish();
        if (!begun && cursor.entry > 0) count(coverage);
        return false;
      }
      buffer_.counters().interval_codes += static_cast<std::uint64_t>(placement.times.codes());
      if (placement.queue >= grid_.tile_count()) ++buffer_.counters().group_entries;
    }
    if (!begun) count(coverage);
  }
  buffer_.finish();
  return true;
}

std::vector<QueueEntry> Binner::read_tile(TileIndex tile, hardware::Ledger& ledger, std::uint64_t& bytes_read) const {
  std::vector<QueueEntry> entries;
  hierarchy_.for_each_queue_of(tile, [&](QueueIndex queue) { buffer_.read_queue(queue, entries, ledger, bytes_read); });
  return entries;
}

}  // namespace tessera::binner

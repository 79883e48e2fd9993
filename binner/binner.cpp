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

bool Binner::run(const frontend::FrameGeometry& frame, std::span<const frontend::BoundedSubPatch> sub_patches, Cursor& cursor) {
  for (; cursor.sub_patch < sub_patches.size(); ++cursor.sub_patch, cursor.tile = 0) {
    const frontend::BoundedSubPatch& sub_patch = sub_patches[cursor.sub_patch];
    const IntRect tiles = grid_.covered(sub_patch.bounds);
    if (tiles.empty()) continue;
    const auto count = static_cast<std::uint32_t>(tiles.width() * tiles.height());
    if (cursor.tile == 0) buffer_.counters().tile_overlaps += count;
    const QueueEntry entry = make_entry(frame, sub_patch);
    for (; cursor.tile < count; ++cursor.tile) {
      const int column = tiles.x0 + static_cast<int>(cursor.tile) % tiles.width(), row = tiles.y0 + static_cast<int>(cursor.tile) / tiles.width();
      if (buffer_.append(grid_.index(column, row), entry)) continue;
      buffer_.finish();
      // A sub-patch whose first tile was refused is counted when it is begun again.
      if (cursor.tile == 0) buffer_.counters().tile_overlaps -= count;
      return false;
    }
  }
  buffer_.finish();
  return true;
}

}  // namespace tessera::binner

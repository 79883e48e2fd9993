#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "scene/tessellation_pattern.h"

namespace tessera::binner {

// What a tile core needs to fetch, order and cull a sub-patch without touching the patch: the sub-patch's record in the
// table, and from the tile's list when it may touch the tile.
struct QueueEntry {
  enum Flag : std::uint8_t { kMoving = 1, kAlphaMask = 2, kBlended = 4, kDefocused = 8, kDisplaced = 16 };
  // Of an entry that nobody looked at: the tile core leaves out only what the scene has not.
  static constexpr std::uint8_t kEveryEffect = kMoving | kAlphaMask | kBlended | kDefocused | kDisplaced;

  std::uint32_t base_patch = 0;
  scene::CellRange range;
  float near_depth = 0;
  std::uint8_t t0 = 0, t1 = 255;
  std::uint8_t flags = kEveryEffect;
  std::uint8_t segment = 0;  // FrameGeometry::segment()
  std::uint32_t record = 0;  // number in the sub-patch table
};

// A record of the sub-patch table. 16 bytes in memory, little endian, as binner/README.md has them in a table, which a
// test reads:
//
//   bytes   field        form
//   0..3    base_patch   u32
//   4..7    range        i0, j0, i1, j1: 7 bits each from bit 0 on, then 4 zero bits
//   8..11   near_depth   float; 0 for what is not positive
//   12      flags        kMoving ...: the effects that the sub-patch's kernels need
//   13      segment      of motion by which it moves, times being 1/256 of that; 0: of the whole shutter
//   14..15  lists        that it was put into: 65535 stands for as many and more
inline constexpr std::size_t kRecordBytes = 16, kRecordListsAt = 14;
using RecordBytes = std::array<std::uint8_t, kRecordBytes>;

// Times and number are not in the record. A range beyond 7 bits is a broken invariant.
RecordBytes pack_record(const QueueEntry& sub_patch, std::uint64_t lists);
QueueEntry unpack_record(std::span<const std::uint8_t, kRecordBytes> bytes);
// Lists that a record of the table says it was put into.
std::uint16_t lists_of_record(std::span<const std::uint8_t, kRecordBytes> bytes);
std::array<std::uint8_t, 2> pack_lists(std::uint64_t lists);

}  // namespace tessera::binner

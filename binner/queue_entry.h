#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "scene/tessellation_pattern.h"

namespace tessera::binner {

// What a tile core needs to fetch, order and cull a sub-patch without touching the patch. 16 bytes in memory, little
// endian:
//
//   bytes   field        form
//   0..3    base_patch   u32
//   4..7    range        i0, j0, i1, j1: 7 bits each from bit 0 on, then 4 zero bits
//   8..9    near_depth   upper half of the float, rounded towards the camera
//   10..11  far_depth    upper half of the float, rounded away
//   12      t0           first 1/256 of the shutter in which the sub-patch may touch the tile
//   13      t1           last one
//   14      flags        kMoving ...: the effects that the sub-patch's kernels need, and what bounds found
//   15      segment      of motion by which it moves, t0 and t1 being 1/256 of that; 0: of the whole shutter
struct QueueEntry {
  enum Flag : std::uint8_t {
    kMoving = 1,
    kCrossesNear = 2,
    kAlphaMask = 4,
    kBlended = 8,
    kDefocused = 16,
    kDisplaced = 32
  };
  // Of an entry that nobody looked at: the tile core leaves out only what the scene has not.
  static constexpr std::uint8_t kEveryEffect = kMoving | kAlphaMask | kBlended | kDefocused | kDisplaced;

  std::uint32_t base_patch = 0;
  scene::CellRange range;
  float near_depth = 0, far_depth = 0;  // unpacked: never nearer / farther than what was packed
  std::uint8_t t0 = 0, t1 = 255;
  std::uint8_t flags = kEveryEffect;
  std::uint8_t segment = 0;  // FrameGeometry::segment()
};

inline constexpr std::size_t kQueueEntryBytes = 16;

// Depths must not be negative. A range beyond 7 bits is a broken invariant.
std::array<std::uint8_t, kQueueEntryBytes> pack(const QueueEntry& entry);
QueueEntry unpack(std::span<const std::uint8_t, kQueueEntryBytes> bytes);

}  // namespace tessera::binner

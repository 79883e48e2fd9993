#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "scene/tessellation_pattern.h"

namespace tessera::binner {

// What a tile core needs to fetch, order and cull a sub-patch without touching the patch: the sub-patch's record in the
// table, and from the tile's list when it may touch the tile.
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
  bool whole = false;  // all cells of the patch: its record leaves the range out where its fields fit
  float near_depth = 0;
  std::uint8_t t0 = 0, t1 = 255;
  std::uint8_t flags = kEveryEffect;
  std::uint8_t segment = 0;  // FrameGeometry::segment()
  std::uint16_t lists = 0;   // that hold it; 65535 stands for as many and more
  std::uint32_t record = 0;  // number in the sub-patch table: its address there over kSlotBytes

  bool operator==(const QueueEntry&) const = default;
};

// A record of the sub-patch table, little endian, as binner/README.md has both forms in tables, which a test reads. Of a
// whole patch: 64 bits, where its fields fit.
//
//   bits    field        form
//   0..27   base_patch
//   28..43  near_depth   upper half of the float without its sign: 8 bits of exponent, 8 of mantissa, rounded nearer
//   44..51  lists
//   52..56  segment
//   57..62  flags
//   63      1
//
// Of anything else: 16 bytes, aligned to 16.
//
//   bytes   field        form
//   0..3    base_patch   u32
//   4..7    range        i0, j0, i1, j1: 7 bits each from bit 0 on, then 4 zero bits
//   8..11   near_depth   float; 0 for what is not positive
//   12      flags        kMoving ...: the effects that the sub-patch's kernels need, and what bounds found
//   13      segment      of motion by which it moves, times being 1/256 of that; 0: of the whole shutter
//   14..15  lists        that it was put into: 65535 stands for as many and more
inline constexpr std::size_t kSlotBytes = 8, kRecordBytes = 16;

struct PackedRecord {
  std::array<std::uint8_t, kRecordBytes> bytes{};
  std::size_t size = 0;  // kSlotBytes or kRecordBytes

  std::span<const std::uint8_t> used() const { return std::span(bytes).first(size); }
};

// Times and number are not in the record. A range beyond 7 bits is a broken invariant.
PackedRecord pack_record(const QueueEntry& sub_patch);
// Of the record that begins there: all of it is in `bytes`.
QueueEntry unpack_record(std::span<const std::uint8_t> bytes);
// Makes a record say that fewer lists hold it: it keeps its form.
void lower_lists(std::span<std::uint8_t> record, std::uint16_t lists);

}  // namespace tessera::binner

#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "binner/block_range.h"
#include "scene/tessellation_pattern.h"

namespace tessera::binner {

// Everything a tile core needs to fetch, order and cull a sub-patch without reading the patch: the sub-patch's record
// in the table, and the times from the tile's list.
struct ListEntry {
  enum Flag : std::uint8_t { kMoving = 1, kAlphaMask = 2, kBlended = 4, kDefocused = 8, kDisplaced = 16 };
  // The flags of an entry whose effects nothing has analysed: the tile core omits only effects that the scene lacks.
  static constexpr std::uint8_t kEveryEffect = kMoving | kAlphaMask | kBlended | kDefocused | kDisplaced;

  std::uint32_t base_patch = 0;
  scene::CellRange range;
  bool whole = false;  // all cells of the patch; the short record then omits the range
  float near_depth = 0;
  std::uint8_t t0 = 0, t1 = 255;
  std::uint8_t flags = kEveryEffect;
  std::uint16_t segment = 0;  // FrameGeometry::segment()
  std::uint16_t lists = 0;    // number of lists that hold it; kManyLists: as many or more
  BlockRange blocks;          // blocks of pixels that it may touch
  std::uint32_t record = 0;   // number in the sub-patch table: its address there over kSlotBytes

  bool operator==(const ListEntry&) const = default;
};

// A record of the sub-patch table, little endian. Tables of binner/README.md, which a test reads, describe both forms.
// The short form is 64 bits: a whole patch that moves by the whole shutter's frame and whose fields fit.
//
//   bits    field         form
//   0..23   base_patch
//   24..39  near_depth    upper half of the float without its sign: 8 bits of exponent, 8 of mantissa, rounded nearer
//   40..43  lists
//   44..48  flags
//   49..62  blocks        first column and row, 4 bits each; more columns and rows, 3 each; they are not wide
//   63      1
//
// Every other record takes 16 bytes, aligned to 16.
//
//   bytes   field         form
//   0..3    base_patch    u32
//   4..7    range         i0, j0, i1, j1: 7 bits each from bit 0 on
//           more rows     3 bits, of blocks; then a bit 0
//   8..11   near_depth    float; 0 if the depth is not positive
//   12..13  flags         5 bits, kMoving ...: the effects that the sub-patch's kernels need
//           blocks        first column and row, 4 bits each; more columns, 3
//   14..15  segment       5 bits: the motion segment, in which a time code is 1/256; 0: the whole shutter. 31:
//                         the lower 12 bits of near_depth hold the segment, the upper 20 the float, rounded nearer
//           wide          1 bit, of blocks
//           lists         10 bits: number of lists that hold it; kManyLists: as many or more
inline constexpr std::size_t kSlotBytes = 8, kRecordBytes = 16;
inline constexpr std::uint16_t kManyLists = 1023;

struct PackedRecord {
  std::array<std::uint8_t, kRecordBytes> bytes{};
  std::size_t size = 0;  // kSlotBytes or kRecordBytes

  std::span<const std::uint8_t> used() const { return std::span(bytes).first(size); }
};

// The record holds neither the times nor its own number. A field that does not fit is a broken invariant.
PackedRecord pack_record(const ListEntry& sub_patch);
// Decodes the record at the start of `bytes`, which must hold all of it.
ListEntry unpack_record(std::span<const std::uint8_t> bytes);
// Lowers the number of lists in a record; the record keeps its form.
void lower_lists(std::span<std::uint8_t> record, std::uint16_t lists);

}  // namespace tessera::binner

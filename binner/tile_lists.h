#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "base/check.h"
#include "base/round_up.h"
#include "binner/write_combiner.h"

namespace tessera::binner {

using QueueIndex = std::uint32_t;

// Lists of bytes, one for each tile or group of tiles, in chunks of a buffer that the lists' owner allocates.
//
// From address 0 on, each part rounded to bursts:
//   a bit per list, lowest first: the list has bytes. The tile scheduler reads them all before it hands out tiles.
//   a cursor of 8 bytes per list: the address of its next byte (36 bits), and a note of its writer (28 bits). Tile cores
//     do not read it.
//   a first chunk per list: its number gives its address
//   areas that the owner allocates, further chunks among them
// The last 4 bytes of a chunk are a link: address of the next one over 16, or 0. The bytes of a list run on from chunk to
// chunk. Behind the last stands a byte 0, or where the chunk ends there the link 0.
//
// Invariants (cited by the tests):
//   LI1  A list's bytes come back in the order in which they were appended, and no other list's.
//   LI2  A list ends: its codes never begin with a byte 0, or its reader knows by other means.
//   LI3  content_bytes() counts the bytes that tile cores can read, cursors and bits: each once, however often it changed.
class TileLists {
 public:
  static constexpr std::uint64_t kCursorBytes = 8, kLinkBytes = 4, kEndBytes = 1, kAddressUnit = 16;
  static constexpr int kAddressBits = 36, kNoteBits = 28;

  struct Layout {
    QueueIndex lists;
    std::uint64_t first_chunk_bytes, chunk_bytes, burst_bytes;

    std::uint64_t bit_bytes() const { return (std::uint64_t{lists} + 7) / 8; }
    std::uint64_t cursors_at() const { return round_up(bit_bytes(), burst_bytes); }
    std::uint64_t first_chunks_at() const { return cursors_at() + round_up(lists * kCursorBytes, burst_bytes); }
    // The first address of the owner's areas.
    std::uint64_t end() const { return first_chunks_at() + round_up(lists * first_chunk_bytes, burst_bytes); }
  };

  // `memory` is as long as the allocated areas. Call reset() first.
  TileLists(const Layout& layout, std::vector<std::uint8_t>& memory, WriteCombiner& combiner)
      : layout_(layout), memory_(memory), combiner_(combiner) {}
  TileLists(const TileLists&) = delete;
  TileLists& operator=(const TileLists&) = delete;

  // Empties all lists: writes their bits.
  void reset() {
    cursors_.assign(layout_.lists, {});
    std::fill_n(memory_.begin(), layout_.bit_bytes(), std::uint8_t{0});
    combiner_.write(0, layout_.bit_bytes());
    content_bytes_ += layout_.bit_bytes();
  }

  const Layout& layout() const { return layout_; }
  bool empty(QueueIndex list) const { return cursors_[list].at == 0; }
  // The writer's note; 0 in an empty list.
  std::uint32_t note(QueueIndex list) const { return cursors_[list].note; }
  std::uint64_t content_bytes() const { return content_bytes_; }

  // Number of further chunks that this many bytes need.
  std::uint64_t chunks_needed(QueueIndex list, std::uint64_t bytes) const {
    const std::uint64_t room = empty(list) ? layout_.first_chunk_bytes - kLinkBytes : cursors_[list].room;
    return bytes <= room ? 0 : (bytes - room - 1) / (layout_.chunk_bytes - kLinkBytes) + 1;
  }

  // Adds bytes to a list and sets its note. `add_chunk()` returns the address of a fresh chunk; it is called
  // chunks_needed() times. `wrote(address, bytes)` is called for bytes and links.
  template <class AddChunk, class Wrote>
  void append(QueueIndex list, std::span<const std::uint8_t> bytes, std::uint32_t note, const AddChunk& add_chunk,
              const Wrote& wrote) {
    TESSERA_CHECK(note < std::uint32_t{1} << kNoteBits, "a list's note fits its cursor");
    Cursor cursor = cursors_[list];
    begin(list, cursor);
    content_bytes_ += bytes.size();
    while (!bytes.empty()) {
      if (cursor.room == 0) {
        const std::uint64_t next = add_chunk();
        TESSERA_CHECK(next % kAddressUnit == 0 && next < std::uint64_t{1} << kAddressBits, "a chunk's address fits");
        put_link(cursor.at, next / kAddressUnit, wrote);
        content_bytes_ += kLinkBytes;
        cursor.at = next;
        cursor.room = layout_.chunk_bytes - kLinkBytes;
      }
      const std::uint64_t here = std::min<std::uint64_t>(cursor.room, bytes.size());
      put(cursor.at, bytes.first(here), wrote);
      cursor.at += here;
      cursor.room -= here;
      bytes = bytes.subspan(here);
    }
    // The next append overwrites the end.
    const auto unheard = [](std::uint64_t, std::uint64_t) {};
    constexpr std::uint8_t kEnd = 0;
    if (cursor.room > 0)
      put(cursor.at, std::span(&kEnd, 1), unheard);
    else
      put_link(cursor.at, 0, unheard);
    content_bytes_ += end_bytes(cursor);
    cursor.note = note;
    cursors_[list] = cursor;
    combiner_.write(layout_.cursors_at() + list * kCursorBytes, kCursorBytes);
  }

  // Returns a list's bytes without its end. Calls read(address, bytes) for each piece that a tile core reads: none for
  // an empty list, which the tile scheduler knows from its bit.
  template <class Read>
  std::vector<std::uint8_t> read(QueueIndex list, const Read& read) const {
    std::vector<std::uint8_t> out;
    const Cursor& end = cursors_[list];
    if (empty(list)) return out;
    std::uint64_t at = first_chunk(list), room = layout_.first_chunk_bytes - kLinkBytes;
    while (at + room != end.at + end.room) {
      read(at, room + kLinkBytes);
      out.insert(out.end(), &memory_[at], &memory_[at] + room);
      std::uint32_t link = 0;
      std::memcpy(&link, &memory_[at + room], sizeof link);
      at = std::uint64_t{link} * kAddressUnit;
      room = layout_.chunk_bytes - kLinkBytes;
    }
    read(at, end.at - at + end_bytes(end));
    out.insert(out.end(), &memory_[at], &memory_[at] + (end.at - at));
    return out;
  }

 private:
  struct Cursor {
    std::uint64_t at = 0;    // address of the next byte; 0: the list is empty
    std::uint64_t room = 0;  // bytes up to the link
    std::uint32_t note = 0;
  };
  static std::uint64_t end_bytes(const Cursor& cursor) { return cursor.room > 0 ? kEndBytes : kLinkBytes; }
  std::uint64_t first_chunk(QueueIndex list) const {
    return layout_.first_chunks_at() + list * layout_.first_chunk_bytes;
  }

  // Looks at the list's bit; then reads its cursor, or begins the list.
  void begin(QueueIndex list, Cursor& cursor) {
    combiner_.read(list / 8, 1);
    if (cursor.at != 0) {
      combiner_.read(layout_.cursors_at() + list * kCursorBytes, kCursorBytes);
      content_bytes_ -= end_bytes(cursor);  // the end moves on
      return;
    }
    memory_[list / 8] = static_cast<std::uint8_t>(memory_[list / 8] | 1u << list % 8);
    combiner_.write(list / 8, 1);
    content_bytes_ += kCursorBytes;
    cursor = {first_chunk(list), layout_.first_chunk_bytes - kLinkBytes, 0};
  }

  template <class Wrote>
  void put(std::uint64_t address, std::span<const std::uint8_t> bytes, const Wrote& wrote) {
    std::memcpy(&memory_[address], bytes.data(), bytes.size());
    combiner_.write(address, bytes.size());
    wrote(address, bytes.size());
  }
  template <class Wrote>
  void put_link(std::uint64_t address, std::uint64_t link, const Wrote& wrote) {
    std::array<std::uint8_t, kLinkBytes> bytes;
    for (std::size_t b = 0; b < kLinkBytes; ++b) bytes[b] = static_cast<std::uint8_t>(link >> (8 * b));
    put(address, bytes, wrote);
  }

  Layout layout_;
  std::vector<std::uint8_t>& memory_;
  WriteCombiner& combiner_;
  std::vector<Cursor> cursors_;
  std::uint64_t content_bytes_ = 0;
};

}  // namespace tessera::binner

#include "frontend/deferred.h"

#include "base/check.h"

namespace tessera::frontend {
namespace {

constexpr std::size_t kShortBytes = 8, kLongBytes = 16;
constexpr std::uint8_t kWholePatch = 7;  // as a level

void put64(std::uint64_t word, std::vector<std::uint8_t>& out) {
  for (int k = 0; k < 8; ++k) out.push_back(static_cast<std::uint8_t>(word >> (8 * k) & 0xFF));
}
std::uint64_t get64(std::span<const std::uint8_t> bytes) {
  std::uint64_t word = 0;
  for (std::size_t k = 0; k < 8; ++k) word |= std::uint64_t{bytes[k]} << (8 * k);
  return word;
}
std::uint64_t field(std::uint64_t word, int at, int width) { return word >> at & ((std::uint64_t{1} << width) - 1); }
template <class T>
T field_as(std::uint64_t word, int at, int width) {
  return static_cast<T>(field(word, at, width));
}

std::uint64_t first_block(const IntRect& blocks, const IntRect& grid) {
  return static_cast<std::uint64_t>(blocks.y0 - grid.y0) * static_cast<std::uint64_t>(grid.width()) +
         static_cast<std::uint64_t>(blocks.x0 - grid.x0);
}

bool short_form(const Deferred& d, const IntRect& grid) {
  const IntRect& b = d.footprint.blocks;
  const bool small = b.width() <= 8 && b.height() <= 8 && first_block(b, grid) < (1u << 14);
  const bool named = d.kind == Deferred::kGroup ? d.level < kWholePatch : d.kind == Deferred::kSubPatch && d.whole;
  return small && named && d.segment == 0 && d.number < (1u << 24);
}

Deferred unpack_short(std::uint64_t word, const IntRect& grid) {
  Deferred d;
  d.number = field_as<std::uint32_t>(word, 0, 24);
  const auto level = field_as<std::uint8_t>(word, 24, 3);
  d.kind = level == kWholePatch ? Deferred::kSubPatch : Deferred::kGroup;
  d.whole = level == kWholePatch;
  if (!d.whole) d.level = level;
  d.footprint.nearest = field_as<DepthCode>(word, 27, 16);
  const int first = field_as<int>(word, 43, 14), x0 = grid.x0 + first % grid.width(),
            y0 = grid.y0 + first / grid.width();
  d.footprint.blocks = {x0, y0, x0 + field_as<int>(word, 57, 3) + 1, y0 + field_as<int>(word, 60, 3) + 1};
  return d;
}

Deferred unpack_long(std::uint64_t first, std::uint64_t second) {
  Deferred d;
  d.number = field_as<std::uint32_t>(first, 0, 32);
  d.kind = field_as<Deferred::Kind>(first, 60, 2);
  const auto cells = [&](int at) { return field_as<std::uint8_t>(first, at, 7); };
  if (d.kind == Deferred::kGroup)
    d.level = cells(32);
  else if (d.kind == Deferred::kSubPatch)
    d.range = {cells(32), cells(39), cells(46), cells(53)}, d.whole = field(first, 32, 28) == 0;
  d.segment = static_cast<std::uint8_t>(field(first, 62, 1) << 4 | field(second, 60, 4));
  d.footprint.nearest = field_as<DepthCode>(second, 0, 16);
  const auto block = [&](int at) { return field_as<int>(second, at, 11); };
  d.footprint.blocks = {block(16), block(27), block(38) + 1, block(49) + 1};
  return d;
}

}  // namespace

void pack_deferred(const Deferred& d, const IntRect& grid, std::vector<std::uint8_t>& out) {
  const IntRect& b = d.footprint.blocks;
  TESSERA_CHECK(b.x0 >= 0 && b.y0 >= 0 && b.x0 < b.x1 && b.y0 < b.y1 && b.x1 <= kMaxGridSide && b.y1 <= kMaxGridSide,
                "blocks fit 11 bits");
  const auto wide = [](auto value) { return static_cast<std::uint64_t>(value); };
  if (short_form(d, grid)) {
    put64(wide(d.number) | wide(d.whole ? kWholePatch : d.level) << 24 | wide(d.footprint.nearest) << 27 |
              first_block(b, grid) << 43 | wide(b.width() - 1) << 57 | wide(b.height() - 1) << 60 | wide(1) << 63,
          out);
    return;
  }
  TESSERA_CHECK(d.segment < 32, "a segment fits 5 bits");
  const scene::CellRange& r = d.range;
  std::uint64_t cells = 0;
  if (d.kind == Deferred::kGroup)
    cells = d.level;
  else if (d.kind == Deferred::kSubPatch && !d.whole)
    cells = wide(r.i0) | wide(r.j0) << 7 | wide(r.i1) << 14 | wide(r.j1) << 21;
  put64(wide(d.number) | cells << 32 | wide(d.kind) << 60 | wide(d.segment >> 4) << 62, out);
  put64(wide(d.footprint.nearest) | wide(b.x0) << 16 | wide(b.y0) << 27 | wide(b.x1 - 1) << 38 | wide(b.y1 - 1) << 49 |
            wide(d.segment & 15) << 60,
        out);
}

std::vector<Deferred> unpack_deferred(std::span<const std::uint8_t> bytes, const IntRect& grid) {
  std::vector<Deferred> all;
  for (std::size_t at = 0; at < bytes.size();) {
    const std::uint64_t first = get64(bytes.subspan(at));
    const bool is_short = field(first, 63, 1) != 0;
    all.push_back(is_short ? unpack_short(first, grid) : unpack_long(first, get64(bytes.subspan(at + kShortBytes))));
    at += is_short ? kShortBytes : kLongBytes;
  }
  return all;
}

}  // namespace tessera::frontend

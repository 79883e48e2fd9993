#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>

#include "stencil_tables.h"  // generated
#include "tilecore/resolve/packed_stencil.h"

// The packed tables in the form that cubic_stencil.cpp computes with; an inner header.
namespace tessera::tilecore {

// Sorts by largest weight first, so that taps of equal weight are neighbours. Among them pairs that mirror each other
// along x come first, so that they are summed first and vertically adjacent pixels share the sum.
constexpr Stencil sorted_by_weight(Stencil s) {
  const auto comes_before = [](const StencilTap& a, const StencilTap& b) {
    if (a.weight != b.weight) return a.weight > b.weight;
    if ((a.dx == 0) != (b.dx == 0)) return b.dx == 0;
    if (a.dy != b.dy) return a.dy < b.dy;
    if (a.dx * a.dx != b.dx * b.dx) return a.dx * a.dx < b.dx * b.dx;
    return a.dx < b.dx;
  };
  std::sort(s.taps.begin(), s.taps.begin() + static_cast<std::ptrdiff_t>(s.count), comes_before);
  return s;
}

inline constexpr auto kStencils = [] {
  std::array<Stencil, generated::kStencils> all{};
  for (std::size_t i = 0; i < all.size(); ++i)
    all[i] = sorted_by_weight(unpack_stencil(generated::kPackedStencils, generated::kStencilStart[i]));
  return all;
}();

constexpr StencilIndexEntry index_entry(Reconstruction kernel, unsigned border, std::size_t table_pattern, int pixel) {
  const std::size_t row =
      (static_cast<std::size_t>(kernel) * kBorderCases + border) * kTablePatterns.size() + table_pattern;
  const std::uint16_t code = generated::kStencilIndex[row * 16 + static_cast<std::size_t>(pixel)];
  if (code == kNoStencil) return {};
  return {static_cast<std::uint16_t>(code / 8), {static_cast<std::uint8_t>(code % 8)}};
}

// A pattern as the mirror image of one that has a table.
struct MirroredPattern {
  std::size_t table_pattern;
  unsigned mirror;  // as mirrored_pixel()
};

// The pattern by its rendered pixels among (0, 0), (1, 0), (0, 1), (1, 1), bit 0 first; all patterns repeat every two
// pixels. nullopt for other patterns and for kNearest, which has no table.
constexpr std::optional<MirroredPattern> pattern_of(Reconstruction kernel, unsigned corner) {
  if (kernel == Reconstruction::kNearest) return std::nullopt;
  switch (corner) {
    case 1:
      return MirroredPattern{0, 0};
    case 2:
      return MirroredPattern{0, 1};
    case 4:
      return MirroredPattern{0, 2};
    case 8:
      return MirroredPattern{0, 3};
    case 9:
      return MirroredPattern{1, 0};
    case 6:
      return MirroredPattern{1, 1};
    default:
      return std::nullopt;
  }
}
constexpr unsigned corner_of(BlockMask pattern) { return (pattern & 3u) | (pattern >> 2 & 12u); }

constexpr StencilIndexEntry mirrored_entry(Reconstruction kernel, unsigned border, const MirroredPattern& p,
                                           int pixel) {
  StencilIndexEntry entry =
      index_entry(kernel, mirrored_border(border, p.mirror), p.table_pattern, mirrored_pixel(pixel, p.mirror));
  entry.symmetry.bits = static_cast<std::uint8_t>(entry.symmetry.bits ^ p.mirror << 1);
  return entry;
}

constexpr Stencil stencil_of(const StencilIndexEntry& entry) {
  Stencil s = kStencils[entry.stencil];
  for (std::size_t i = 0; i < s.count; ++i) s.taps[i] = entry.symmetry.apply(s.taps[i]);
  return s;
}

// Number of taps from `first` on that have its weight.
constexpr std::size_t equal_weights(const Stencil& s, std::size_t first) {
  std::size_t n = 1;
  while (first + n < s.count && s.taps[first + n].weight == s.taps[first].weight) ++n;
  return n;
}

}  // namespace tessera::tilecore

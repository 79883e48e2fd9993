#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "base/enum_words.h"
#include "base/rect.h"
#include "binner/tile_grid.h"

namespace tessera::tilecore {

enum class TileSequence : std::uint8_t { kRows, kStrips, kMorton, kHilbert };

// The order in which the machine gives the tiles of a grid to its cores: row by row; in strips eight tiles high, column
// by column; or along a curve that keeps neighbours in the plane close in time: Morton's Z or Hilbert's curve.
//
// A tile's *place* rises along the order; some places may be empty.
//
// Invariants (cited by the tests):
//   OT1  tiles() holds every tile of the grid once, by rising place.
//   OT2  next() equals the result of a search of all tiles of the rectangle.
class TileOrder {
 public:
  static constexpr int kStripRows = 8;
  static constexpr std::uint32_t kNever = ~std::uint32_t{0};

  TileOrder(TileSequence sequence, const binner::TileGrid& grid);

  std::uint32_t place(binner::TileIndex tile) const;
  const std::vector<binner::TileIndex>& tiles() const { return tiles_; }

  // The first place from `from` on of a tile in these columns and rows; kNever when there is none. Hardware finds it
  // from the bits of a place alone (Tropf and Herzog 1981).
  std::uint32_t next(const IntRect& tiles, std::uint32_t from) const;

 private:
  bool along_curve_;
  std::uint8_t curve_;
  int strip_rows_;
  int columns_;
  std::uint32_t square_ = 1;  // side of the square that a curve fills
  std::vector<binner::TileIndex> tiles_;
};

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr auto kEnumWords<tilecore::TileSequence> = std::to_array<std::string_view>({"rows", "strips", "morton",
                                                                                            "hilbert"});

}  // namespace tessera

#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "baselines/baseline_counters.h"
#include "baselines/tessellated_patch.h"
#include "binner/tile_grid.h"
#include "frontend/bounds/screen_bounds.h"
#include "scene/view.h"

namespace tessera::baselines {

// Result of culling for one triangle.
enum class TriangleFate : std::uint8_t { kKept, kZeroArea, kBackface, kFrustum };

// Counts one triangle in the counter of its fate.
void count(TriangleFate fate, BaselineCounters& counters);

// The triangles of a patch that culling leaves, with the tiles that they may touch.
struct TriangleList {
  struct Triangle {
    std::array<std::uint32_t, 3> vertex;
    std::uint32_t number;     // number in TessellatedPatch::triangles
    std::uint32_t tiles_end;  // end of its range in `tiles`, which begins at the end of the triangle before
  };
  std::vector<Triangle> triangles;
  std::vector<binner::TileIndex> tiles;
  std::vector<std::uint32_t> group_ends;  // as TessellatedPatch::group_ends, in `triangles`
  std::vector<TriangleFate> fates;        // of TessellatedPatch::triangles
};

// Culls triangles and finds their tiles as the fixed-function stages after the domain shader do, with motion and defocus.
//
// Rules:
//   TS1  Extent: a triangle may be drawn within `grow` pixels of the hull of its vertices at both motion keys (vertices move
//        straight), where `grow` is the largest circle of confusion of a vertex at a key. Its tiles are found as for
//        sub-patches: closed rectangle, then edges.
//   TS2  Outside: it touches no pixel of a drawn tile, or lies completely beyond the depth range.
//   TS3  Facing: the area is linear in each vertex's own progress from key to key and in its own shift by the lens. So its
//        sign is the common sign of the eight combinations of keys if all of them exceed the largest change by the lens.
//   TS4  A triangle with a vertex that is not projected keeps the rectangle of its part in front of the near plane, and both
//        sides.
class TriangleSetup {
 public:
  // `drawn`: the tiles that are drawn; empty: all.
  TriangleSetup(const binner::TileGrid& grid, const scene::Projection& projection, std::vector<bool> drawn = {})
      : grid_(grid), projection_(projection), drawn_(std::move(drawn)) {}

  // Thread-safe, like extent().
  TriangleList run(const TessellatedPatch& patch, BaselineCounters& counters) const;

  // The rectangle in which triangles of these vertices may be drawn (TS1), and their least depth; empty if one of them is not projected.
  std::optional<frontend::ScreenBounds> extent(const TessellatedPatch& patch,
                                               std::span<const std::uint32_t> vertices) const;

 private:
  struct Corners;
  // Signed circle of confusion of a vertex at a depth, in pixels.
  double circle_of_confusion(double z) const;
  Corners corners_of(const TessellatedPatch& patch, const std::array<std::uint32_t, 3>& vertex) const;
  int facing(const Corners& corners) const;
  bool outside_region(const frontend::ScreenBounds& bounds) const;
  void add(int column, int row, std::vector<binner::TileIndex>& tiles) const {
    const binner::TileIndex tile = grid_.index(column, row);
    if (drawn_.empty() || drawn_[tile]) tiles.push_back(tile);
  }
  void cover(const Corners& corners, std::vector<binner::TileIndex>& tiles) const;
  bool covers_clipped(const TessellatedPatch& patch, const std::array<std::uint32_t, 3>& vertex,
                      std::vector<binner::TileIndex>& tiles) const;

  const binner::TileGrid& grid_;
  const scene::Projection& projection_;
  std::vector<bool> drawn_;
};

}  // namespace tessera::baselines

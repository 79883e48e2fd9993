#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "baselines/baseline_counters.h"
#include "baselines/tessellated_patch.h"
#include "binner/tile_grid.h"
#include "frontend/bounds/screen_bounds.h"
#include "scene/view.h"

namespace tessera::baselines {

// Culling decides this of a triangle.
enum class TriangleFate : std::uint8_t { kKept, kZeroArea, kBackface, kFrustum };

// Counts one in the counter of its fate.
void count(TriangleFate fate, BaselineCounters& counters);

// The triangles of a patch that culling leaves, with the tiles that they may touch.
struct TriangleList {
  struct Triangle {
    std::array<std::uint32_t, 3> vertex;
    std::uint32_t number;     // in TessellatedPatch::triangles
    std::uint32_t tiles_end;  // in `tiles`; they begin where those of the triangle before end
  };
  std::vector<Triangle> triangles;
  std::vector<binner::TileIndex> tiles;
  std::vector<std::uint32_t> group_ends;  // as TessellatedPatch::group_ends, in `triangles`
  std::vector<TriangleFate> fates;        // of TessellatedPatch::triangles
};

// Culls and covers triangles as the fixed-function stages after the domain shader do, for motion and defocus too.
//
// Rules:
//   TS1  Where a triangle may be drawn: within `grow` pixels of the hull of its vertices at both motion keys (vertices move
//        straight), grow being the largest circle of confusion of a vertex at a key. Its tiles are found as those of
//        sub-patches: closed rectangle, then edges.
//   TS2  Outside: no pixel of a tile that is drawn, or all of it beyond the depth range.
//   TS3  Facing: the area is linear in each vertex's own progress from key to key and in its own shift by the lens, so
//        its sign is that of the eight combinations of keys when all of them exceed what the lens can change.
//   TS4  Triangles with a vertex that is not projected keep the rectangle of what lies in front of the near plane, and
//        both sides.
class TriangleSetup {
 public:
  TriangleSetup(const binner::TileGrid& grid, const scene::Projection& projection)
      : grid_(grid), projection_(projection) {}

  // Thread-safe, as extent() is.
  TriangleList run(const TessellatedPatch& patch, BaselineCounters& counters) const;

  // The rectangle in which triangles of these vertices may be drawn (TS1), and their least depth; nothing where one of
  // them is not projected.
  std::optional<frontend::ScreenBounds> extent(const TessellatedPatch& patch,
                                               std::span<const std::uint32_t> vertices) const;

 private:
  struct Corners;
  // Signed circle of confusion of a vertex at a depth, in pixels.
  double circle_of_confusion(double z) const;
  Corners corners_of(const TessellatedPatch& patch, const std::array<std::uint32_t, 3>& vertex) const;
  int facing(const Corners& corners) const;
  bool outside_region(const frontend::ScreenBounds& bounds) const;
  void cover(const Corners& corners, std::vector<binner::TileIndex>& tiles) const;
  bool covers_clipped(const TessellatedPatch& patch, const std::array<std::uint32_t, 3>& vertex,
                      std::vector<binner::TileIndex>& tiles) const;

  const binner::TileGrid& grid_;
  const scene::Projection& projection_;
};

}  // namespace tessera::baselines

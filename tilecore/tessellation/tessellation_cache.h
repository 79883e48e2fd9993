#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <set>
#include <span>
#include <string_view>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include "base/counter.h"
#include "binner/tile_grid.h"
#include "scene/tessellation_pattern.h"
#include "tilecore/tessellation/vertex_groups.h"
#include "tilecore/tile_order.h"

namespace tessera::tilecore {

struct SubPatchName {
  std::uint32_t patch = 0;
  std::uint16_t segment = 0;  // of motion
  scene::CellRange range;
  bool operator==(const SubPatchName&) const = default;

  struct Hash {
    std::size_t operator()(const SubPatchName& name) const;
  };
};

// A sub-patch that a tile asked the tessellator for.
struct TessellationRequest : SubPatchName {
  std::uint32_t vertices = 0, triangles = 0;
  bool moving = false;
  bool deforming = false;  // the vertices themselves differ between the motion keys
  // Effects that the kernels of this sub-patch were compiled for.
  bool displaced = false, defocused = false, alpha_tested = false, blended = false;
  std::uint16_t uses = 0;  // lists of tiles that hold it, in the round that the tile is rendered in
  std::shared_ptr<const std::vector<VertexGroup>> groups;
};

struct TessellationCounters {
  std::uint64_t requests = 0;
  std::uint64_t sub_patches = 0;
  std::uint64_t domain_evaluations = 0;
  std::uint64_t compulsory_evaluations = 0;
  std::uint64_t vertex_transforms = 0;
  std::uint64_t group_tests = 0;
  std::uint64_t triangles = 0;
};

// The on-chip memory that keeps vertices for later tiles, in front of the tessellator; all tile cores share it.
// Configured by tessellator.cache_bytes, tilecore.tile_order.
//
//   request -> groups of the sub-patch that the tile touches -> vertices on chip: read, transformed to both motion keys
//              all of them while its outline is not on chip  -> not: fetch the patch, shade them, keep them
//
// Vertices are kept by groups (VertexGroup), in object space, 12 bytes each. A rigid drawable's are kept once, whatever
// its motion; a deforming one has a line for each motion key, and consecutive segments of motion share the key between
// them. The *outline* of a sub-patch is kept beside them: for each of its groups the rectangle of tiles that the group
// may touch, hulls of the leaf boxes. Outlines outlive their vertices, in up to an eighth of the memory.
//
// The first to be evicted is a sub-patch that no list names any more, then the one whose next use, by the order of
// tiles and the rectangles, is farthest away, or never comes (Belady 1966); among equals the least recently used. The
// binner counts the lists that hold a sub-patch; uses are counted down while its outline is on chip. A sub-patch that
// would be evicted first itself is not kept at all.
//
// Requests come in emulated order, tile by tile, independent of the host's order.
//
// Invariants (cited by the tests):
//   TC1  compulsory_evaluations <= domain_evaluations <= the vertices of all requests.
//   TC2  Capacity 0 evaluates all vertices of all requests, unlimited capacity the compulsory ones.
//   TC3  bytes_in_use() <= capacity.
//   TC4  A vertex that a leaf touching the tile needs is on chip or evaluated for the tile.
class TessellationCache {
 public:
  static constexpr std::uint64_t kPositionBytes = 12;  // of a vertex on chip, per key if it deforms
  // Bytes of the rectangle of a group's tiles: four numbers of 8 bits if the grid has at most 256 columns and rows,
  // else of 16.
  static std::uint64_t rectangle_bytes(const binner::TileGrid& grid) {
    return grid.columns() <= 256 && grid.rows() <= 256 ? 4 : 8;
  }

  TessellationCache(std::uint64_t capacity_bytes, const binner::TileGrid& grid, const TileOrder& order)
      : capacity_(capacity_bytes), rectangle_bytes_(rectangle_bytes(grid)), grid_(grid), order_(order) {}

  // Uses a tile's requests, in its core's order. `hidden`: sub-patches of its list that the core dropped.
  void use(binner::TileIndex tile, std::span<const TessellationRequest> requests,
           std::span<const SubPatchName> hidden = {});

  std::uint64_t bytes_in_use() const { return bytes_; }
  const TessellationCounters& counters() const { return counters_; }

 private:
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};
  static constexpr std::uint64_t kOutlineShare = 8;
  static constexpr std::uint16_t kLastKey = 65535;  // the key at the end of the whole shutter

  // Vertices of one group at one key.
  struct Line {
    std::uint64_t valid = 0, ever = 0;  // on chip; evaluated at any time: a bit each
    std::uint64_t bytes = 0;
    std::uint64_t rank = 0, used = 0;  // order of eviction: lowest rank first, then lowest `used`
    bool on_chip = false;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> users;  // sub-patches that use it, and their parts
  };
  // A sub-patch's share of a group.
  struct Part {
    std::uint64_t vertices = 0;
    IntRect tiles;               // columns and rows
    std::uint32_t next_use = 0;  // place of a tile; no later than the tile that requests it next
    std::array<std::uint32_t, 2> lines{kNone, kNone};
  };
  struct SubPatch {
    std::vector<Part> parts;
    std::uint32_t lines_on_chip = 0;
    std::uint32_t uses_left = 0;
    std::uint64_t used = 0;  // time of the last use
    bool known = false;      // the outline is on chip
  };
  void begin_tile(binner::TileIndex tile);
  void use_one(const TessellationRequest& request);
  std::uint32_t sub_patch_of(const TessellationRequest& request);
  IntRect tiles_of(const IntRect& pixels) const;
  std::uint32_t line_of(std::uint32_t patch, std::uint32_t group, std::uint8_t key, std::uint64_t bytes);
  // Returns the vertices of the part that must be evaluated, a bit each. Afterwards they and the present ones are on
  // chip, as far as there is room.
  std::uint64_t use_line(std::uint32_t line, std::uint32_t sub_patch, std::uint32_t part);
  bool make_room(std::uint32_t line, std::uint32_t sub_patch);
  // Whether the part of a line that is not on chip is worth less than all lines that would have to leave for it.
  bool passes_by(const Line& line, std::uint32_t sub_patch, std::uint32_t part) const;
  void keep_outline(std::uint32_t sub_patch);
  std::uint64_t outline_bytes(const SubPatch& sub_patch) const { return sub_patch.parts.size() * rectangle_bytes_; }
  void evict(std::uint32_t line);
  void forget(std::uint32_t sub_patch);
  // Insert or remove a line in the order of eviction, and the outline of a sub-patch that has no line.
  void file(std::uint32_t line);
  void unfile(std::uint32_t line);
  void file_outline(std::uint32_t sub_patch);
  void unfile_outline(std::uint32_t sub_patch);
  std::uint64_t rank_of(std::uint32_t sub_patch, const Part& part) const;
  void end_use(std::uint32_t sub_patch);

  std::uint64_t capacity_, rectangle_bytes_, bytes_ = 0;
  const binner::TileGrid& grid_;
  const TileOrder& order_;
  binner::TileIndex tile_ = 0;
  std::uint32_t now_ = 0;  // place of the tile
  std::uint64_t uses_ = 0;
  std::unordered_map<SubPatchName, std::uint32_t, SubPatchName::Hash> numbers_;
  std::vector<SubPatch> sub_patches_;
  std::unordered_map<std::uint64_t, std::uint32_t> line_numbers_;
  std::vector<Line> lines_;
  std::set<std::tuple<std::uint64_t, std::uint64_t, std::uint32_t>> leaving_;  // rank, used, line
  std::set<std::pair<std::uint64_t, std::uint32_t>> leaving_outlines_;         // used, sub-patch, if it has no lines
  std::uint64_t outline_bytes_ = 0;                                            // of outlines without lines
  TessellationCounters counters_;
};

}  // namespace tessera::tilecore

namespace tessera {

template <>
inline constexpr auto kCounterFields<tilecore::TessellationCounters> = std::to_array<
    CounterField<tilecore::TessellationCounters>>({
    {"tilecore.tessellation_requests", &tilecore::TessellationCounters::requests, Combine::kSum, "sub-patches",
     "Sub-patches that tiles requested. A sub-patch that several tiles need counts once for each.", ""},
    {"tilecore.tessellated_sub_patches", &tilecore::TessellationCounters::sub_patches, Combine::kSum, "sub-patches",
     "Requests for which vertices were evaluated, all or some of the sub-patch's. For the others the on-chip cache "
     "(tessellator.cache_bytes) held all vertices that the tile needs.",
     "Apple and Adreno: parameter or vertex cache misses (of triangles, there)"},
    {"tilecore.domain_evaluations", &tilecore::TessellationCounters::domain_evaluations, Combine::kSum, "vertices",
     "Vertices computed by the domain shader, repeated ones included; both motion keys of the shutter count once.",
     "Vulkan tessellation evaluation invocations; Apple postTessellationVertex"},
    {"tilecore.compulsory_evaluations", &tilecore::TessellationCounters::compulsory_evaluations, Combine::kSum,
     "vertices",
     "Different vertices of the sub-patches that tiles requested: an unlimited cache would evaluate these. Both motion "
     "keys count once.",
     ""},
    {"tilecore.vertex_transforms", &tilecore::TessellationCounters::vertex_transforms, Combine::kSum, "vertices",
     "Vertices of moving objects read from the on-chip cache, where they lie in object space, and put through the "
     "transforms of both motion keys again.",
     ""},
    {"tilecore.group_tests", &tilecore::TessellationCounters::group_tests, Combine::kSum, "tests",
     "Rectangles of tiles of groups of 8x8 vertices on chip that were compared with the tile; they take the time of "
     "box tests.",
     ""},
    {"tilecore.triangles", &tilecore::TessellationCounters::triangles, Combine::kSum, "triangles",
     "Triangles made by the tessellator, degenerate ones left out.", "MaliGeomVisiblePrim"},
});
TESSERA_COUNTERS_COVER(tilecore::TessellationCounters);

}  // namespace tessera

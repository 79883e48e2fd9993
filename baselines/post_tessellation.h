#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "baselines/baseline_counters.h"
#include "baselines/block_code.h"
#include "baselines/draw_vertices.h"
#include "baselines/tessellated_patch.h"
#include "baselines/tile_reference.h"
#include "baselines/triangle_buffer.h"
#include "baselines/triangle_setup.h"

namespace tessera::baselines {

// Bytes of a position at each motion key: x, y, depth and w as floats [spec: gl_Position]. Attributes, which
// frontend::vertex_components() counts, take 4 bytes a component, or 2 with shading.attributes=half.
inline constexpr std::uint64_t kPositionBytes = 16;

// Head of a block: state (4), vertices (1), triangles (1), bytes of the indices (2: bits 0..12) with flags: bit 13 the
// block has places, 14 indices are grids, else a strip, 15 the block moves. Then the indices, filled up to a multiple of 4;
// the places, filled up as well; and the block's own vertices:
//   each in every block    vertex by vertex: position, second position if it moves, attributes
//   once for each draw     positions, the last one first, each followed by the second one if they move; attributes
// The state gives the number of attributes. Places (block_code.h) tell which vertices lie with earlier blocks; without them
// all vertices are the block's own.
inline constexpr std::uint64_t kBlockHeadBytes = 8;

// Storage of vertices.
enum class VertexStorage : std::uint8_t {
  // Every block holds a whole copy of each vertex that it uses.
  kEachBlock,
  // The first block of a draw that uses a vertex holds it, for all blocks of the draw. The machine shades all positions
  // first, then the attributes of triangles that survive culling; a tile fetches the attributes of its visible triangles.
  kEachDraw
};

// The binner of a conventional tile-based machine, after its domain shader. It packs the triangles that culling
// leaves into blocks of up to 64 vertices and 126 triangles, writes them to the parameter buffer, and gives each tile
// a reference to every block that it needs. Groups of triangles (7x7 cells, a cluster) are never divided, and are
// joined while they fit. Indices are coded as grids or as a strip, whichever is smaller. finish() then models the
// tile cores' reads, tile by tile, through a cache of bursts.
//
// With kEachDraw this is index-driven vertex shading [spec: Arm, from Bifrost on: position shading, culling, varying
// shading]: triangles of a draw that name the same vertex share it, in all blocks of the draw. Tessellated patches
// share no vertex: the tessellator makes them and no index buffer names them, so both patches at an edge keep its
// vertices. Two assumptions favour this machine: it always finds a shaded vertex of a draw again, and it writes no
// position of a culled triangle.
//
// With `depths_alone`, for a shadow map, attributes are shaded for the vertices of triangles that a texture masks.
//
// Only positions have real content; bytes of attributes are zero, as their values change no count.
//
// Configured by parameter_buffer.*, binner.combining_bursts, memory.burst_bytes, baselines.cache_bytes.
// Invariants (cited by the tests):
//   PT1  Every triangle that setup keeps is in the list of every tile that it may touch, once.
//   PT2  A block names each vertex that its triangles use once, and no other.
//   PT3  Tile cores read only bytes that were written.
//   PT4  Positions come back with all their bits, wherever they are stored.
//   PT5  With kEachDraw a vertex of a draw is stored once.
class PostTessellationBinner {
 public:
  PostTessellationBinner(const gpu::GpuConfiguration& gpu, const binner::TileGrid& grid,
                         const scene::Projection& projection, VertexStorage storage = VertexStorage::kEachBlock,
                         bool depths_alone = false);

  const TriangleSetup& setup() const { return setup_; }

  // Adds the patches in the order of drawing, each with the result of setup().
  void add(const TessellatedPatch& patch, const TriangleList& list);

  // Writes pending blocks, then reads all tiles. Separate attributes are read for the triangles in `visible`, or for all
  // with nullptr. `state_bytes`: bytes of each tile, to compute the cost of a smaller buffer; empty if that is not wanted.
  void finish(const VisibleTriangles* visible = nullptr, std::span<const std::uint64_t> state_bytes = {});

  const BaselineCounters& counters() const { return counters_; }
  const TriangleBuffer& buffer() const { return buffer_; }
  // By tile, the work of its core for its list; valid after finish().
  const std::vector<ListWork>& tiles() const { return tiles_; }
  // Traffic of parameter-buffer writes and reads, with the cache and without any.
  std::uint64_t dram_bytes() const { return dram_bytes_; }
  std::uint64_t dram_bytes_uncached() const { return dram_bytes_uncached_; }

 private:
  struct TileTriangle {
    binner::TileIndex tile;
    std::uint8_t triangle;
    auto operator<=>(const TileTriangle&) const = default;
  };
  // Data about a written block that memory does not hold.
  struct Written {
    std::uint64_t address, attribute_bytes;
    std::size_t first_name;  // first name of its triangles, in names_
  };
  // A vertex of the block in progress.
  struct BlockVertex {
    std::array<float, 6> position;  // x, y, depth at both keys
    std::uint32_t number = 0;       // number in its index buffer
    std::uint64_t index_buffer = 0;
    std::optional<VertexPlace> place;  // set if it is stored with an earlier block
  };
  struct Reading;

  void begin_patch(const TessellatedPatch& patch);
  std::uint32_t number_of(const TessellatedPatch& patch, std::uint32_t vertex) const;
  bool fits(const TessellatedPatch& patch, const TriangleList& list, std::size_t first, std::size_t end) const;
  void begin_group(const TessellatedPatch& patch, const TriangleList& list, std::size_t group, std::size_t first);
  void add_triangle(const TessellatedPatch& patch, const TriangleList& list, std::size_t triangle);
  void close_block();
  std::vector<std::uint8_t> pack_block(std::uint64_t address, std::uint64_t& own_vertices_at);
  std::vector<std::uint8_t> pack_indices(bool& grids);
  void pack_vertices(std::vector<std::uint8_t>& block) const;
  static std::uint64_t position_bytes(bool moving) { return kPositionBytes * (moving ? 2 : 1); }
  void put_position(const BlockVertex& vertex, std::uint8_t* at) const;
  void keep_places(std::uint64_t own_vertices_at);
  void forget_numbers();
  void read_tile(binner::TileIndex tile, Reading& reading);
  void read_block(const TileReference& reference, binner::TileIndex tile, Reading& reading);

  static constexpr std::uint8_t kNoNumber = 255;

  binner::TileGrid grid_;
  tilecore::TileOrder order_;
  TriangleSetup setup_;
  TriangleBuffer buffer_;
  VertexStorage storage_;
  bool orthographic_, depths_alone_;
  std::uint64_t burst_bytes_, cache_bytes_;
  BaselineCounters counters_;
  std::uint64_t dram_bytes_ = 0, dram_bytes_uncached_ = 0;
  std::vector<ListWork> tiles_;
  std::vector<Written> blocks_;
  std::vector<std::uint64_t> names_;

  // The block in progress.
  std::uint32_t state_ = 0;
  bool moving_ = false, all_grids_ = true;
  std::uint64_t attribute_bytes_ = 0;
  std::vector<BlockTriangle> triangles_;
  std::vector<GridRectangle> rectangles_;
  std::size_t rectangle_begins_ = 0;  // first triangle of the rectangle, in the patch
  std::uint8_t rectangle_vertex_ = 0;
  std::vector<TileTriangle> tile_triangles_;
  std::vector<BlockVertex> vertices_;
  std::vector<std::uint8_t> number_;         // by vertex of the index buffer: number in the block, or kNoNumber
  std::vector<std::uint32_t> numbered_;      // vertices of the index buffer that have a number in the block
  std::vector<std::uint64_t> last_address_;  // per tile

  // The current patch uses the index buffer of its draw, or one of its own.
  std::uint64_t index_buffer_ = 0;
  bool shares_draw_ = false;
  std::uint32_t draw_state_ = 0;
  DrawVertices drawn_;
};

}  // namespace tessera::baselines

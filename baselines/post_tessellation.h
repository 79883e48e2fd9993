#pragma once

#include <cstdint>
#include <vector>

#include "baselines/baseline_counters.h"
#include "baselines/block_code.h"
#include "baselines/tessellated_patch.h"
#include "baselines/tile_reference.h"
#include "baselines/triangle_buffer.h"
#include "baselines/triangle_setup.h"
#include "memory/lru_cache.h"

namespace tessera::baselines {

// Bytes of a vertex with all attributes: position at shutter open (x, y, depth: 12), then what the pixel shader needs of
// normal 4, tangent 4, texture coordinate 8, colour 4; moving ones have a second position.
inline constexpr std::uint64_t kPositionBytes = 12, kVertexBytes = kPositionBytes + 20, kSecondPositionBytes = 12;

// Head of a block: state (4), vertices (1), triangles (1), bytes of the indices (2: bits 0..12) with flags: bit 13
// positions are coded, 14 indices are grids, else a strip, 15 it moves. Then the indices,
// filled up to a multiple of 4, then the vertices:
//   not coded: of each position, attributes, second position
//   coded: positions (block_code.h), filled up to a multiple of 4, then the attributes of each
// How many attributes there are goes with the state.
inline constexpr std::uint64_t kBlockHeadBytes = 8;

// How blocks hold vertices.
enum class VertexStorage : std::uint8_t {
  kFloats,  // whole: what is shaded together stays together
  kSnapped  // positions snapped and delta-coded, attributes behind them: shaded for what culling leaves, and fetched for
            // what is visible
};

// The binner of a conventional tile-based machine, behind its domain shader: packs what culling leaves into blocks of
// up to 64 vertices and 126 triangles, writes them to the parameter buffer and each tile a reference to every block
// that it needs. Groups of triangles (7x7 cells, a cluster) are never divided, and joined while they fit. Indices are
// coded as grids or as a strip, whichever is smaller. Then the tile cores' reads of all that, tile by tile, through a
// cache of bursts.
//
// Only positions are stored as they are; bytes of other attributes are zero, as their values change no count.
//
// Configured by parameter_buffer.*, binner.combining_bursts, memory.burst_bytes, baselines.cache_bytes.
// Invariants (cited by the tests):
//   PT1  Every triangle that setup keeps is in the list of every tile that it may touch, once.
//   PT2  A block holds each vertex that its triangles use once, and no other.
//   PT3  What tile cores read was written.
//   PT4  Positions come back with all their bits, however they are stored.
class PostTessellationBinner {
 public:
  PostTessellationBinner(const gpu::GpuConfiguration& gpu, const binner::TileGrid& grid,
                         const scene::Projection& projection, VertexStorage storage = VertexStorage::kFloats);

  const TriangleSetup& setup() const { return setup_; }

  // Patches come in the order in which they are drawn, with what setup() made of them.
  void add(const TessellatedPatch& patch, const TriangleList& list);

  // Writes what is pending, then reads all tiles. Attributes that are apart are read for `visible`, null: for all.
  // `state_bytes`: of tiles, for what a smaller buffer would cost; empty: not asked for.
  void finish(const VisibleTriangles* visible = nullptr, std::span<const std::uint64_t> state_bytes = {});

  const BaselineCounters& counters() const { return counters_; }
  const TriangleBuffer& buffer() const { return buffer_; }
  // By tile, what its core does with its list; after finish().
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
  // What is not in memory: of a block that was written.
  struct Written {
    std::uint64_t address, attribute_bytes;
    std::size_t first_name;  // of its triangles, in names_
  };
  struct Reading;

  bool fits(const TessellatedPatch& patch, const TriangleList& list, std::size_t first, std::size_t end) const;
  void begin_group(const TessellatedPatch& patch, const TriangleList& list, std::size_t group, std::size_t first);
  void add_triangle(const TessellatedPatch& patch, const TriangleList& list, std::size_t triangle);
  void close_block();
  std::vector<std::uint8_t> pack_block();
  std::vector<std::uint8_t> pack_indices(bool& grids);
  void pack_vertices(const std::vector<PositionWords>& words, std::vector<std::uint8_t>& block) const;
  void begin_numbering(std::size_t vertices) { number_.assign(vertices, kNoNumber); }
  void read_tile(binner::TileIndex tile, Reading& reading);
  void read_block(const TileReference& reference, binner::TileIndex tile, Reading& reading);

  static constexpr std::uint8_t kNoNumber = 255;

  binner::TileGrid grid_;
  tilecore::TileOrder order_;
  TriangleSetup setup_;
  TriangleBuffer buffer_;
  VertexStorage storage_;
  std::uint64_t burst_bytes_, cache_bytes_;
  BaselineCounters counters_;
  std::uint64_t dram_bytes_ = 0, dram_bytes_uncached_ = 0;
  std::vector<ListWork> tiles_;
  std::vector<Written> blocks_;
  std::vector<std::uint64_t> names_;

  // The block that is being filled.
  std::uint32_t state_ = 0;
  bool moving_ = false, all_grids_ = true;
  std::uint64_t attribute_bytes_ = 0;
  std::vector<BlockTriangle> triangles_;
  std::vector<GridRectangle> rectangles_;
  std::size_t rectangle_begins_ = 0;  // at this triangle of the patch
  std::uint8_t rectangle_vertex_ = 0;
  std::vector<TileTriangle> tile_triangles_;
  std::vector<std::array<float, 6>> positions_;
  std::vector<std::uint8_t> number_;         // of a vertex of the patch in the block, kNoNumber
  std::vector<std::uint64_t> last_address_;  // per tile
};

}  // namespace tessera::baselines

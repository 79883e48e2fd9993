#pragma once

#include <cstdint>
#include <vector>

#include "baselines/strip_code.h"
#include "baselines/triangle_buffer.h"
#include "baselines/triangle_setup.h"
#include "memory/lru_cache.h"

namespace tessera::baselines {

// Bytes of a vertex in a block: position at shutter open (x, y, depth: 12), then what the pixel shader needs (normal 4,
// tangent 4, texture coordinate 8, colour 4); moving ones have a second position.
inline constexpr std::uint64_t kVertexBytes = 32, kSecondPositionBytes = 12;

// Head of a block: state (4), vertices (1), triangles (1), bytes of the strip and in the top bit whether it moves (2).
// Then the strip, filled up to a multiple of 4, then the vertices.
inline constexpr std::uint64_t kBlockHeadBytes = 8;

// The binner of a conventional tile-based machine, behind its domain shader: packs what culling leaves into blocks of
// up to 64 vertices and 126 triangles, writes them to the parameter buffer and each tile a reference to every block
// that it needs. Groups of triangles (7x7 cells, a cluster) are never divided, and joined while they fit. Then the tile
// cores' reads of all that, tile by tile, through a cache of bursts.
//
// Only positions are stored as they are; bytes of other attributes are zero, as their values change no count.
//
// Configured by parameter_buffer.*, binner.combining_bursts, memory.burst_bytes, post_tessellation.cache_bytes.
// Invariants (cited by the tests):
//   PT1  Every triangle that setup keeps is in the list of every tile that it may touch, once.
//   PT2  A block holds each vertex that its triangles use once, and no other.
//   PT3  What tile cores read was written.
class PostTessellationBinner {
 public:
  PostTessellationBinner(const gpu::GpuConfiguration& gpu, const binner::TileGrid& grid,
                         const scene::Projection& projection);

  const TriangleSetup& setup() const { return setup_; }

  // Patches come in the order in which they are drawn, with what setup() made of them.
  void add(const TessellatedPatch& patch, const TriangleList& list);

  // Writes what is pending, then reads all tiles.
  void finish();

  const BaselineCounters& counters() const { return counters_; }
  const TriangleBuffer& buffer() const { return buffer_; }
  // Traffic of parameter-buffer writes and reads, with the cache and without any.
  std::uint64_t dram_bytes() const { return dram_bytes_; }
  std::uint64_t dram_bytes_uncached() const { return dram_bytes_uncached_; }

 private:
  bool fits(const TessellatedPatch& patch, const TriangleList& list, std::size_t first, std::size_t end) const;
  void add_triangle(const TessellatedPatch& patch, const TriangleList& list, std::size_t triangle);
  void close_block();
  void begin_numbering(std::size_t vertices);
  std::uint64_t read_tile(binner::TileIndex tile, memory::LruCache& cache, memory::Ledger& ledger);

  binner::TileGrid grid_;
  TriangleSetup setup_;
  TriangleBuffer buffer_;
  std::uint64_t burst_bytes_, cache_bytes_;
  BaselineCounters counters_;
  std::uint64_t dram_bytes_ = 0, dram_bytes_uncached_ = 0;

  // The block that is being filled.
  struct TileTriangle {
    binner::TileIndex tile;
    std::uint8_t triangle;
    auto operator<=>(const TileTriangle&) const = default;
  };
  std::uint32_t state_ = 0;
  bool moving_ = false;
  std::vector<BlockTriangle> triangles_;
  std::vector<TileTriangle> tile_triangles_;
  std::vector<std::uint8_t> vertex_bytes_;
  std::uint8_t vertex_count_ = 0;
  std::vector<std::uint8_t> number_;         // of a vertex of the patch in the block, kNoNumber
  std::vector<std::uint64_t> last_address_;  // per tile
};

}  // namespace tessera::baselines

#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "baselines/baseline_counters.h"
#include "baselines/block_reader.h"
#include "baselines/scheme.h"
#include "baselines/triangle_buffer.h"
#include "baselines/triangle_setup.h"
#include "tilecore/tile_order.h"

namespace tessera::baselines {

// Vertices that are in no list: tile cores fetch the patches that their lists name and shade again the vertices of their
// triangles. All tiles share a cache of positions behind the vertex shader (LRU, vertex by vertex, 12 bytes each, or per
// motion key if they deform, as in this machine's TessellationCache). Tiles come in the order of tilecore.tile_order,
// triangles in the order of drawing. A patch is fetched only if one of its vertices is missing in the cache.
class Reshading {
 public:
  // `record_bytes`: size of an L2 in front of the records, as this machine's tile cores have (LRU, record by record).
  Reshading(const tilecore::TileOrder& order, std::uint64_t cache_bytes, std::uint64_t record_bytes)
      : order_(order.tiles()), tiles_(order_.size()), cache_bytes_(cache_bytes), record_bytes_(record_bytes) {}

  // Addresses of a patch's domain points and indices, if a tessellator wrote them to memory: kDomainPointBytes for
  // each vertex, then kIndexBytes for each corner of its triangles.
  struct Tessellation {
    std::uint64_t points, indices;
  };
  static constexpr std::uint64_t kDomainPointBytes = 8, kIndexBytes = 4;

  // Adds a patch and returns the number of its first vertex, as if all patches shared one vertex buffer.
  std::uint32_t add(const TessellatedPatch& patch, const TriangleList& list,
                    const std::optional<Tessellation>& tessellation = std::nullopt);

  struct Counts {
    std::uint64_t evaluations = 0, patch_bytes = 0;                // without the cache: each tile shades again
    std::uint64_t evaluations_cached = 0, patch_bytes_cached = 0;  // with it
  };
  // `work`: nullptr, or by tile. `cached` and `uncached` read domain points and indices, with a cache and without.
  Counts run(std::vector<ListWork>* work, BlockReader& cached, BlockReader& uncached) const;

 private:
  struct Patch {
    std::uint32_t first_triangle, first_vertex;
    std::uint64_t bytes, decoded;
    std::uint32_t vertex_bytes;
    bool transforms;  // its motion is not part of the cached vertices
    std::optional<Tessellation> tessellation;
  };
  std::vector<Patch> patches_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  std::vector<std::uint32_t> numbers_;  // number of each triangle in its patch
  std::vector<binner::TileIndex> order_;
  std::vector<std::vector<std::uint32_t>> tiles_;  // numbers in triangles_, rising
  std::uint32_t vertices_ = 0;
  std::uint64_t cache_bytes_, record_bytes_;
};

// The common part of machines whose lists hold references: lists, and geometry that is shaded again.
class ReferenceLists {
 public:
  ReferenceLists(const gpu::GpuConfiguration& gpu, const binner::TileGrid& grid);

  Reshading& reshading() { return reshading_; }
  void append(binner::TileIndex tile, std::span<const std::uint8_t> bytes) { buffer_.append(tile, bytes); }
  // Counts a reference that a tile core looks up, like an entry of this machine.
  void count_entry(binner::TileIndex tile) { ++tiles_[tile].entries; }

  // Writes a block that tiles read when they shade, and returns its address.
  std::uint64_t store_block(std::span<const std::uint8_t> bytes) { return buffer_.store_block(bytes); }

  // Reads all lists and shades. `state_bytes`: see PostTessellationBinner::finish().
  void finish(std::span<const std::uint64_t> state_bytes);

  const TriangleBuffer& buffer() const { return buffer_; }
  // By tile; after finish().
  const std::vector<ListWork>& tiles() const { return tiles_; }
  BaselineCounters& counters() { return counters_; }
  const BaselineCounters& counters() const { return counters_; }
  // Bytes of lists and blocks, and of patches that are fetched again, with the caches and without.
  std::uint64_t dram_bytes() const { return list_dram_bytes_ + block_bytes_cached_ + counters_.patch_bytes_cached; }
  std::uint64_t dram_bytes_uncached() const { return list_dram_bytes_ + block_bytes_ + counters_.patch_bytes; }

 private:
  TriangleBuffer buffer_;
  Reshading reshading_;
  std::uint64_t burst_bytes_, cache_bytes_;
  std::vector<ListWork> tiles_;
  BaselineCounters counters_;
  std::uint64_t list_dram_bytes_ = 0, block_bytes_ = 0, block_bytes_cached_ = 0;  // blocks: bytes read
};

// The work of a compute tessellator before the vertices of a pass are shaded.
struct Tessellated {
  std::uint64_t instructions = 0;  // on lanes
  std::uint64_t read_bytes = 0;    // bursts of its output that are read when positions are shaded to bin
};

// The result of a scheme with finished reference lists. `bins`: lists belong to the pass's bins, not to its tiles.
// `fetches_entries`: cores look references up; otherwise set-up decodes triangles as it takes them.
SchemeResult reference_result(const Pass& pass, const DrawnPass& drawn, const ReferenceLists& lists, bool bins,
                              bool fetches_entries, const Tessellated& tessellated = {});

// A scheme whose Binner has add(), finish() and lists().
template <class Binner, bool kBins, bool kFetchesEntries>
class ReferenceScheme final : public Scheme {
 public:
  void begin(const Pass& pass) override {
    pass_ = &pass;
    binner_.emplace(pass.gpu, kBins ? pass.bins : *pass.job.grid);
  }
  void add(const DrawnPatch& patch) override { binner_->add(patch.patch, kBins ? patch.bins : patch.tiles); }
  SchemeResult finish(const DrawnPass& drawn) override {
    binner_->finish(kBins ? drawn.bin_state_bytes : drawn.tile_state_bytes);
    return reference_result(*pass_, drawn, binner_->lists(), kBins, kFetchesEntries);
  }

 private:
  const Pass* pass_ = nullptr;
  std::optional<Binner> binner_;
};

}  // namespace tessera::baselines

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

// Vertices that no list holds: tile cores fetch the patches that their lists name and shade again the vertices of their
// triangles, through a cache of positions behind the vertex shader that all tiles share (LRU, vertex by vertex, 12 bytes
// each, or per motion key where they deform, as in front of our tessellator: TessellationCache). Tiles come in the order
// of tilecore.tile_order, triangles as they were drawn. A patch none of whose vertices is missing is not fetched.
class Reshading {
 public:
  // `record_bytes`: of an L2 in front of the records, as our tile cores have (LRU, record by record).
  Reshading(const tilecore::TileOrder& order, std::uint64_t cache_bytes, std::uint64_t record_bytes)
      : order_(order.tiles()), tiles_(order_.size()), cache_bytes_(cache_bytes), record_bytes_(record_bytes) {}

  // Where a patch's domain points and indices lie, if a tessellator wrote them to memory: kDomainPointBytes for each vertex,
  // then kIndexBytes for each corner of its triangles.
  struct Tessellation {
    std::uint64_t points, indices;
  };
  static constexpr std::uint64_t kDomainPointBytes = 8, kIndexBytes = 4;

  // Returns the number of the patch's first vertex, of all that were added: their place in one vertex buffer.
  std::uint32_t add(const TessellatedPatch& patch, const TriangleList& list,
                    const std::optional<Tessellation>& tessellation = std::nullopt);

  struct Counts {
    std::uint64_t evaluations = 0, patch_bytes = 0;                // without the cache: for each tile anew
    std::uint64_t evaluations_cached = 0, patch_bytes_cached = 0;  // with it
  };
  // `work`: null, or by tile. `cached`, `uncached`: read domain points and indices, with a cache and without.
  Counts run(std::vector<ListWork>* work, BlockReader& cached, BlockReader& uncached) const;

 private:
  struct Patch {
    std::uint32_t first_triangle, first_vertex;
    std::uint64_t bytes, decoded;
    std::uint32_t vertex_bytes;
    bool transforms;  // it moves by what its cached vertices do not hold
    std::optional<Tessellation> tessellation;
  };
  std::vector<Patch> patches_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  std::vector<std::uint32_t> numbers_;  // of each, in its patch
  std::vector<binner::TileIndex> order_;
  std::vector<std::vector<std::uint32_t>> tiles_;  // numbers in triangles_, rising
  std::uint32_t vertices_ = 0;
  std::uint64_t cache_bytes_, record_bytes_;
};

// What machines whose lists hold references have in common: lists, and geometry that is shaded again.
class ReferenceLists {
 public:
  ReferenceLists(const gpu::GpuConfiguration& gpu, const binner::TileGrid& grid);

  Reshading& reshading() { return reshading_; }
  void append(binner::TileIndex tile, std::span<const std::uint8_t> bytes) { buffer_.append(tile, bytes); }
  // A reference that a tile core looks up, as it does an entry of ours.
  void count_entry(binner::TileIndex tile) { ++tiles_[tile].entries; }

  // Writes a block that tiles read when they shade, and returns its address.
  std::uint64_t store_block(std::span<const std::uint8_t> bytes) { return buffer_.store_block(bytes); }

  // Reads all lists and shades. `state_bytes` as for PostTessellationBinner.
  void finish(std::span<const std::uint64_t> state_bytes);

  const TriangleBuffer& buffer() const { return buffer_; }
  // By tile; after finish().
  const std::vector<ListWork>& tiles() const { return tiles_; }
  BaselineCounters& counters() { return counters_; }
  const BaselineCounters& counters() const { return counters_; }
  // Bytes of lists, blocks, and patches fetched again, with the caches and without.
  std::uint64_t dram_bytes() const { return list_dram_bytes_ + block_bytes_cached_ + counters_.patch_bytes_cached; }
  std::uint64_t dram_bytes_uncached() const { return list_dram_bytes_ + block_bytes_ + counters_.patch_bytes; }

 private:
  TriangleBuffer buffer_;
  Reshading reshading_;
  std::uint64_t burst_bytes_, cache_bytes_;
  std::vector<ListWork> tiles_;
  BaselineCounters counters_;
  std::uint64_t list_dram_bytes_ = 0, block_bytes_ = 0, block_bytes_cached_ = 0;  // of blocks: read
};

// The work of a compute tessellator before the vertices of a pass were shaded.
struct Tessellated {
  std::uint64_t instructions = 0;  // on lanes
  std::uint64_t read_bytes = 0;    // in bursts, of what it wrote, when positions are shaded to bin
};

// The result of a scheme with such lists, when they are finished. `bins`: lists are of the pass's bins, not of its tiles.
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

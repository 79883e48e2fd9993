#include "baselines/reshading.h"

#include <algorithm>
#include <limits>

#include "base/check.h"
#include "baselines/scheme_work.h"
#include "tilecore/tessellation/tessellation_cache.h"

namespace tessera::baselines {

std::uint32_t Reshading::add(const TessellatedPatch& patch, const TriangleList& list,
                             const std::optional<Tessellation>& tessellation) {
  TESSERA_CHECK(patch.x0.size() <= std::numeric_limits<std::uint32_t>::max() - vertices_, "vertex numbers fit 32 bits");
  const std::uint32_t first = vertices_;
  vertices_ += static_cast<std::uint32_t>(patch.x0.size());
  patches_.push_back(
      {static_cast<std::uint32_t>(triangles_.size()), first, patch.patch_bytes + patch.stored_attribute_bytes,
       patch.decoded_elements,
       static_cast<std::uint32_t>(tilecore::TessellationCache::kPositionBytes * (patch.deforming ? 2 : 1)),
       patch.moving && !patch.deforming, tessellation});
  std::uint32_t tile = 0;
  for (const TriangleList::Triangle& t : list.triangles) {
    const auto number = static_cast<std::uint32_t>(triangles_.size());
    triangles_.push_back({first + t.vertex[0], first + t.vertex[1], first + t.vertex[2]});
    numbers_.push_back(t.number);
    for (; tile < t.tiles_end; ++tile) tiles_[list.tiles[tile]].push_back(number);
  }
  return first;
}

Reshading::Counts Reshading::run(std::vector<ListWork>* work, BlockReader& cached, BlockReader& uncached) const {
  Counts counts;
  memory::LruCache cache(cache_bytes_), records(record_bytes_);
  std::vector<std::uint32_t> seen_in(vertices_, 0);  // number of the tile, plus one
  struct Done : ListWork {
    std::uint64_t block_bytes = 0;
  };
  for (const binner::TileIndex tile : order_) {
    auto patch = patches_.begin();
    Done done;
    for (std::size_t k = 0; k < tiles_[tile].size();) {
      patch = std::prev(std::upper_bound(patch, patches_.end(), tiles_[tile][k],
                                         [](std::uint32_t t, const Patch& p) { return t < p.first_triangle; }));
      const std::uint32_t end = std::next(patch) == patches_.end() ? std::numeric_limits<std::uint32_t>::max()
                                                                   : std::next(patch)->first_triangle;
      bool missing = false;
      for (; k < tiles_[tile].size() && tiles_[tile][k] < end; ++k) {
        if (patch->tessellation) {
          const std::uint64_t at = patch->tessellation->indices + numbers_[tiles_[tile][k]] * 3 * kIndexBytes;
          cached.ask(at, 3 * kIndexBytes), uncached.ask(at, 3 * kIndexBytes);
        }
        for (const std::uint32_t vertex : triangles_[tiles_[tile][k]]) {
          if (seen_in[vertex] == tile + 1) continue;
          seen_in[vertex] = tile + 1;
          ++counts.evaluations;
          const auto ask_point = [&](BlockReader& reader) {
            if (patch->tessellation)
              reader.ask(patch->tessellation->points + (vertex - patch->first_vertex) * kDomainPointBytes,
                         kDomainPointBytes);
          };
          ask_point(uncached);
          if (cache.use(vertex, patch->vertex_bytes)) {
            if (patch->transforms) ++done.transforms;
            continue;
          }
          ask_point(cached);
          ++done.vertices;
          missing = true;
        }
      }
      const std::uint64_t asked = cached.asked_bytes(), filled = cached.read_asked();
      done.block_bytes += filled;
      done.cache_bytes += cached.asked_bytes() - asked + filled;
      uncached.read_asked();
      counts.patch_bytes += patch->bytes;
      if (!missing) continue;
      done.cache_bytes += patch->bytes;
      done.decoded += patch->decoded;
      if (records.use(static_cast<std::uint32_t>(patch - patches_.begin()), patch->bytes)) continue;
      done.cache_bytes += patch->bytes;
      done.bytes += patch->bytes;
    }
    counts.evaluations_cached += done.vertices;
    counts.patch_bytes_cached += done.bytes;
    if (work == nullptr) continue;
    ListWork& of_tile = (*work)[tile];
    of_tile.vertices += done.vertices;
    of_tile.transforms += done.transforms;
    of_tile.bytes += done.bytes + done.block_bytes;
    of_tile.cache_bytes += done.cache_bytes;
    of_tile.decoded += done.decoded;
  }
  return counts;
}

ReferenceLists::ReferenceLists(const gpu::GpuConfiguration& gpu, const binner::TileGrid& grid)
    : buffer_(gpu, grid.tile_count()),
      reshading_(tilecore::TileOrder(gpu.tilecore.tile_order, grid),
                 static_cast<std::uint64_t>(gpu.tessellator.cache_bytes),
                 static_cast<std::uint64_t>(gpu.caches.l2_bytes)),
      burst_bytes_(static_cast<std::uint64_t>(gpu.memory.burst_bytes)),
      cache_bytes_(static_cast<std::uint64_t>(gpu.baselines.cache_bytes)),
      tiles_(grid.tile_count()) {}

void ReferenceLists::finish(std::span<const std::uint64_t> state_bytes) {
  buffer_.finish();
  BlockReader blocks(burst_bytes_, cache_bytes_), uncached(burst_bytes_, 0);
  memory::Ledger ledger = buffer_.ledger();
  for (binner::TileIndex tile = 0; tile < tiles_.size(); ++tile) {
    const std::uint64_t before = ledger.total().read_bytes;
    buffer_.read_list(tile, ledger, counters_.queue_bytes_read, &blocks.reads);
    tiles_[tile].bytes = ledger.total().read_bytes - before;
  }
  const Reshading::Counts shaded = reshading_.run(&tiles_, blocks, uncached);
  block_bytes_cached_ = blocks.filled_bytes(), block_bytes_ = uncached.asked_bytes();
  counters_.queue_bytes_read += block_bytes_cached_;
  counters_.queue_bytes_written = buffer_.bytes_written();
  counters_.queue_bytes_peak = buffer_.bytes_in_use();
  counters_.buffer_overflows = buffer_.overflows();
  counters_.domain_evaluations = shaded.evaluations;
  counters_.domain_evaluations_cached = shaded.evaluations_cached;
  counters_.patch_bytes = shaded.patch_bytes;
  counters_.patch_bytes_cached = shaded.patch_bytes_cached;
  list_dram_bytes_ = ledger.total().read_bytes + ledger.total().written_bytes;
  if (!state_bytes.empty()) set_pressure(buffer_.pressure(blocks.reads, state_bytes), counters_);
}

SchemeResult reference_result(const Pass& pass, const DrawnPass& drawn, const ReferenceLists& lists, bool bins,
                              bool fetches_entries, const Tessellated& tessellated) {
  const BaselineCounters& hull = bins ? drawn.geometry.bins : drawn.geometry.tiles;
  SchemeResult out{list_counters(lists, drawn, hull, 0), {}};
  out.counters.position_evaluations = drawn.geometry.vertices;
  out.counters.queue_bytes_read += tessellated.read_bytes;
  out.counters.dram_bytes += tessellated.read_bytes;
  out.counters.dram_bytes_uncached += tessellated.read_bytes;
  if (drawn.work == nullptr) return out;
  FrontWork before = front_work(out.counters, lists.buffer(), hull.patch_bytes_cached);
  before.fetches_entries = fetches_entries;
  before.read_bytes += tessellated.read_bytes;
  before.instructions = tessellated.instructions;
  out.work = drawn.work->tiled(out.counters, before, lists.tiles(), bins ? pass.bins : *pass.job.grid);
  out.counters.texture_bytes = drawn.work->texture_bytes();
  return out;
}

}  // namespace tessera::baselines

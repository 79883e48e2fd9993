#include "baselines/post_tessellation.h"

#include <algorithm>
#include <cstring>

#include "base/check.h"
#include "baselines/tile_reference.h"

namespace tessera::baselines {
namespace {

constexpr std::uint8_t kNoNumber = 255;
constexpr unsigned kMovingBit = 0x8000u;

// Where the parts of a block are.
struct BlockHead {
  std::size_t vertices, triangles, strip_bytes;
  std::uint64_t vertex_bytes, vertices_at;  // relative to the block
};

BlockHead head_at(std::span<const std::uint8_t> memory, std::uint64_t address) {
  std::uint16_t strip = 0;
  std::memcpy(&strip, &memory[address + 6], sizeof strip);
  const std::size_t bytes = strip & ~kMovingBit;
  return {memory[address + 4], memory[address + 5], bytes,
          kVertexBytes + ((strip & kMovingBit) != 0 ? kSecondPositionBytes : 0), kBlockHeadBytes + (bytes + 3) / 4 * 4};
}

}  // namespace

PostTessellationBinner::PostTessellationBinner(const gpu::GpuConfiguration& gpu, const binner::TileGrid& grid,
                                               const scene::Projection& projection)
    : grid_(grid),
      setup_(grid_, projection),
      buffer_(gpu, grid.tile_count()),
      burst_bytes_(static_cast<std::uint64_t>(gpu.memory.burst_bytes)),
      cache_bytes_(static_cast<std::uint64_t>(gpu.baselines.post_tessellation_cache_bytes)),
      last_address_(grid.tile_count(), 0) {}

void PostTessellationBinner::begin_numbering(std::size_t vertices) { number_.assign(vertices, kNoNumber); }

bool PostTessellationBinner::fits(const TessellatedPatch& patch, const TriangleList& list, std::size_t first,
                                  std::size_t end) const {
  if (triangles_.empty()) return true;
  if (patch.state != state_ || triangles_.size() + (end - first) > kBlockTriangles) return false;
  std::vector<std::uint32_t> fresh;
  for (std::size_t t = first; t < end; ++t)
    for (const std::uint32_t v : list.triangles[t].vertex)
      if (number_[v] == kNoNumber) fresh.push_back(v);
  std::sort(fresh.begin(), fresh.end());
  const auto distinct = static_cast<std::size_t>(std::unique(fresh.begin(), fresh.end()) - fresh.begin());
  return vertex_count_ + distinct <= kBlockVertices;
}

void PostTessellationBinner::add_triangle(const TessellatedPatch& patch, const TriangleList& list,
                                          std::size_t triangle) {
  const TriangleList::Triangle& t = list.triangles[triangle];
  BlockTriangle numbers;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint32_t v = t.vertex[k];
    if (number_[v] == kNoNumber) {
      TESSERA_CHECK(vertex_count_ < kBlockVertices, "a group fits a block");
      number_[v] = vertex_count_++;
      const std::size_t at = vertex_bytes_.size();
      vertex_bytes_.resize(at + kVertexBytes + (moving_ ? kSecondPositionBytes : 0), 0);
      const std::array<float, 3> open = {patch.x0[v], patch.y0[v], patch.z0[v]};
      std::memcpy(&vertex_bytes_[at], open.data(), sizeof open);
      if (moving_) {
        const std::array<float, 3> close = {patch.x1[v], patch.y1[v], patch.z1[v]};
        std::memcpy(&vertex_bytes_[at + kVertexBytes], close.data(), sizeof close);
      }
    }
    numbers[k] = number_[v];
  }
  TESSERA_CHECK(triangles_.size() < kBlockTriangles, "a group fits a block");
  const auto number = static_cast<std::uint8_t>(triangles_.size());
  triangles_.push_back(numbers);
  for (std::uint32_t k = triangle == 0 ? 0 : list.triangles[triangle - 1].tiles_end; k < t.tiles_end; ++k)
    tile_triangles_.push_back({list.tiles[k], number});
}

void PostTessellationBinner::add(const TessellatedPatch& patch, const TriangleList& list) {
  counters_.domain_evaluations += patch.domain_evaluations;
  counters_.patch_bytes += patch.patch_bytes;
  begin_numbering(patch.x0.size());
  std::size_t first = 0;
  for (const std::uint32_t end : list.group_ends) {
    if (end == first) continue;
    if (!fits(patch, list, first, end)) {
      close_block();
      begin_numbering(patch.x0.size());
    }
    state_ = patch.state;
    moving_ = patch.moving;
    for (; first < end; ++first) add_triangle(patch, list, first);
  }
}

void PostTessellationBinner::close_block() {
  if (triangles_.empty()) return;
  const std::vector<std::uint8_t> strip = encode_strip(triangles_);
  std::vector<std::uint8_t> block(kBlockHeadBytes + (strip.size() + 3) / 4 * 4, 0);
  const auto strip_field = static_cast<std::uint16_t>(strip.size() | (moving_ ? kMovingBit : 0u));
  std::memcpy(block.data(), &state_, sizeof state_);
  block[4] = vertex_count_;
  block[5] = static_cast<std::uint8_t>(triangles_.size());
  std::memcpy(&block[6], &strip_field, sizeof strip_field);
  std::memcpy(&block[kBlockHeadBytes], strip.data(), strip.size());
  block.insert(block.end(), vertex_bytes_.begin(), vertex_bytes_.end());
  const std::uint64_t address = buffer_.store_block(block);
  counters_.vertices_stored += vertex_count_;

  std::sort(tile_triangles_.begin(), tile_triangles_.end());
  std::vector<std::uint8_t> bytes;
  for (std::size_t k = 0; k < tile_triangles_.size();) {
    const binner::TileIndex tile = tile_triangles_[k].tile;
    TileReference reference{address, {}};
    for (; k < tile_triangles_.size() && tile_triangles_[k].tile == tile; ++k)
      reference.triangles.set(tile_triangles_[k].triangle);
    bytes.clear();
    encode_reference(reference, triangles_.size(), last_address_[tile], bytes);
    last_address_[tile] = address;
    buffer_.append(tile, bytes);
    ++counters_.entries;
  }
  triangles_.clear();
  tile_triangles_.clear();
  vertex_bytes_.clear();
  vertex_count_ = 0;
}

// Returns the bytes of blocks that would be read without the cache.
std::uint64_t PostTessellationBinner::read_tile(binner::TileIndex tile, memory::LruCache& cache,
                                                memory::Ledger& ledger) {
  const std::vector<std::uint8_t> list = buffer_.read_list(tile, ledger, counters_.queue_bytes_read);
  const std::span<const std::uint8_t> memory = buffer_.memory();
  std::uint64_t uncached = 0;
  for (const TileReference& reference :
       decode_references(list, [&](std::uint64_t address) { return head_at(memory, address).triangles; })) {
    const BlockHead head = head_at(memory, reference.address);
    const auto triangles =
        decode_strip(memory.subspan(reference.address + kBlockHeadBytes, head.strip_bytes), head.triangles);
    std::bitset<kBlockVertices> used;
    for (std::size_t t = 0; t < triangles.size(); ++t)
      if (reference.triangles[t])
        for (const std::uint8_t v : triangles[t]) used.set(v);
    // Bursts in rising order, each once per reference.
    std::uint64_t next = 0;
    const auto read = [&](std::uint64_t address, std::uint64_t bytes) {
      for (std::uint64_t line = std::max(next, address / burst_bytes_); line <= (address + bytes - 1) / burst_bytes_;
           ++line) {
        next = line + 1;
        uncached += burst_bytes_;
        if (cache.use(static_cast<std::uint32_t>(line), burst_bytes_)) continue;
        ledger.read(memory::Unit::kTilecore, memory::Purpose::kTileQueue, burst_bytes_);
        counters_.queue_bytes_read += burst_bytes_;
      }
    };
    read(reference.address, head.vertices_at);
    for (std::size_t v = 0; v < head.vertices; ++v)
      if (used[v]) read(reference.address + head.vertices_at + v * head.vertex_bytes, head.vertex_bytes);
  }
  return uncached;
}

void PostTessellationBinner::finish() {
  close_block();
  buffer_.finish();
  memory::LruCache cache(cache_bytes_);
  memory::Ledger ledger, uncached_ledger;
  std::uint64_t uncached = 0;
  for (binner::TileIndex tile = 0; tile < grid_.tile_count(); ++tile) {
    uncached += read_tile(tile, cache, ledger);
    std::uint64_t ignored = 0;
    buffer_.read_list(tile, uncached_ledger, ignored);
  }
  const memory::Traffic written = buffer_.ledger().total();
  dram_bytes_ = written.read_bytes + written.written_bytes + ledger.total().read_bytes;
  dram_bytes_uncached_ = written.read_bytes + written.written_bytes + uncached_ledger.total().read_bytes + uncached;
  counters_.queue_bytes_written = buffer_.bytes_written();
  counters_.queue_bytes_peak = buffer_.bytes_in_use();
  counters_.buffer_overflows = buffer_.overflows();
  counters_.domain_evaluations_cached = counters_.domain_evaluations;
  counters_.patch_bytes_cached = counters_.patch_bytes;
}

}  // namespace tessera::baselines

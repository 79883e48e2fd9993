#include "baselines/post_tessellation.h"

#include <algorithm>
#include <cstring>
#include <memory>
#include <optional>

#include "base/check.h"
#include "base/round_up.h"
#include "baselines/scheme_work.h"

namespace tessera::baselines {
namespace {

constexpr unsigned kCodedBit = 0x2000u, kGridBit = 0x4000u, kMovingBit = 0x8000u, kIndexBytesMask = 0x1FFFu;

// Where the parts of a block are.
struct BlockHead {
  std::size_t vertices, triangles, index_bytes;
  bool coded, grids, moving;
  std::uint64_t vertices_at;  // relative to the block
};

BlockHead head_at(std::span<const std::uint8_t> memory, std::uint64_t address) {
  std::uint16_t field = 0;
  std::memcpy(&field, &memory[address + 6], sizeof field);
  const std::size_t bytes = field & kIndexBytesMask;
  return {memory[address + 4],
          memory[address + 5],
          bytes,
          (field & kCodedBit) != 0,
          (field & kGridBit) != 0,
          (field & kMovingBit) != 0,
          kBlockHeadBytes + round_up(bytes, 4)};
}

std::vector<BlockTriangle> triangles_at(std::span<const std::uint8_t> memory, std::uint64_t address,
                                        const BlockHead& head) {
  const auto bytes = memory.subspan(address + kBlockHeadBytes, head.index_bytes);
  return head.grids ? decode_grids(bytes, head.triangles) : decode_strip(bytes, head.triangles);
}

}  // namespace

PostTessellationBinner::PostTessellationBinner(const gpu::GpuConfiguration& gpu, const binner::TileGrid& grid,
                                               const scene::Projection& projection, VertexStorage storage)
    : grid_(grid),
      order_(gpu.tilecore.tile_order, grid),
      setup_(grid_, projection),
      buffer_(gpu, grid.tile_count()),
      storage_(storage),
      burst_bytes_(static_cast<std::uint64_t>(gpu.memory.burst_bytes)),
      cache_bytes_(static_cast<std::uint64_t>(gpu.baselines.cache_bytes)),
      last_address_(grid.tile_count(), 0) {}

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
  return positions_.size() + distinct <= kBlockVertices;
}

void PostTessellationBinner::begin_group(const TessellatedPatch& patch, const TriangleList& list, std::size_t group,
                                         std::size_t first) {
  state_ = patch.state;
  moving_ = patch.moving;
  attribute_bytes_ = patch.attribute_bytes;
  const std::uint8_t columns = group < patch.group_columns.size() ? patch.group_columns[group] : std::uint8_t{0};
  all_grids_ = all_grids_ && columns > 0;
  if (columns == 0) return;
  rectangle_begins_ = group == 0 ? 0 : patch.group_ends[group - 1];
  rectangle_vertex_ = static_cast<std::uint8_t>(positions_.size());
  const std::size_t cells = (patch.group_ends[group] - rectangle_begins_) / 2;
  rectangles_.push_back({columns, static_cast<std::uint8_t>(cells / columns), {}});
  TESSERA_CHECK(list.triangles[first].number >= rectangle_begins_, "groups of the list are those of the patch");
}

void PostTessellationBinner::add_triangle(const TessellatedPatch& patch, const TriangleList& list,
                                          std::size_t triangle) {
  const TriangleList::Triangle& t = list.triangles[triangle];
  BlockTriangle numbers;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint32_t v = t.vertex[k];
    if (number_[v] == kNoNumber) {
      TESSERA_CHECK(positions_.size() < kBlockVertices, "a group fits a block");
      number_[v] = static_cast<std::uint8_t>(positions_.size());
      positions_.push_back({patch.x0[v], patch.y0[v], patch.z0[v], moving_ ? patch.x1[v] : 0.0f,
                            moving_ ? patch.y1[v] : 0.0f, moving_ ? patch.z1[v] : 0.0f});
    }
    numbers[k] = number_[v];
    if (numbers[k] < rectangle_vertex_) all_grids_ = false;  // shared with another rectangle
  }
  TESSERA_CHECK(triangles_.size() < kBlockTriangles, "a group fits a block");
  const auto number = static_cast<std::uint8_t>(triangles_.size());
  triangles_.push_back(numbers);
  if (all_grids_) rectangles_.back().triangles.set(t.number - rectangle_begins_);
  names_.push_back(patch.triangle_numbers.empty() ? 0 : triangle_name(patch.number, patch.triangle_numbers[t.number]));
  for (std::uint32_t k = triangle == 0 ? 0 : list.triangles[triangle - 1].tiles_end; k < t.tiles_end; ++k)
    tile_triangles_.push_back({list.tiles[k], number});
}

void PostTessellationBinner::add(const TessellatedPatch& patch, const TriangleList& list) {
  counters_.domain_evaluations += patch.domain_evaluations;
  begin_numbering(patch.x0.size());
  std::size_t first = 0;
  for (std::size_t group = 0; group < list.group_ends.size(); ++group) {
    const std::size_t end = list.group_ends[group];
    if (end == first) continue;
    if (!fits(patch, list, first, end)) {
      close_block();
      begin_numbering(patch.x0.size());
    }
    begin_group(patch, list, group, first);
    for (; first < end; ++first) add_triangle(patch, list, first);
  }
}

// Grids where they are smaller; vertices are then put in their order.
std::vector<std::uint8_t> PostTessellationBinner::pack_indices(bool& grids) {
  std::vector<std::uint8_t> strip = encode_strip(triangles_);
  grids = false;
  if (!all_grids_) return strip;
  std::vector<std::uint8_t> bytes = encode_grids(rectangles_);
  if (bytes.size() >= strip.size()) return strip;
  grids = true;
  const std::vector<BlockTriangle> numbered = decode_grids(bytes, triangles_.size());
  std::vector<std::array<float, 6>> sorted(positions_.size());
  for (std::size_t t = 0; t < triangles_.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) sorted[numbered[t][k]] = positions_[triangles_[t][k]];
  positions_ = std::move(sorted);
  triangles_ = numbered;
  return bytes;
}

void PostTessellationBinner::pack_vertices(const std::vector<PositionWords>& words,
                                           std::vector<std::uint8_t>& block) const {
  if (!words.empty()) {
    const std::vector<std::uint8_t> coded = encode_positions(words, moving_ ? kMovingWords : kStillWords);
    block.insert(block.end(), coded.begin(), coded.end());
    block.resize(round_up(block.size(), 4) + words.size() * attribute_bytes_, 0);
    return;
  }
  for (const std::array<float, 6>& position : positions_) {
    const std::size_t at = block.size();
    block.resize(at + kPositionBytes + attribute_bytes_ + (moving_ ? kSecondPositionBytes : 0), 0);
    std::memcpy(&block[at], position.data(), kPositionBytes);
    if (moving_) std::memcpy(&block[at + kPositionBytes + attribute_bytes_], &position[3], kSecondPositionBytes);
  }
}

std::vector<std::uint8_t> PostTessellationBinner::pack_block() {
  bool grids = false;
  const std::vector<std::uint8_t> indices = pack_indices(grids);
  std::vector<PositionWords> words;
  for (std::size_t v = 0; storage_ == VertexStorage::kSnapped && v < positions_.size(); ++v) {
    const auto of_vertex = position_words(positions_[v], moving_ ? kMovingWords : kStillWords);
    if (!of_vertex) {
      words.clear();
      break;
    }
    words.push_back(*of_vertex);
  }
  std::vector<std::uint8_t> block(kBlockHeadBytes + round_up(indices.size(), 4), 0);
  const auto field = static_cast<std::uint16_t>(indices.size() | (moving_ ? kMovingBit : 0u) | (grids ? kGridBit : 0u) |
                                                (words.empty() ? 0u : kCodedBit));
  std::memcpy(block.data(), &state_, sizeof state_);
  block[4] = static_cast<std::uint8_t>(positions_.size());
  block[5] = static_cast<std::uint8_t>(triangles_.size());
  std::memcpy(&block[6], &field, sizeof field);
  std::memcpy(&block[kBlockHeadBytes], indices.data(), indices.size());
  pack_vertices(words, block);
  return block;
}

void PostTessellationBinner::close_block() {
  if (triangles_.empty()) return;
  const std::uint64_t address = buffer_.store_block(pack_block());
  blocks_.push_back({address, attribute_bytes_, names_.size() - triangles_.size()});
  counters_.vertices_stored += positions_.size();

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
  rectangles_.clear();
  tile_triangles_.clear();
  positions_.clear();
  all_grids_ = true;
  rectangle_vertex_ = 0;
}

// ---- Tile cores -------------------------------------------------------------------------------------------------

struct PostTessellationBinner::Reading {
  memory::LruCache cache;
  BurstBytes reads;
  const VisibleTriangles* visible;
  memory::Ledger ledger, uncached_ledger;
  std::uint64_t uncached = 0;  // of blocks, asked of the cache
  std::uint64_t filled = 0;    // into it
};

void PostTessellationBinner::read_block(const TileReference& reference, binner::TileIndex tile, Reading& reading) {
  const std::span<const std::uint8_t> memory = buffer_.memory();
  const BlockHead head = head_at(memory, reference.address);
  const Written& block = *std::prev(
      std::upper_bound(blocks_.begin(), blocks_.end(), reference.address,
                       [](std::uint64_t address, const Written& written) { return address < written.address; }));
  const auto triangles = triangles_at(memory, reference.address, head);
  std::bitset<kBlockVertices> used;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    if (!reference.triangles[t]) continue;
    if (head.coded && reading.visible != nullptr && !reading.visible->contains(tile, names_[block.first_name + t]))
      continue;
    for (const std::uint8_t v : triangles[t]) used.set(v);
  }
  // Bursts in rising order, each once per reference.
  std::uint64_t next = 0;
  const auto read = [&](std::uint64_t address, std::uint64_t bytes) {
    for (std::uint64_t line = std::max(next, address / burst_bytes_);
         bytes > 0 && line <= (address + bytes - 1) / burst_bytes_; ++line) {
      next = line + 1;
      reading.uncached += burst_bytes_;
      if (reading.cache.use(static_cast<std::uint32_t>(line), burst_bytes_)) continue;
      reading.ledger.read(memory::Unit::kTilecore, memory::Purpose::kTileQueue, burst_bytes_);
      reading.filled += burst_bytes_;
      reading.reads.add(line * burst_bytes_, burst_bytes_);
      counters_.queue_bytes_read += burst_bytes_;
    }
  };
  std::uint64_t vertices_at = reference.address + head.vertices_at;
  std::uint64_t vertex_bytes = kPositionBytes + block.attribute_bytes + (head.moving ? kSecondPositionBytes : 0);
  if (head.coded) {
    vertex_bytes = block.attribute_bytes;
    vertices_at += round_up(
        position_bytes(memory.subspan(vertices_at), head.vertices, head.moving ? kMovingWords : kStillWords), 4);
  }
  read(reference.address, vertices_at - reference.address);
  for (std::size_t v = 0; v < head.vertices; ++v)
    if (used[v]) read(vertices_at + v * vertex_bytes, vertex_bytes);
}

void PostTessellationBinner::read_tile(binner::TileIndex tile, Reading& reading) {
  const struct {
    std::uint64_t ledger, asked, filled;
  } before = {reading.ledger.total().read_bytes, reading.uncached, reading.filled};
  const std::vector<std::uint8_t> list =
      buffer_.read_list(tile, reading.ledger, counters_.queue_bytes_read, &reading.reads);
  std::uint64_t ignored = 0;
  buffer_.read_list(tile, reading.uncached_ledger, ignored);
  const std::span<const std::uint8_t> memory = buffer_.memory();
  ListWork& work = tiles_[tile];
  for (const TileReference& reference :
       decode_references(list, [&](std::uint64_t address) { return head_at(memory, address).triangles; })) {
    ++work.entries;
    read_block(reference, tile, reading);
  }
  work.bytes = reading.ledger.total().read_bytes - before.ledger;
  // Each burst of a block is asked of the cache, and filled into it where that lacks it.
  work.cache_bytes = reading.uncached - before.asked + reading.filled - before.filled;
}

void PostTessellationBinner::finish(const VisibleTriangles* visible, std::span<const std::uint64_t> state_bytes) {
  close_block();
  buffer_.finish();
  Reading reading{memory::LruCache(cache_bytes_), BurstBytes(burst_bytes_), visible, {}, {}, 0, 0};
  tiles_.assign(grid_.tile_count(), {});
  for (const binner::TileIndex tile : order_.tiles()) read_tile(tile, reading);
  const memory::Traffic written = buffer_.ledger().total();
  dram_bytes_ = written.read_bytes + written.written_bytes + reading.ledger.total().read_bytes;
  dram_bytes_uncached_ =
      written.read_bytes + written.written_bytes + reading.uncached_ledger.total().read_bytes + reading.uncached;
  counters_.queue_bytes_written = buffer_.bytes_written();
  counters_.queue_bytes_peak = buffer_.bytes_in_use();
  counters_.buffer_overflows = buffer_.overflows();
  counters_.domain_evaluations_cached = counters_.domain_evaluations;
  if (state_bytes.empty()) return;
  set_pressure(buffer_.pressure(reading.reads, state_bytes), counters_);
}

namespace {

class PostTessellation final : public Scheme {
 public:
  explicit PostTessellation(VertexStorage storage) : storage_(storage) {}

  void begin(const Pass& pass) override {
    pass_ = &pass;
    binner_.emplace(pass.gpu, *pass.job.grid, pass.job.frame->projection, storage_);
  }
  void add(const DrawnPatch& patch) override { binner_->add(patch.patch, patch.tiles); }
  SchemeResult finish(const DrawnPass& drawn) override {
    const bool apart = storage_ == VertexStorage::kSnapped;
    const GeometryCounts& geometry = drawn.geometry;
    binner_->finish(apart ? &drawn.drawn.visible : nullptr, drawn.tile_state_bytes);
    const std::uint64_t attributes = apart ? geometry.kept_attribute_bytes : geometry.attribute_bytes;
    SchemeResult out{list_counters(*binner_, drawn, geometry.tiles, attributes), {}};
    BaselineCounters& counters = out.counters;
    if (apart) {
      // Positions first; the rest for what setup keeps.
      counters.position_evaluations = geometry.vertices;
      counters.domain_evaluations = counters.domain_evaluations_cached = geometry.kept_vertices;
    }
    if (drawn.work == nullptr) return out;
    FrontWork before = front_work(counters, binner_->buffer(), geometry.tiles.patch_bytes_cached + attributes);
    before.vertices += counters.domain_evaluations;
    before.passes = apart ? 2 : 1;
    out.work = drawn.work->tiled(counters, before, binner_->tiles(), *pass_->job.grid);
    counters.texture_bytes = drawn.work->texture_bytes();
    return out;
  }

 private:
  VertexStorage storage_;
  const Pass* pass_ = nullptr;
  std::optional<PostTessellationBinner> binner_;
};

}  // namespace

std::unique_ptr<Scheme> make_post_tessellation() { return std::make_unique<PostTessellation>(VertexStorage::kFloats); }
std::unique_ptr<Scheme> make_post_position() { return std::make_unique<PostTessellation>(VertexStorage::kSnapped); }

}  // namespace tessera::baselines

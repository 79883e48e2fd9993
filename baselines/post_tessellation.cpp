#include "baselines/post_tessellation.h"

#include <algorithm>
#include <bitset>
#include <cstring>
#include <memory>
#include <optional>
#include <utility>

#include "base/check.h"
#include "base/round_up.h"
#include "baselines/block_reader.h"
#include "baselines/scheme_work.h"

namespace tessera::baselines {
namespace {

constexpr unsigned kPlacesBit = 0x2000u, kGridBit = 0x4000u, kMovingBit = 0x8000u, kIndexBytesMask = 0x1FFFu;
constexpr std::uint64_t kBlockPadding = 4;

// Sizes and offsets of the parts of a block.
struct BlockHead {
  std::size_t vertices, triangles, index_bytes;
  bool has_places, grids, moving;
  std::uint64_t places_at;  // relative to the block
};

BlockHead head_at(std::span<const std::uint8_t> memory, std::uint64_t address) {
  std::uint16_t field = 0;
  std::memcpy(&field, &memory[address + 6], sizeof field);
  const std::size_t bytes = field & kIndexBytesMask;
  return {memory[address + 4],
          memory[address + 5],
          bytes,
          (field & kPlacesBit) != 0,
          (field & kGridBit) != 0,
          (field & kMovingBit) != 0,
          kBlockHeadBytes + round_up(bytes, kBlockPadding)};
}

// Places of the vertices of a block; its own begin at offset `vertices_at`.
struct BlockPlaces {
  std::vector<std::optional<VertexPlace>> places;
  std::uint64_t vertices_at;
};

BlockPlaces places_at(std::span<const std::uint8_t> memory, std::uint64_t address, const BlockHead& head) {
  if (!head.has_places) return {std::vector<std::optional<VertexPlace>>(head.vertices), head.places_at};
  std::size_t bytes = 0;
  auto places = decode_places(memory.subspan(address + head.places_at), head.vertices, address, bytes);
  return {std::move(places), head.places_at + round_up(bytes, kBlockPadding)};
}

std::vector<BlockTriangle> triangles_at(std::span<const std::uint8_t> memory, std::uint64_t address,
                                        const BlockHead& head) {
  const auto bytes = memory.subspan(address + kBlockHeadBytes, head.index_bytes);
  return head.grids ? decode_grids(bytes, head.triangles) : decode_strip(bytes, head.triangles);
}

}  // namespace

PostTessellationBinner::PostTessellationBinner(const gpu::GpuConfiguration& gpu, const binner::TileGrid& grid,
                                               const scene::Projection& projection, VertexStorage storage,
                                               bool depths_alone)
    : grid_(grid),
      order_(gpu.tilecore.tile_order, grid),
      setup_(grid_, projection),
      buffer_(gpu, grid.tile_count()),
      storage_(storage),
      orthographic_(projection.orthographic),
      depths_alone_(depths_alone),
      burst_bytes_(static_cast<std::uint64_t>(gpu.memory.burst_bytes)),
      cache_bytes_(static_cast<std::uint64_t>(gpu.baselines.cache_bytes)),
      last_address_(grid.tile_count(), 0) {}

std::uint32_t PostTessellationBinner::number_of(const TessellatedPatch& patch, std::uint32_t vertex) const {
  return shares_draw_ ? patch.draw_numbers[vertex] : vertex;
}

void PostTessellationBinner::begin_patch(const TessellatedPatch& patch) {
  const bool shares = storage_ == VertexStorage::kEachDraw && !patch.draw_numbers.empty();
  if (!shares || !shares_draw_ || draw_state_ != patch.state) {
    ++index_buffer_;
    forget_numbers();
    drawn_.begin();
  }
  shares_draw_ = shares;
  draw_state_ = patch.state;
  const auto vertices = static_cast<std::uint32_t>(patch.x0.size());
  std::size_t numbers = vertices;
  if (shares && vertices > 0)
    numbers = std::size_t{*std::max_element(patch.draw_numbers.begin(), patch.draw_numbers.end())} + 1;
  number_.resize(std::max(number_.size(), numbers), kNoNumber);
  if (storage_ == VertexStorage::kEachBlock)
    counters_.domain_evaluations += patch.domain_evaluations;
  else
    for (std::uint32_t v = 0; v < vertices; ++v)
      if (drawn_.shade(number_of(patch, v))) ++counters_.position_evaluations;
}

void PostTessellationBinner::forget_numbers() {
  for (const std::uint32_t number : numbered_) number_[number] = kNoNumber;
  numbered_.clear();
}

bool PostTessellationBinner::fits(const TessellatedPatch& patch, const TriangleList& list, std::size_t first,
                                  std::size_t end) const {
  if (triangles_.empty()) return true;
  if (patch.state != state_ || triangles_.size() + (end - first) > kBlockTriangles) return false;
  std::vector<std::uint32_t> fresh;
  for (std::size_t t = first; t < end; ++t)
    for (const std::uint32_t v : list.triangles[t].vertex)
      if (const std::uint32_t number = number_of(patch, v); number_[number] == kNoNumber) fresh.push_back(number);
  std::sort(fresh.begin(), fresh.end());
  const auto distinct = static_cast<std::size_t>(std::unique(fresh.begin(), fresh.end()) - fresh.begin());
  return vertices_.size() + distinct <= kBlockVertices;
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
  rectangle_vertex_ = static_cast<std::uint8_t>(vertices_.size());
  const std::size_t cells = (patch.group_ends[group] - rectangle_begins_) / 2;
  rectangles_.push_back({columns, static_cast<std::uint8_t>(cells / columns), {}});
  TESSERA_CHECK(list.triangles[first].number >= rectangle_begins_, "the list and the patch have the same groups");
}

void PostTessellationBinner::add_triangle(const TessellatedPatch& patch, const TriangleList& list,
                                          std::size_t triangle) {
  const TriangleList::Triangle& t = list.triangles[triangle];
  BlockTriangle numbers;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint32_t v = t.vertex[k], named = number_of(patch, v);
    if (number_[named] == kNoNumber) {
      TESSERA_CHECK(vertices_.size() < kBlockVertices, "a group fits a block");
      number_[named] = static_cast<std::uint8_t>(vertices_.size());
      numbered_.push_back(named);
      BlockVertex& vertex = vertices_.emplace_back();
      vertex.position = {patch.x0[v], patch.y0[v], patch.z0[v]};
      if (moving_) vertex.position[3] = patch.x1[v], vertex.position[4] = patch.y1[v], vertex.position[5] = patch.z1[v];
      vertex.number = named;
      vertex.index_buffer = index_buffer_;
      if (storage_ == VertexStorage::kEachDraw) vertex.place = drawn_.place(named);
    }
    numbers[k] = number_[named];
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
  begin_patch(patch);
  std::size_t first = 0;
  for (std::size_t group = 0; group < list.group_ends.size(); ++group) {
    const std::size_t end = list.group_ends[group];
    if (end == first) continue;
    if (!fits(patch, list, first, end)) close_block();
    begin_group(patch, list, group, first);
    for (; first < end; ++first) add_triangle(patch, list, first);
  }
}

// Uses grids if they are smaller; vertices are then put in the order of grids.
std::vector<std::uint8_t> PostTessellationBinner::pack_indices(bool& grids) {
  std::vector<std::uint8_t> strip = encode_strip(triangles_);
  grids = false;
  if (!all_grids_) return strip;
  std::vector<std::uint8_t> bytes = encode_grids(rectangles_);
  if (bytes.size() >= strip.size()) return strip;
  grids = true;
  const std::vector<BlockTriangle> numbered = decode_grids(bytes, triangles_.size());
  std::vector<BlockVertex> sorted(vertices_.size());
  for (std::size_t t = 0; t < triangles_.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) sorted[numbered[t][k]] = vertices_[triangles_[t][k]];
  vertices_ = std::move(sorted);
  triangles_ = numbered;
  return bytes;
}

void PostTessellationBinner::put_position(const BlockVertex& vertex, std::uint8_t* at) const {
  for (std::size_t key = 0; key < (moving_ ? 2u : 1u); ++key) {
    const float* xyz = &vertex.position[3 * key];
    const float w = orthographic_ ? 1.0f : xyz[2];
    std::memcpy(at + key * kPositionBytes, xyz, 3 * sizeof(float));
    std::memcpy(at + key * kPositionBytes + 3 * sizeof(float), &w, sizeof w);
  }
}

// Appends the block's own vertices.
void PostTessellationBinner::pack_vertices(std::vector<std::uint8_t>& block) const {
  std::vector<const BlockVertex*> own;
  for (const BlockVertex& vertex : vertices_)
    if (!vertex.place) own.push_back(&vertex);
  const std::size_t first = block.size(), positions = position_bytes(moving_);
  block.resize(first + own.size() * (positions + attribute_bytes_), 0);
  for (std::size_t n = 0; n < own.size(); ++n)
    put_position(*own[n], &block[first + (storage_ == VertexStorage::kEachBlock ? n * (positions + attribute_bytes_)
                                                                                : (own.size() - 1 - n) * positions)]);
}

// Packs a block; `own_vertices_at` returns the offset of its own vertices.
std::vector<std::uint8_t> PostTessellationBinner::pack_block(std::uint64_t address, std::uint64_t& own_vertices_at) {
  bool grids = false;
  const std::vector<std::uint8_t> indices = pack_indices(grids);
  std::vector<std::optional<VertexPlace>> places;
  for (const BlockVertex& vertex : vertices_) places.push_back(vertex.place);
  const bool shares = std::any_of(places.begin(), places.end(), [](const auto& place) { return place.has_value(); });
  std::vector<std::uint8_t> block(kBlockHeadBytes + round_up(indices.size(), kBlockPadding), 0);
  const auto field = static_cast<std::uint16_t>(indices.size() | (moving_ ? kMovingBit : 0u) | (grids ? kGridBit : 0u) |
                                                (shares ? kPlacesBit : 0u));
  std::memcpy(block.data(), &state_, sizeof state_);
  block[4] = static_cast<std::uint8_t>(vertices_.size());
  block[5] = static_cast<std::uint8_t>(triangles_.size());
  std::memcpy(&block[6], &field, sizeof field);
  std::memcpy(&block[kBlockHeadBytes], indices.data(), indices.size());
  if (shares) {
    const std::vector<std::uint8_t> bytes = encode_places(places, address);
    block.insert(block.end(), bytes.begin(), bytes.end());
    block.resize(round_up(block.size(), kBlockPadding), 0);
  }
  own_vertices_at = block.size();
  pack_vertices(block);
  return block;
}

// Remembers the places of the block's own vertices: later blocks of the current index buffer may name them.
void PostTessellationBinner::keep_places(std::uint64_t own_vertices_at) {
  const auto own = static_cast<std::uint64_t>(
      std::count_if(vertices_.begin(), vertices_.end(), [](const BlockVertex& vertex) { return !vertex.place; }));
  counters_.vertices_stored += own;
  if (storage_ == VertexStorage::kEachBlock) return;
  if (!depths_alone_ || attribute_bytes_ > 0) counters_.domain_evaluations += own;
  VertexPlace next{own_vertices_at + own * position_bytes(moving_), 0};
  for (const BlockVertex& vertex : vertices_) {
    if (vertex.place) continue;
    if (vertex.index_buffer == index_buffer_) drawn_.store(vertex.number, next);
    ++next.place;
  }
}

void PostTessellationBinner::close_block() {
  if (triangles_.empty()) return;
  std::uint64_t own_vertices_at = 0;
  const std::uint64_t address = buffer_.next_block();
  buffer_.store_block(pack_block(address, own_vertices_at));
  keep_places(address + own_vertices_at);
  blocks_.push_back({address, attribute_bytes_, names_.size() - triangles_.size()});

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
  vertices_.clear();
  forget_numbers();
  all_grids_ = true;
  rectangle_vertex_ = 0;
}

// ---- Tile cores -------------------------------------------------------------------------------------------------

struct PostTessellationBinner::Reading : BlockReader {
  Reading(std::uint64_t burst_bytes, std::uint64_t cache_bytes, const VisibleTriangles* seen)
      : BlockReader(burst_bytes, cache_bytes), visible(seen) {}

  const VisibleTriangles* visible;
  memory::Ledger uncached_ledger;
};

// Reads head, indices and places; positions of the tile's triangles, or whole vertices; attributes of visible triangles.
void PostTessellationBinner::read_block(const TileReference& reference, binner::TileIndex tile, Reading& reading) {
  const std::span<const std::uint8_t> memory = buffer_.memory();
  const BlockHead head = head_at(memory, reference.address);
  const Written& block = *std::prev(
      std::upper_bound(blocks_.begin(), blocks_.end(), reference.address,
                       [](std::uint64_t address, const Written& written) { return address < written.address; }));
  const auto triangles = triangles_at(memory, reference.address, head);
  std::bitset<kBlockVertices> tested, shaded;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    if (!reference.triangles[t]) continue;
    const bool visible = reading.visible == nullptr || reading.visible->contains(tile, names_[block.first_name + t]);
    for (const std::uint8_t v : triangles[t]) {
      tested.set(v);
      if (visible) shaded.set(v);
    }
  }
  const BlockPlaces places = places_at(memory, reference.address, head);
  const std::uint64_t positions = position_bytes(head.moving), own_at = reference.address + places.vertices_at;
  reading.ask(reference.address, places.vertices_at);
  if (storage_ == VertexStorage::kEachBlock) {
    for (std::size_t v = 0; v < head.vertices; ++v)
      if (tested[v]) reading.ask(own_at + v * (positions + block.attribute_bytes), positions + block.attribute_bytes);
  } else {
    const auto own = static_cast<std::uint64_t>(std::count(places.places.begin(), places.places.end(), std::nullopt));
    VertexPlace next{own_at + own * positions, 0};
    for (std::size_t v = 0; v < head.vertices; ++v) {
      const VertexPlace at = places.places[v].value_or(next);
      if (!places.places[v]) ++next.place;
      if (tested[v]) reading.ask(at.middle - (at.place + std::uint64_t{1}) * positions, positions);
      if (shaded[v]) reading.ask(at.middle + at.place * block.attribute_bytes, block.attribute_bytes);
    }
  }
  counters_.queue_bytes_read += reading.read_asked();
}

void PostTessellationBinner::read_tile(binner::TileIndex tile, Reading& reading) {
  const struct {
    std::uint64_t ledger, asked, filled;
  } before = {reading.ledger.total().read_bytes, reading.asked_bytes(), reading.filled_bytes()};
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
  // Each burst of a block is asked of the cache, and filled into it on a miss.
  work.cache_bytes = reading.asked_bytes() - before.asked + reading.filled_bytes() - before.filled;
}

void PostTessellationBinner::finish(const VisibleTriangles* visible, std::span<const std::uint64_t> state_bytes) {
  close_block();
  buffer_.finish();
  Reading reading(burst_bytes_, cache_bytes_, visible);
  tiles_.assign(grid_.tile_count(), {});
  for (const binner::TileIndex tile : order_.tiles()) read_tile(tile, reading);
  const memory::Traffic written = buffer_.ledger().total();
  dram_bytes_ = written.read_bytes + written.written_bytes + reading.ledger.total().read_bytes;
  dram_bytes_uncached_ =
      written.read_bytes + written.written_bytes + reading.uncached_ledger.total().read_bytes + reading.asked_bytes();
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
    binner_.emplace(pass.gpu, *pass.job.grid, pass.job.frame->projection, storage_, !pass.job.shades());
  }
  void add(const DrawnPatch& patch) override { binner_->add(patch.patch, patch.tiles); }
  SchemeResult finish(const DrawnPass& drawn) override {
    const bool apart = storage_ == VertexStorage::kEachDraw;
    const GeometryCounts& geometry = drawn.geometry;
    binner_->finish(apart ? &drawn.drawn.visible : nullptr, drawn.tile_state_bytes);
    const std::uint64_t attributes = apart ? geometry.kept_attribute_bytes : geometry.attribute_bytes;
    SchemeResult out{list_counters(*binner_, drawn, geometry.tiles, attributes), {}};
    BaselineCounters& counters = out.counters;
    if (drawn.work == nullptr) return out;
    FrontWork before = front_work(counters, binner_->buffer(), geometry.tiles.patch_bytes_cached + attributes);
    before.vertices += counters.domain_evaluations;
    before.whole = counters.domain_evaluations;
    before.passes = apart && before.whole > 0 ? 2 : 1;
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

std::unique_ptr<Scheme> make_post_tessellation() {
  return std::make_unique<PostTessellation>(VertexStorage::kEachBlock);
}
std::unique_ptr<Scheme> make_post_position() { return std::make_unique<PostTessellation>(VertexStorage::kEachDraw); }

}  // namespace tessera::baselines

#include "baselines/mesh_shader.h"

#include <algorithm>
#include <bitset>
#include <cstring>
#include <memory>

#include "base/bit_stream.h"
#include "base/round_up.h"
#include "baselines/post_tessellation.h"
#include "frontend/patch_record.h"

namespace tessera::baselines {
namespace {

constexpr std::uint64_t kSlotBytes = 16, kWordBytes = 4, kCompactHeadBytes = 4;

// Place of each triangle of the patch in TriangleList::triangles.
std::vector<std::uint32_t> places_in(const TessellatedPatch& patch, const TriangleList& list) {
  std::vector<std::uint32_t> places(patch.triangles.size(), 0);
  for (std::size_t k = 0; k < list.triangles.size(); ++k)
    places[list.triangles[k].number] = static_cast<std::uint32_t>(k);
  return places;
}

std::span<const binner::TileIndex> tiles_of(const TriangleList& list, std::size_t place) {
  const std::uint32_t first = place == 0 ? 0 : list.triangles[place - 1].tiles_end;
  return std::span(list.tiles).subspan(first, list.triangles[place].tiles_end - first);
}

struct TileTriangle {
  binner::TileIndex tile;
  std::uint32_t triangle;  // number in the meshlet
  auto operator<=>(const TileTriangle&) const = default;
};

// The tiles that a meshlet's triangles may touch, in order.
std::vector<TileTriangle> touched_tiles(const Meshlet& meshlet, const TriangleList& list,
                                        std::span<const std::uint32_t> places) {
  std::vector<TileTriangle> touched;
  for (std::uint32_t t = 0; t < meshlet.numbers.size(); ++t) {
    if (list.fates[meshlet.numbers[t]] != TriangleFate::kKept) continue;
    for (const binner::TileIndex tile : tiles_of(list, places[meshlet.numbers[t]])) touched.push_back({tile, t});
  }
  std::sort(touched.begin(), touched.end());
  return touched;
}

}  // namespace

MeshletBinner::MeshletBinner(const gpu::GpuConfiguration& gpu, const binner::TileGrid& grid, MeshStorage storage)
    : storage_(storage),
      order_(gpu.tilecore.tile_order, grid),
      buffer_(gpu, grid.tile_count()),
      burst_bytes_(static_cast<std::uint64_t>(gpu.memory.burst_bytes)),
      cache_bytes_(static_cast<std::uint64_t>(gpu.baselines.cache_bytes)),
      tiles_(grid.tile_count()),
      last_(grid.tile_count(), 0) {}

MeshletBinner::Layout MeshletBinner::layout(MeshStorage storage, std::size_t vertices, std::size_t triangles,
                                            bool moving, std::uint64_t attribute_bytes) {
  const bool ring = storage == MeshStorage::kRing;
  const std::uint64_t room = ring ? kMeshletVertices : vertices;
  Layout out{};
  out.positions = ring ? 0 : kCompactHeadBytes;
  out.position_bytes = kPositionBytes * (moving ? 2 : 1);
  out.attributes = out.positions + room * out.position_bytes;
  out.attribute_bytes = ring ? round_up(attribute_bytes, kSlotBytes) : attribute_bytes;
  out.indices = out.attributes + room * out.attribute_bytes;
  out.triangle_bytes = ring ? 4 * kWordBytes : 3;
  out.bytes = round_up(out.indices + (ring ? kMeshletTriangles : triangles) * out.triangle_bytes, kWordBytes);
  return out;
}

void MeshletBinner::store(const TessellatedPatch& patch, const Meshlet& meshlet) {
  const Layout at =
      layout(storage_, meshlet.vertices.size(), meshlet.triangles.size(), patch.moving, patch.attribute_bytes);
  std::vector<std::uint8_t> record(at.bytes, 0);
  if (storage_ == MeshStorage::kCompact) {
    record[0] = static_cast<std::uint8_t>(meshlet.vertices.size());
    record[1] = static_cast<std::uint8_t>(meshlet.triangles.size());
    record[2] = patch.moving ? 1 : 0;
  }
  for (std::size_t n = 0; n < meshlet.vertices.size(); ++n) {
    const std::uint32_t v = meshlet.vertices[n];
    const auto put = [&](std::uint64_t key, float x, float y, float z) {
      const std::array<float, 4> position = {x, y, z, z};
      std::memcpy(&record[at.positions + n * at.position_bytes + key * kPositionBytes], position.data(),
                  kPositionBytes);
    };
    put(0, patch.x0[v], patch.y0[v], patch.z0[v]);
    if (patch.moving) put(1, patch.x1[v], patch.y1[v], patch.z1[v]);
  }
  const std::uint64_t index_bytes = storage_ == MeshStorage::kRing ? kWordBytes : 1;
  for (std::size_t t = 0; t < meshlet.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k)
      record[at.indices + t * at.triangle_bytes + k * index_bytes] = meshlet.triangles[t][k];
  const std::uint64_t address = buffer_.store_block(record);
  stored_.push_back({address, at, triangles_.size(), meshlet.triangles.size()});
  if (storage_ == MeshStorage::kRing)
    read_to_bin_bytes_ +=
        memory::burst_bytes(address + at.positions, meshlet.vertices.size() * at.position_bytes, burst_bytes_) +
        memory::burst_bytes(address + at.indices, meshlet.triangles.size() * at.triangle_bytes, burst_bytes_);
  triangles_.insert(triangles_.end(), meshlet.triangles.begin(), meshlet.triangles.end());
  for (const std::uint32_t t : meshlet.numbers)
    names_.push_back(patch.triangle_numbers.empty() ? 0 : triangle_name(patch.number, patch.triangle_numbers[t]));
  counters_.vertices_stored += meshlet.vertices.size();
}

void MeshletBinner::add(const TessellatedPatch& patch, std::span<const Meshlet> meshlets, const TriangleList& list) {
  const std::vector<std::uint32_t> places = places_in(patch, list);
  std::vector<std::uint8_t> bytes;
  for (const Meshlet& meshlet : meshlets) {
    const std::uint64_t number = stored_.size();
    store(patch, meshlet);
    const std::vector<TileTriangle> touched = touched_tiles(meshlet, list, places);
    for (std::size_t k = 0; k < touched.size();) {
      const binner::TileIndex tile = touched[k].tile;
      std::bitset<kBlockTriangles> triangles;
      for (; k < touched.size() && touched[k].tile == tile; ++k) triangles.set(touched[k].triangle);
      bytes.clear();
      put_number(number - last_[tile], bytes);
      encode_triangles(triangles, meshlet.triangles.size(), bytes);
      last_[tile] = number;
      buffer_.append(tile, bytes);
      ++counters_.entries;
    }
  }
}

void MeshletBinner::read_tile(binner::TileIndex tile, const VisibleTriangles* visible, BlockReader& blocks) {
  const std::uint64_t read = blocks.ledger.total().read_bytes, asked = blocks.asked_bytes(),
                      filled = blocks.filled_bytes();
  const std::vector<std::uint8_t> list =
      buffer_.read_list(tile, blocks.ledger, counters_.queue_bytes_read, &blocks.reads);
  ListWork& work = tiles_[tile];
  std::uint64_t number = 0;
  for (std::size_t at = 0; at < list.size();) {
    number += get_number(list, at);
    const Stored& stored = stored_[number];
    const auto triangles = decode_triangles(list, stored.triangle_count, at);
    const Layout& part = stored.layout;
    std::bitset<kMeshletVertices> tested, shaded;
    for (std::size_t t = 0; t < stored.triangle_count; ++t) {
      if (!triangles[t]) continue;
      blocks.ask(stored.address + part.indices + t * part.triangle_bytes, part.triangle_bytes);
      const bool seen = visible == nullptr || visible->contains(tile, names_[stored.first_triangle + t]);
      for (const std::uint8_t v : triangles_[stored.first_triangle + t]) {
        tested.set(v);
        if (seen) shaded.set(v);
      }
    }
    for (std::size_t v = 0; v < kMeshletVertices; ++v) {
      if (tested[v]) blocks.ask(stored.address + part.positions + v * part.position_bytes, part.position_bytes);
      if (shaded[v]) blocks.ask(stored.address + part.attributes + v * part.attribute_bytes, part.attribute_bytes);
    }
    counters_.queue_bytes_read += blocks.read_asked();
    ++work.entries;
  }
  work.bytes = blocks.ledger.total().read_bytes - read;
  work.cache_bytes = blocks.asked_bytes() - asked + blocks.filled_bytes() - filled;
}

void MeshletBinner::finish(const VisibleTriangles* visible, std::span<const std::uint64_t> state_bytes) {
  buffer_.finish();
  BlockReader blocks(burst_bytes_, cache_bytes_);
  for (const binner::TileIndex tile : order_.tiles()) read_tile(tile, visible, blocks);
  const memory::Traffic written = buffer_.ledger().total();
  const std::uint64_t moved =
      written.read_bytes + written.written_bytes + read_to_bin_bytes_ + blocks.ledger.total().read_bytes;
  dram_bytes_ = moved;
  dram_bytes_uncached_ = moved - blocks.filled_bytes() + blocks.asked_bytes();
  counters_.queue_bytes_written = buffer_.bytes_written();
  counters_.queue_bytes_read += read_to_bin_bytes_;
  counters_.queue_bytes_peak = buffer_.bytes_in_use();
  counters_.buffer_overflows = buffer_.overflows();
  counters_.domain_evaluations = counters_.domain_evaluations_cached = counters_.vertices_stored;
  if (!state_bytes.empty()) set_pressure(buffer_.pressure(blocks.reads, state_bytes), counters_);
}

void MeshReferenceBinner::add(const TessellatedPatch& patch, std::span<const Meshlet> meshlets,
                              const TriangleList& list) {
  const std::vector<std::uint32_t> places = places_in(patch, list);
  TriangleList whole;  // all triangles of each meshlet, in each tile that it touches
  for (const Meshlet& meshlet : meshlets) {
    std::vector<std::uint8_t> reference(meshlet.part ? kPartBytes : kReferenceBytes, 0);
    const std::uint32_t number = meshlets_++;
    std::memcpy(reference.data(), &number, sizeof number);
    std::vector<binner::TileIndex> tiles;
    for (const TileTriangle& touched : touched_tiles(meshlet, list, places))
      if (tiles.empty() || tiles.back() != touched.tile) tiles.push_back(touched.tile);
    for (const binner::TileIndex tile : tiles) {
      lists_.append(tile, reference);
      lists_.count_entry(tile);
      ++lists_.counters().entries;
    }
    for (const std::uint32_t t : meshlet.numbers) {
      whole.tiles.insert(whole.tiles.end(), tiles.begin(), tiles.end());
      whole.triangles.push_back({patch.triangles[t], t, static_cast<std::uint32_t>(whole.tiles.size())});
    }
  }
  lists_.reshading().add(patch, whole);
}

namespace {

// The common part of the three machines: task shaders and the triangles that they keep.
class MeshShaderScheme : public Scheme {
 public:
  void begin(const Pass& pass) override {
    pass_ = &pass;
    setup_.emplace(*pass.job.grid, pass.job.frame->projection);
    task_.emplace(*setup_, pass.depths);
  }
  void add(const DrawnPatch& drawn) override {
    const TessellatedPatch& patch = drawn.patch;
    const std::vector<Meshlet> meshlets = task_->run(patch, drawn.tiles);
    PatchWork work{patch.number, 0, 0};
    const std::vector<std::uint32_t> places = places_in(patch, drawn.tiles);
    for (const Meshlet& meshlet : meshlets) {
      work.vertices += meshlet.vertices.size(), work.triangles += meshlet.numbers.size();
      mesh_.setup.tile_overlaps += touched_tiles(meshlet, drawn.tiles, places).size();
      for (const std::uint32_t t : meshlet.numbers) count(drawn.tiles.fates[t], mesh_.setup);
    }
    if (meshlets.empty()) {
      const scene::FrameGeometry& frame = *pass_->job.frame;
      if (frontend::resting_bound(frame, patch.number) != nullptr)
        mesh_.unread_bytes +=
            memory::burst_bytes(0, frontend::patch_record_bytes(frame, patch.number), pass_->job.burst_bytes());
      return;
    }
    mesh_.patches.push_back(work);
    mesh_.vertices += work.vertices;
    mesh_.attribute_bytes += patch.stored_attribute_bytes;
    bin(patch, meshlets, drawn.tiles);
  }

 protected:
  virtual void bin(const TessellatedPatch& patch, std::span<const Meshlet> meshlets, const TriangleList& list) = 0;

  // Counters of hull stage and set-up, with the meshlets that task shaders kept.
  BaselineCounters geometry(const DrawnPass& drawn) const {
    BaselineCounters out = mesh_.setup;
    const BaselineCounters& hull = drawn.geometry.tiles;
    out.patches_culled = hull.patches_culled;
    out.bounding_operations = hull.bounding_operations + task_->counts().parts;
    out.patch_bytes = hull.patch_bytes - mesh_.unread_bytes;
    out.patch_bytes_cached = hull.patch_bytes_cached - mesh_.unread_bytes;
    return out;
  }
  std::uint64_t pyramid_bytes() const {
    return memory::burst_bytes(0, pass_->depths.bytes(), pass_->job.burst_bytes());
  }
  // Adds the traffic of two pyramids of depths: this frame's, for the next frame, and the previous frame's.
  void add_pyramid(BaselineCounters& counters) const {
    const std::uint64_t bytes = pyramid_bytes();
    counters.culled_occlusion = task_->counts().hidden;
    counters.frame_bytes_read += bytes;
    counters.frame_bytes_written += bytes;
    counters.dram_bytes += 2 * bytes;
    counters.dram_bytes_uncached += 2 * bytes;
  }
  FrontWork front(const BaselineCounters& counters, const TriangleBuffer& buffer, const BaselineCounters& geometry,
                  const DrawnPass& drawn) const {
    FrontWork out = front_work(counters, buffer, geometry.patch_bytes_cached + pyramid_bytes());
    out.vertices = mesh_.vertices;
    out.patches = &mesh_.patches;
    out.instructions = task_->counts().instructions(drawn.geometry.tiles.bounding_operations);
    out.lookups = task_->counts().lookups;
    out.bounds_on_lanes = true;
    return out;
  }

  const Pass* pass_ = nullptr;
  std::optional<TriangleSetup> setup_;
  std::optional<TaskShader> task_;
  MeshPass mesh_;
};

class MeshShaderStored final : public MeshShaderScheme {
 public:
  explicit MeshShaderStored(MeshStorage storage) : storage_(storage) {}
  void begin(const Pass& pass) override {
    MeshShaderScheme::begin(pass);
    binner_.emplace(pass.gpu, *pass.job.grid, storage_);
  }
  SchemeResult finish(const DrawnPass& drawn) override {
    binner_->finish(&drawn.drawn.visible, drawn.tile_state_bytes);
    const BaselineCounters geometry = this->geometry(drawn);
    SchemeResult out{list_counters(*binner_, drawn, geometry, mesh_.attribute_bytes), {}};
    add_pyramid(out.counters);
    if (drawn.work == nullptr) return out;
    FrontWork before = front(out.counters, binner_->buffer(), geometry, drawn);
    before.whole = before.vertices;
    before.read_bytes += mesh_.attribute_bytes + binner_->read_to_bin_bytes();
    before.instructions += binner_->copy_instructions();
    out.work = drawn.work->tiled(out.counters, before, binner_->tiles(), *pass_->job.grid);
    out.counters.texture_bytes = drawn.work->texture_bytes();
    return out;
  }

 private:
  void bin(const TessellatedPatch& patch, std::span<const Meshlet> meshlets, const TriangleList& list) override {
    binner_->add(patch, meshlets, list);
  }

  MeshStorage storage_;
  std::optional<MeshletBinner> binner_;
};

class MeshShaderReferences final : public MeshShaderScheme {
 public:
  void begin(const Pass& pass) override {
    MeshShaderScheme::begin(pass);
    binner_.emplace(pass.gpu, *pass.job.grid);
  }
  SchemeResult finish(const DrawnPass& drawn) override {
    binner_->finish(drawn.tile_state_bytes);
    const BaselineCounters geometry = this->geometry(drawn);
    SchemeResult out{list_counters(binner_->lists(), drawn, geometry, 0), {}};
    add_pyramid(out.counters);
    out.counters.position_evaluations = mesh_.vertices;
    if (drawn.work == nullptr) return out;
    const FrontWork before = front(out.counters, binner_->lists().buffer(), geometry, drawn);
    out.work = drawn.work->tiled(out.counters, before, binner_->lists().tiles(), *pass_->job.grid);
    out.counters.texture_bytes = drawn.work->texture_bytes();
    return out;
  }

 private:
  void bin(const TessellatedPatch& patch, std::span<const Meshlet> meshlets, const TriangleList& list) override {
    binner_->add(patch, meshlets, list);
  }

  std::optional<MeshReferenceBinner> binner_;
};

}  // namespace

std::unique_ptr<Scheme> make_mesh_shader_ring() { return std::make_unique<MeshShaderStored>(MeshStorage::kRing); }
std::unique_ptr<Scheme> make_mesh_shader_compact() { return std::make_unique<MeshShaderStored>(MeshStorage::kCompact); }
std::unique_ptr<Scheme> make_mesh_shader_references() { return std::make_unique<MeshShaderReferences>(); }

}  // namespace tessera::baselines

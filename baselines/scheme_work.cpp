#include "baselines/scheme_work.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "base/round_up.h"
#include "hardware/energy.h"
#include "tilecore/tile_order.h"
#include "timing/timing_model.h"

namespace tessera::baselines {
namespace {

using timing::Event;
using timing::Phase;
using timing::TileWork;

constexpr std::uint64_t kColorAndDepthBytes = 8;  // of a sample, in tiles of conventional machines
constexpr auto kVisibility = static_cast<std::size_t>(Phase::kVisibility),
               kShading = static_cast<std::size_t>(Phase::kShading), kStore = static_cast<std::size_t>(Phase::kStore);

// Parts of a whole in proportion to weights; together they are the whole.
class Parts {
 public:
  Parts(std::uint64_t whole, std::uint64_t weights) : whole_(whole), weights_(weights) {}
  std::uint64_t next(std::uint64_t weight) {
    seen_ += weight;
    const std::uint64_t upto =
        weights_ == 0 || seen_ == weights_
            ? whole_
            : static_cast<std::uint64_t>(static_cast<double>(whole_) * static_cast<double>(seen_) /
                                         static_cast<double>(weights_));
    const std::uint64_t part = std::max(upto, given_) - given_;
    given_ += part;
    return part;
  }

 private:
  std::uint64_t whole_, weights_, seen_ = 0, given_ = 0;
};

// `count` of `of`, as `whole` is to `of`, rounded.
std::uint64_t scaled(std::uint64_t whole, std::uint64_t count, std::uint64_t of) {
  return of == 0 ? 0 : (whole * count + of / 2) / of;
}

// Events that every scheme has as the machine has them: of what is visible, and of the finished frame.
void add_shading(const TileWork& from, TileWork& to) {
  for (const Event event :
       {Event::kAlphaTests, Event::kCompactedSamples, Event::kShaderInvocations, Event::kShaderLanes, Event::kTexels,
        Event::kBlendedLayers, Event::kPixels, Event::kResolveOperations})
    to.events[event] += from.events[event];
}

std::uint64_t pixels_of(const binner::TileGrid& grid, binner::TileIndex tile) {
  const IntRect pixels = grid.pixels(tile);
  return static_cast<std::uint64_t>(pixels.width()) * static_cast<std::uint64_t>(pixels.height());
}

}  // namespace

std::uint64_t SchemeWork::immediate_texture_bytes() const {
  std::uint64_t bytes = 0;
  for (const DrawnInTile& drawn : drawn_.order) {
    TileWork work;
    add_drawn(drawn, work);
    bytes += work.dram_bytes[kVisibility] + work.dram_bytes[kShading];
  }
  return bytes;
}

std::uint64_t SchemeWork::texture_bytes() const {
  std::uint64_t bytes = 0;
  for (const gpu::TextureUse& tile : textures_) bytes += tile.visibility_bytes + tile.shading_bytes;
  return bytes;
}

SchemeWork::SchemeWork(const gpu::GpuConfiguration& gpu, const tilecore::TileJob& job, const MachineWork& machine,
                       const GeometryCounts& geometry, const ImmediateFrame& drawn)
    : gpu_(gpu),
      job_(job),
      geometry_(geometry),
      drawn_(drawn),
      textures_(machine.textures),
      order_(tilecore::TileOrder(gpu.tilecore.tile_order, *job.grid).tiles()),
      own_(job.grid->tile_count()),
      samples_(static_cast<std::uint64_t>(job.pattern->samples_per_pixel())) {
  for (const timing::WorkRound& round : machine.work.rounds)
    for (const TileWork& tile : round.tiles) add_shading(tile, own_[tile.tile].work);
  for (const PatchInTile& part : geometry.in_tiles) own_[part.tile].stamps += part.stamps;
  for (const DrawnInTile& part : drawn.order) {
    OwnTile& own = own_[part.tile];
    own.hits += part.hits;
    own.depth_tests += part.depth_tests;
    own.blocks_scanned += part.blocks_scanned;
  }
}

std::uint64_t SchemeWork::lanes(std::uint64_t stamps, std::uint64_t hits, std::uint64_t depth_tests) const {
  const std::uint64_t all = stamps * TriangleSetup::kStampSide * TriangleSetup::kStampSide * samples_;
  return hits == 0 ? all : scaled(all, depth_tests, hits);
}

timing::GeometryWork SchemeWork::hull_stage(const BaselineCounters& scheme) const {
  timing::GeometryWork work;
  work.patches = std::max<std::uint64_t>(geometry_.patches.size(), 1);
  work.events[Event::kBounds] = scheme.bounding_operations;
  return work;
}

std::vector<std::uint64_t> SchemeWork::by_pixels(std::uint64_t bytes) const {
  std::uint64_t all = 0;
  for (const binner::TileIndex tile : order_) all += pixels_of(*job_.grid, tile);
  Parts parts(bytes, all);
  std::vector<std::uint64_t> out;
  for (const binner::TileIndex tile : order_) out.push_back(parts.next(pixels_of(*job_.grid, tile)));
  return out;
}

timing::FrameWork SchemeWork::tiled(const BaselineCounters& scheme, const FrontWork& front,
                                    std::span<const ListWork> lists, const binner::TileGrid& bins) const {
  timing::FrameWork work;
  work.tile_state_bytes = static_cast<std::uint64_t>(job_.grid->tile_width()) *
                          static_cast<std::uint64_t>(job_.grid->tile_height()) * samples_ * kColorAndDepthBytes;
  timing::WorkRound& round = work.rounds.emplace_back();
  round.geometry = hull_stage(scheme);
  round.geometry.events[Event::kBinnedEntries] = scheme.entries;
  round.geometry.events[Event::kTestedTiles] = scheme.tile_overlaps;
  round.geometry.dram_bytes = front.read_bytes + front.written_bytes;
  round.geometry.written_bytes = front.written_bytes;
  round.geometry.queue_bytes = scheme.queue_bytes_peak;
  round.geometry.events[Event::kVertices] = front.vertices;
  round.geometry.events[Event::kTriangles] =
      scheme.primitives + scheme.culled_frustum + scheme.culled_backface + scheme.culled_zero_area;

  const std::vector<ListWork> of_tile = spread(lists, bins);
  const std::vector<std::uint64_t> stored = by_pixels(scheme.frame_bytes_written);
  const auto line_bytes = static_cast<std::uint64_t>(gpu_.line_bytes());
  for (std::size_t k = 0; k < order_.size(); ++k) {
    const binner::TileIndex tile = order_[k];
    const OwnTile& own = own_[tile];
    const ListWork& list = of_tile[tile];
    const gpu::TextureUse& textures = textures_[tile];
    TileWork& out = round.tiles.emplace_back(own.work);
    out.tile = tile;
    out.events[Event::kFetchedEntries] = front.fetches_entries ? list.entries : 0;
    out.sub_patches = std::max<std::uint64_t>(list.entries, list.triangles > 0 ? 1 : 0);
    out.events[Event::kVertices] = list.vertices;
    out.events[Event::kTransforms] = list.transforms;
    out.events[Event::kBoxes] = list.triangles;
    out.events[Event::kTriangleTests] = out.events[Event::kTriangleLanes] =
        lanes(own.stamps, own.hits, own.depth_tests);
    out.events[Event::kHits] = own.depth_tests;
    out.events[Event::kDepthBlocks] = own.blocks_scanned;
    out.events[Event::kL2Lines] = textures.l2_lines + (list.cache_bytes + line_bytes - 1) / line_bytes;
    out.dram_bytes[kVisibility] = list.bytes + textures.visibility_bytes;
    out.dram_bytes[kShading] = textures.shading_bytes;
    out.dram_bytes[kStore] = stored[k];
  }
  return work;
}

std::vector<ListWork> SchemeWork::spread(std::span<const ListWork> lists, const binner::TileGrid& bins) const {
  const binner::TileGrid& grid = *job_.grid;
  std::vector<ListWork> out(own_.size());
  for (binner::TileIndex bin = 0; bin < lists.size(); ++bin) {
    const IntRect pixels = bins.pixels(bin);
    const IntRect tiles = {(pixels.x0 - grid.column_edge(0)) / grid.tile_width(),
                           (pixels.y0 - grid.row_edge(0)) / grid.tile_height(),
                           (pixels.x1 - grid.column_edge(0) - 1) / grid.tile_width() + 1,
                           (pixels.y1 - grid.row_edge(0) - 1) / grid.tile_height() + 1};
    const auto count = static_cast<std::uint64_t>(tiles.width()) * static_cast<std::uint64_t>(tiles.height());
    for (const auto member : {&ListWork::entries, &ListWork::triangles, &ListWork::vertices, &ListWork::transforms,
                              &ListWork::bytes, &ListWork::cache_bytes}) {
      Parts parts(lists[bin].*member, count);
      for (int row = tiles.y0; row < tiles.y1; ++row)
        for (int column = tiles.x0; column < tiles.x1; ++column) out[grid.index(column, row)].*member += parts.next(1);
    }
  }
  return out;
}

void SchemeWork::add_drawn(const DrawnInTile& drawn, TileWork& batch) const {
  const OwnTile& own = own_[drawn.tile];
  const gpu::TextureUse& textures = textures_[drawn.tile];
  const std::uint64_t shaded = own.work.events[Event::kShaderInvocations];
  const auto of_tile = [&](std::uint64_t whole) { return scaled(whole, drawn.invocations, shaded); };
  batch.events[Event::kHits] += drawn.depth_tests;
  batch.events[Event::kDepthBlocks] += drawn.blocks_scanned;
  batch.events[Event::kAlphaTests] += of_tile(own.work.events[Event::kAlphaTests]);
  batch.events[Event::kCompactedSamples] += drawn.invocations;
  batch.events[Event::kShaderInvocations] += drawn.invocations;
  batch.events[Event::kBlendedLayers] += drawn.blended;
  batch.events[Event::kTexels] += of_tile(own.work.events[Event::kTexels]);
  batch.events[Event::kL2Lines] += of_tile(textures.l2_lines);
  batch.dram_bytes[kVisibility] += of_tile(textures.visibility_bytes);
  batch.dram_bytes[kShading] += of_tile(textures.shading_bytes);
}

// What is drawn in its order, cut into batches. A patch that nothing is left of is shaded and set up with the next.
std::vector<TileWork> SchemeWork::batches(std::uint64_t patch_bytes) const {
  constexpr std::uint64_t kBatchTriangles = 512;
  const std::uint64_t max_samples = static_cast<std::uint64_t>(job_.grid->tile_width()) *
                                    static_cast<std::uint64_t>(job_.grid->tile_height()) * samples_;
  std::uint64_t vertices = 0;
  for (const PatchWork& patch : geometry_.patches) vertices += patch.vertices;
  Parts records(patch_bytes, vertices);
  std::vector<TileWork> out(1);
  std::uint64_t set_up = 0, tested = 0, read = 0, written = 0;
  std::size_t part = 0, drawn = 0;
  const auto add_next = [&] {
    const ImmediateTraffic& moved = drawn_.moved[drawn];
    TileWork& batch = out.back();
    add_drawn(drawn_.order[drawn], batch);
    tested += drawn_.order[drawn].depth_tests;
    batch.dram_bytes[kVisibility] += moved.bytes_read - read;
    batch.dram_bytes[kStore] += moved.bytes_written - written;
    read = moved.bytes_read;
    written = moved.bytes_written;
    ++drawn;
  };
  for (const PatchWork& patch : geometry_.patches) {
    out.back().events[Event::kVertices] += patch.vertices;
    out.back().events[Event::kBoxes] += patch.triangles;
    out.back().dram_bytes[kVisibility] += records.next(patch.vertices);
    set_up += patch.triangles;
    for (; part < geometry_.in_tiles.size() && geometry_.in_tiles[part].patch == patch.patch; ++part) {
      const PatchInTile& in_tile = geometry_.in_tiles[part];
      const auto place = std::tie(in_tile.patch, in_tile.tile);
      const auto place_of = [&](std::size_t k) { return std::tie(drawn_.order[k].patch, drawn_.order[k].tile); };
      while (drawn < drawn_.order.size() && place_of(drawn) < place) add_next();
      const DrawnInTile* hit = nullptr;
      if (drawn < drawn_.order.size() && place_of(drawn) == place) hit = &drawn_.order[drawn], add_next();
      const std::uint64_t tests =
          hit == nullptr ? lanes(in_tile.stamps, 0, 0) : lanes(in_tile.stamps, hit->hits, hit->depth_tests);
      out.back().events[Event::kTriangleTests] += tests;
      out.back().events[Event::kTriangleLanes] += tests;
      if (set_up < kBatchTriangles && tested < max_samples) continue;
      out.emplace_back();
      set_up = tested = 0;
    }
  }
  while (drawn < drawn_.order.size()) add_next();
  const auto warp = static_cast<std::uint64_t>(gpu_.shader.warp_lanes);
  for (TileWork& batch : out) {
    batch.sub_patches = batch.events[Event::kVertices] > 0 ? 1 : 0;
    batch.events[Event::kShaderLanes] = round_up(batch.events[Event::kShaderInvocations], warp);
  }
  return out;
}

timing::FrameWork SchemeWork::immediate(const BaselineCounters& scheme) const {
  timing::FrameWork work;
  work.tile_state_bytes = 1;  // batches keep no samples: as many as the scheduler knows
  timing::WorkRound& draws = work.rounds.emplace_back();
  draws.geometry = hull_stage(scheme);
  draws.tiles = batches(scheme.patch_bytes_cached);
  std::uint64_t read = 0, written = 0;
  if (!drawn_.moved.empty()) read = drawn_.moved.back().bytes_read, written = drawn_.moved.back().bytes_written;
  timing::WorkRound& finish = work.rounds.emplace_back();
  const std::vector<std::uint64_t> reads = by_pixels(scheme.frame_bytes_read - read),
                                   writes = by_pixels(scheme.frame_bytes_written - written);
  for (std::size_t k = 0; k < order_.size(); ++k) {
    TileWork& tile = finish.tiles.emplace_back();
    tile.tile = order_[k];
    if (samples_ > 1) tile.events[Event::kPixels] = pixels_of(*job_.grid, order_[k]);
    tile.dram_bytes[kStore] = reads[k] + writes[k];
  }
  return work;
}

FrontWork front_work(const BaselineCounters& scheme, const TriangleBuffer& buffer, std::uint64_t geometry_bytes) {
  const memory::Traffic lists = buffer.ledger().total();
  FrontWork of_scheme{0, geometry_bytes + lists.read_bytes, lists.written_bytes, true};
  of_scheme.vertices = scheme.position_evaluations;
  return of_scheme;
}

void take_geometry(const BaselineCounters& geometry, std::uint64_t attributes, BaselineCounters& out) {
  out.primitives = geometry.primitives;
  out.patches_culled = geometry.patches_culled;
  out.culled_frustum = geometry.culled_frustum;
  out.culled_backface = geometry.culled_backface;
  out.culled_zero_area = geometry.culled_zero_area;
  out.bounding_operations = geometry.bounding_operations;
  out.tile_overlaps = geometry.tile_overlaps;
  out.patch_bytes += geometry.patch_bytes + attributes;
  out.patch_bytes_cached += geometry.patch_bytes_cached + attributes;
}

void set_cost(const gpu::GpuConfiguration& gpu, const timing::FrameWork& work, BaselineCounters& out) {
  const double cycles = timing::schedule_frame(gpu, work).cycles;
  out.cycles = static_cast<std::uint64_t>(std::ceil(cycles));  // as in stats.json
  out.energy_nj = static_cast<std::uint64_t>(std::llround(
      hardware::frame_energy(gpu, timing::energy_events(work), cycles, gpu.area().total_mm2()).total_nj()));
}

}  // namespace tessera::baselines

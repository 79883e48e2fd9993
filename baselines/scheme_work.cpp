#include "baselines/scheme_work.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/round_up.h"
#include "baselines/surfaces.h"
#include "frontend/patch_record.h"
#include "gpu/machine_model.h"
#include "tilecore/shading/shader_features.h"
#include "tilecore/tile_order.h"

namespace tessera::baselines {
namespace {

using timing::Event;
using timing::Phase;
using timing::SubPatchItem;
using timing::TileItems;
using timing::TileWork;

constexpr auto kVisibility = static_cast<std::size_t>(Phase::kVisibility),
               kShading = static_cast<std::size_t>(Phase::kShading), kStore = static_cast<std::size_t>(Phase::kStore);

// whole * count / of, rounded.
std::uint64_t scaled(std::uint64_t whole, std::uint64_t count, std::uint64_t of) {
  return of == 0 ? 0 : (whole * count + of / 2) / of;
}

// Adds the events that every scheme shares with the machine: shading of visible surfaces, and the finished frame.
void add_shading(const TileWork& from, TileWork& to) {
  for (const Event event :
       {Event::kAlphaTests, Event::kCompactedSamples, Event::kPlacesFound, Event::kShaderInvocations,
        Event::kShaderLanes, Event::kBackgroundSamples, Event::kBackgroundLanes, Event::kLightTests, Event::kLightLanes,
        Event::kTexels, Event::kDecodedTexels, Event::kBlendedLayers, Event::kPixels, Event::kResolveOperations,
        Event::kCodedPixels, Event::kCompressedPixels})
    to.events[event] += from.events[event];
  // The machine also packs vertices that pixels interpolate into warps; schemes have shaded theirs before.
  to.events[Event::kCompactedSamples] -= from.events[Event::kVertexOutputs];
}

void add_events(std::span<const SubPatchItem> items, TileWork& work) {
  for (std::size_t e = 0; e < hardware::kItemEventCount; ++e) work.events[hardware::kFirstItemEvent + e] = 0;
  for (const SubPatchItem& item : items) {
    for (std::size_t e = 0; e < hardware::kItemEventCount; ++e)
      work.events[hardware::kFirstItemEvent + e] += item.events[e];
    work.events[Event::kDomainTexels] += std::uint64_t{item[Event::kVertices]} * item.domain_texels;
  }
}

}  // namespace

std::uint64_t pixels_of(const binner::TileGrid& grid, binner::TileIndex tile) {
  const IntRect pixels = grid.pixels(tile);
  return static_cast<std::uint64_t>(pixels.width()) * static_cast<std::uint64_t>(pixels.height());
}

// Splits a whole in proportion to weights; the parts add up to the whole.
class SchemeWork::Parts {
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

// Splits the machine's work in a tile among the patches that an immediate renderer draws there in sequence. The
// remainder of a share goes into the next, so that many small patches have as much as a large one.
class SchemeWork::TileShares {
 public:
  // `behind`: samples that look up the environment.
  TileShares(const OwnTile& own, const gpu::TextureUse& textures, std::uint64_t behind)
      : TileShares(own, textures, behind, own.work.events[Event::kShaderInvocations] - own.light.invocations,
                   {own.work.events[Event::kTexels], own.light.lookups}) {}
  DrawnShare next(std::uint64_t invocations) {
    DrawnShare share = lookups(invocations);
    share.visibility_bytes = visibility_bytes_.next(invocations), share.alpha_tests = alpha_tests_.next(invocations);
    share.alpha_lines = alpha_lines_.next(invocations);
    return share;
  }
  DrawnShare behind() { return lookups(behind_); }
  // The rest, which light halves look up.
  const DrawnShare& light() const { return light_; }

  // Adds `lanes` that shade to the last warp, with their part of the lookups of a share, `texels` and `lines`.
  void add_lanes(std::uint64_t lanes, Parts& texels, Parts& lines, TileItems& items) {
    timing::WarpItem& warp = items.warps.back();
    const auto looked_up = static_cast<std::uint32_t>(lines.next(lanes));
    warp.lanes += static_cast<std::uint32_t>(lanes);
    warp.texels += static_cast<std::uint32_t>(texels.next(lanes));
    warp.texel_lines += looked_up;
    for (std::uint32_t k = 0; k < looked_up; ++k)
      items.texel_lines.push_back(own_->texel_lines[next_texel_line_++ % own_->texel_lines.size()]);
  }
  std::uint32_t next_alpha_line() { return own_->alpha_lines[next_alpha_line_++ % own_->alpha_lines.size()]; }

 private:
  struct Lookups {
    std::uint64_t all, light;
    // The part of light halves in something that all lookups caused.
    std::uint64_t part(std::uint64_t whole) const { return scaled(whole, light, all); }
  };
  TileShares(const OwnTile& own, const gpu::TextureUse& textures, std::uint64_t behind, std::uint64_t shaded,
             const Lookups& made)
      : own_(&own),
        behind_(behind),
        light_{.texels = made.light,
               .l2_lines = made.part(textures.l2_lines),
               .shading_bytes = made.part(textures.shading_bytes)},
        texels_(made.all - made.light, shaded + behind),
        decoded_texels_(own.work.events[Event::kDecodedTexels], shaded + behind),
        l2_lines_(textures.l2_lines - light_.l2_lines, shaded + behind),
        shading_bytes_(textures.shading_bytes - light_.shading_bytes, shaded + behind),
        texel_lines_(own.texel_lines.size(), shaded + behind),
        visibility_bytes_(textures.visibility_bytes, shaded),
        alpha_tests_(own.work.events[Event::kAlphaTests], shaded),
        alpha_lines_(own.alpha_lines.size(), shaded) {}
  DrawnShare lookups(std::uint64_t count) {
    DrawnShare share{};
    share.texels = texels_.next(count), share.decoded_texels = decoded_texels_.next(count);
    share.l2_lines = l2_lines_.next(count), share.shading_bytes = shading_bytes_.next(count);
    share.texel_lines = texel_lines_.next(count);
    return share;
  }

  const OwnTile* own_;
  std::uint64_t behind_;
  DrawnShare light_;
  Parts texels_, decoded_texels_, l2_lines_, shading_bytes_, texel_lines_;
  Parts visibility_bytes_, alpha_tests_, alpha_lines_;
  std::size_t next_texel_line_ = 0, next_alpha_line_ = 0;
};

std::vector<SchemeWork::TileShares> SchemeWork::shares() const {
  const bool looks_up = job_.lighting.environment.surroundings().kind == shaders::Surroundings::Kind::kImage;
  std::vector<TileShares> shares;
  for (std::size_t tile = 0; tile < own_.size(); ++tile)
    shares.emplace_back(own_[tile], textures_[tile], looks_up ? own_[tile].work.events[Event::kBackgroundSamples] : 0);
  return shares;
}

std::uint64_t SchemeWork::immediate_texture_bytes() const {
  std::vector<TileShares> shares = this->shares();
  std::uint64_t bytes = 0;
  for (const DrawnInTile& drawn : drawn_.order) {
    const DrawnShare share = shares[drawn.tile].next(drawn.invocations);
    bytes += share.visibility_bytes + share.shading_bytes;
  }
  for (TileShares& tile : shares) bytes += tile.behind().shading_bytes + tile.light().shading_bytes;
  return bytes;
}

std::uint64_t SchemeWork::texture_bytes() const {
  std::uint64_t bytes = 0;
  for (const gpu::TextureUse& tile : textures_) bytes += tile.visibility_bytes + tile.shading_bytes;
  return bytes;
}

SchemeWork::SchemeWork(const gpu::GpuConfiguration& gpu, const tilecore::TileJob& job, const MachineWork& machine,
                       const GeometryCounts& geometry, const ImmediateFrame& drawn, std::uint64_t loaded_bytes)
    : gpu_(gpu),
      job_(job),
      geometry_(geometry),
      drawn_(drawn),
      machine_(machine),
      loaded_bytes_(loaded_bytes),
      textures_(machine.textures),
      has_items_(gpu.queues.model == hardware::TimingModel::kEvents),
      order_(tilecore::TileOrder(gpu.tilecore.tile_order, *job.grid).tiles()),
      own_(job.grid->tile_count()),
      samples_(static_cast<std::uint64_t>(job.pattern->samples_per_pixel())) {
  std::erase_if(order_, [&](binner::TileIndex tile) { return !job.draws(tile); });
  take_shaders();
  for (const timing::WorkRound& round : machine.rounds)
    for (std::size_t k = 0; k < round.tiles.size(); ++k) {
      OwnTile& own = own_[round.tiles[k].tile - machine.first_tile];
      add_shading(round.tiles[k], own.work);
      if (has_items_) add_own_items(round.items[k], own);
    }
  for (std::size_t tile = 0; tile < machine.lights.size(); ++tile) {
    own_[tile].light = machine.lights[tile];
    own_[tile].work.events[Event::kTileBytes] += machine.lights[tile].tile_bytes;
  }
  for (std::size_t k = 0; k < drawn.order.size(); ++k)
    own_[drawn.order[k].tile].drawn.push_back(static_cast<std::uint32_t>(k));
}

void SchemeWork::take_shaders() {
  const bool quads = job_.shading.derivatives == tilecore::ShadingDerivatives::kQuad &&
                     job_.shading.rate != tilecore::ShadingRate::kCache;
  for (const scene::PosedDrawable& drawable : job_.frame->drawables) {
    Shaders& of = shaders_.emplace_back();
    const tilecore::PixelShader::Halves halves = tilecore::halves_of(job_.shading);
    const bool fills = job_.shading.has_gbuffer() && tilecore::fills_gbuffer(drawable, halves);
    of.pixel = fills ? tilecore::fill_warp_item(*job_.frame, drawable, quads, halves, false)
                     : tilecore::warp_item(*job_.frame, drawable, job_.lighting, quads, false);
    of.masks = drawable.material->alpha_mode == scene::AlphaMode::kMask;
    of.place = of.whole = tilecore::place_cost(drawable);
    if (tilecore::has_grid(drawable) && job_.shades()) of.whole = tilecore::output_cost(*job_.frame, drawable);
    of.displaced = of.place.texture_instructions > 0;
  }
}

void SchemeWork::add_own_items(const timing::TileItems& items, OwnTile& own) const {
  std::size_t alpha = 0;
  for (const timing::SubPatchItem& item : items.sub_patches) alpha += item.texel_lines;
  const auto middle = items.texel_lines.begin() + static_cast<std::ptrdiff_t>(alpha);
  own.alpha_lines.insert(own.alpha_lines.end(), items.texel_lines.begin(), middle);
  auto line = middle;
  for (timing::WarpItem warp : items.warps) {
    std::vector<std::uint32_t>& lines = warp.kind == timing::WarpItem::kLight ? own.light_lines : own.texel_lines;
    const auto end = line + static_cast<std::ptrdiff_t>(warp.texel_lines);
    lines.insert(lines.end(), std::exchange(line, end), end);
    if (warp.kind == timing::WarpItem::kVertices) continue;  // schemes shade their vertices before
    if (warp.drawable > 0 && warp.kind == timing::WarpItem::kEvaluating) {
      const timing::WarpItem& interpolates = shaders_[warp.drawable - 1].pixel;
      warp.kind = timing::WarpItem::kPixels, warp.clocks = interpolates.clocks, warp.registers = interpolates.registers;
      warp.texels -=
          std::min(warp.texels, warp.lanes * tilecore::height_lookups(job_.frame->drawables[warp.drawable - 1]));
    }
    own.warps.push_back(warp);
  }
  own.texel_lines.insert(own.texel_lines.end(), line, items.texel_lines.end());
}

timing::SubPatchItem SchemeWork::tests_of(const DrawnInTile& drawn) const {
  timing::SubPatchItem item;
  for (const Event event :
       {Event::kBoxTests, Event::kBoxLanes, Event::kStencilTests, Event::kTriangleTests, Event::kTriangleLanes})
    item[event] = drawn.hits == 0
                      ? drawn.tests[event]
                      : static_cast<std::uint32_t>(scaled(drawn.tests[event], drawn.depth_tests, drawn.hits));
  item[Event::kBoxes] = drawn.tests[Event::kBoxes];
  item[Event::kHits] = static_cast<std::uint32_t>(drawn.depth_tests);
  item[Event::kDepthBlocks] = static_cast<std::uint32_t>(drawn.blocks_scanned);
  item.drawable = job_.frame->assembly->patch_drawable[drawn.patch] + 1;
  return item;
}

void SchemeWork::shade_vertices(std::uint32_t patch, std::uint64_t vertices, TileItems& items,
                                SubPatchItem& item) const {
  const Shaders& shaders = shaders_of(patch);
  item[Event::kVertices] += static_cast<std::uint32_t>(vertices);
  item.domain_clocks = static_cast<std::uint32_t>(hardware::lane_clocks(shaders.whole));
  item.domain_registers = static_cast<std::uint32_t>(shaders.whole.registers);
  item.domain_texels = static_cast<std::uint32_t>(shaders.whole.texture_instructions);
  if (!has_items_ || !shaders.displaced || machine_.heights == nullptr) return;
  std::vector<std::uint32_t> lines;
  machine_.heights->lines_of(*job_.frame, patch, scene::patch_cells(*job_.frame, patch), lines);
  lines.resize(std::min<std::size_t>(lines.size(), vertices));
  item.height_lines = item.lines = static_cast<std::uint32_t>(lines.size());
  items.lines.insert(items.lines.end(), lines.begin(), lines.end());
}

// Makes the items of a tile, one for each patch that it draws, and divides the list's work among them; adds up all events.
void SchemeWork::add_items(const ListWork& list, const OwnTile& own, Draw out) const {
  std::vector<SubPatchItem> items;
  std::uint64_t boxes = 0, masked = 0;
  for (const std::uint32_t k : own.drawn) {
    items.push_back(tests_of(drawn_.order[k]));
    boxes += items.back()[Event::kBoxes] + 1;
    if (shaders_[items.back().drawable - 1].masks) masked += items.back()[Event::kTriangleTests];
  }
  const std::uint64_t alpha_tests = own.work.events[Event::kAlphaTests];
  if (items.empty() && list.vertices + list.transforms + list.decoded + alpha_tests + own.alpha_lines.size() > 0)
    items.emplace_back();
  Parts vertices(list.vertices, boxes), transforms(list.transforms, boxes), decoded(list.decoded, boxes),
      tests(alpha_tests, masked), lines(own.alpha_lines.size(), masked);
  for (std::size_t k = 0; k < items.size(); ++k) {
    SubPatchItem& item = items[k];
    const std::uint64_t weight = item[Event::kBoxes] + std::uint64_t{1};
    const std::uint64_t shaded = k < own.drawn.size() ? vertices.next(weight) : list.vertices;
    item[Event::kTransforms] =
        static_cast<std::uint32_t>(k < own.drawn.size() ? transforms.next(weight) : list.transforms);
    item[Event::kDecodedElements] =
        static_cast<std::uint32_t>(k < own.drawn.size() ? decoded.next(weight) : list.decoded);
    if (shaded > 0 && k < own.drawn.size())
      shade_vertices(drawn_.order[own.drawn[k]].patch, shaded, out.items, item);
    else
      item[Event::kVertices] = static_cast<std::uint32_t>(shaded);
    const bool masks = item.drawable > 0 && shaders_[item.drawable - 1].masks,
               last = masked == 0 && k + 1 == items.size();
    if (!masks && !last) continue;
    item[Event::kAlphaTests] = static_cast<std::uint32_t>(last ? alpha_tests : tests.next(item[Event::kTriangleTests]));
    item.texel_lines =
        static_cast<std::uint32_t>(last ? own.alpha_lines.size() : lines.next(item[Event::kTriangleTests]));
  }
  add_events(items, out.work);
  out.work.sub_patches = items.size();
  if (!has_items_) return;
  out.items.sub_patches = std::move(items);
  out.items.warps = own.warps;
  out.items.texel_lines = own.alpha_lines;
  auto line = own.texel_lines.begin(), light_line = own.light_lines.begin();
  const auto take = [&](auto& from, std::ptrdiff_t count) {
    out.items.texel_lines.insert(out.items.texel_lines.end(), from, from + count);
    from += count;
  };
  for (const timing::WarpItem& warp : own.warps)
    take(warp.kind == timing::WarpItem::kLight ? light_line : line, static_cast<std::ptrdiff_t>(warp.texel_lines));
  take(line, own.texel_lines.end() - line);
}

// Shades vertices before tiles, pass after pass, by the shaders of all patches that the hull stage kept.
void SchemeWork::shade_before(const FrontWork& front, timing::WorkRound& round) const {
  timing::GeometryWork& work = round.geometry;
  work.events[Event::kVertices] = front.vertices;
  std::uint64_t decoded = 0, vertices = 0, place_clocks = 0, whole_clocks = 0, texels = 0;
  std::vector<std::uint32_t> lines;
  for (const PatchWork& patch : front.patches != nullptr ? *front.patches : geometry_.patches) {
    const Shaders& shaders = shaders_of(patch.patch);
    vertices += patch.vertices;
    decoded += decoded_for_vertices(patch.patch);
    place_clocks += patch.vertices * static_cast<std::uint64_t>(hardware::lane_clocks(shaders.place));
    whole_clocks += patch.vertices * static_cast<std::uint64_t>(hardware::lane_clocks(shaders.whole));
    texels += patch.vertices * static_cast<std::uint64_t>(shaders.place.texture_instructions);
    if (!has_items_ || !shaders.displaced || machine_.heights == nullptr) continue;
    machine_.heights->lines_of(*job_.frame, patch.patch, scene::patch_cells(*job_.frame, patch.patch), lines);
    round.geometry_lines.insert(round.geometry_lines.end(), lines.begin(), lines.end());
  }
  work.vertex_clocks =
      scaled(place_clocks, front.vertices - front.whole, vertices) + scaled(whole_clocks, front.whole, vertices);
  work.events[Event::kDecodedElements] = decoded * front.passes;
  work.events[Event::kDomainTexels] = scaled(texels, front.vertices, vertices);
  work.events[Event::kShaderClocks] = front.instructions;
  work.events[Event::kTexels] = front.lookups;
  const std::vector<std::uint32_t> once = round.geometry_lines;
  for (std::uint64_t pass = 1; pass < front.passes; ++pass)
    round.geometry_lines.insert(round.geometry_lines.end(), once.begin(), once.end());
}

std::uint64_t SchemeWork::decoded_for_vertices(std::uint32_t patch) const {
  return frontend::resting_bound(*job_.frame, patch) != nullptr
             ? frontend::decoded_elements(*job_.frame->assembly, patch)
             : 0;
}

timing::GeometryWork SchemeWork::hull_stage(const BaselineCounters& scheme) const {
  timing::GeometryWork work;
  work.patches = std::max<std::uint64_t>(geometry_.patches.size(), 1);
  work.events[Event::kBounds] = scheme.bounding_operations;
  work.events[Event::kDecodedForBounds] = geometry_.decoded_for_bounds;
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
                          static_cast<std::uint64_t>(job_.grid->tile_height()) * samples_ *
                          surfaces_of(job_).sample_bytes();
  timing::WorkRound& round = work.rounds.emplace_back();
  round.geometry = hull_stage(scheme);
  round.geometry.events[Event::kBinnedEntries] = scheme.entries;
  round.geometry.events[Event::kTestedTiles] = scheme.tile_overlaps;
  round.geometry.dram_bytes = front.read_bytes + front.written_bytes;
  round.geometry.written_bytes = front.written_bytes;
  round.geometry.queue_bytes = scheme.queue_bytes_peak;
  if (front.bounds_on_lanes) round.geometry.events[Event::kBounds] = 0;
  shade_before(front, round);
  round.geometry.events[Event::kTriangles] =
      scheme.primitives + scheme.culled_frustum + scheme.culled_backface + scheme.culled_zero_area;

  const std::vector<ListWork> of_tile = spread(lists, bins);
  const std::vector<std::uint64_t> stored = by_pixels(scheme.frame_bytes_written), loaded = by_pixels(loaded_bytes_);
  const auto line_bytes = static_cast<std::uint64_t>(gpu_.line_bytes());
  for (std::size_t k = 0; k < order_.size(); ++k) {
    const binner::TileIndex tile = order_[k];
    const OwnTile& own = own_[tile];
    const ListWork& list = of_tile[tile];
    const gpu::TextureUse& textures = textures_[tile];
    TileWork& out = round.tiles.emplace_back(own.work);
    TileItems items;
    out.tile = tile + machine_.first_tile;
    add_items(list, own, {out, items});
    out.events[Event::kFetchedEntries] = front.fetches_entries ? list.entries : 0;
    items.cache_lines = (list.cache_bytes + line_bytes - 1) / line_bytes;
    out.events[Event::kL2Lines] = textures.l2_lines + items.cache_lines;
    out.dram_bytes[kVisibility] = list.bytes + textures.visibility_bytes + loaded[k];
    out.dram_bytes[kShading] = textures.shading_bytes;
    out.dram_bytes[kStore] = stored[k];
    items.list_bytes = list.bytes;
    items.load_bytes = loaded[k];
    items.written_bytes = stored[k];
    if (has_items_) round.items.push_back(std::move(items));
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
    std::vector<binner::TileIndex> drawn;
    for (int row = tiles.y0; row < tiles.y1; ++row)
      for (int column = tiles.x0; column < tiles.x1; ++column)
        if (const binner::TileIndex tile = grid.index(column, row); job_.draws(tile)) drawn.push_back(tile);
    for (const auto member : {&ListWork::entries, &ListWork::vertices, &ListWork::transforms, &ListWork::bytes,
                              &ListWork::cache_bytes, &ListWork::decoded}) {
      Parts parts(lists[bin].*member, drawn.size());
      for (const binner::TileIndex tile : drawn) out[tile].*member += parts.next(1);
    }
  }
  return out;
}

void SchemeWork::add_lookups(const DrawnShare& share, TileWork& work) {
  work.events[Event::kTexels] += share.texels;
  work.events[Event::kDecodedTexels] += share.decoded_texels;
  work.events[Event::kL2Lines] += share.l2_lines;
  work.dram_bytes[kVisibility] += share.visibility_bytes;
  work.dram_bytes[kShading] += share.shading_bytes;
}

// Adds the warps that shade drawn pixels, with their share of the machine's lookups in that tile. Pixels of a drawable
// that follow each other in a batch share a warp.
void SchemeWork::add_warps(const DrawnInTile& drawn, const DrawnShare& share, TileShares& tile, Draw out,
                           OpenWarp& open) const {
  const auto lanes = static_cast<std::uint64_t>(gpu_.shader.warp_lanes);
  const timing::WarpItem& shader = shaders_of(drawn.patch).pixel;
  if (open.drawable != shader.drawable) open = {.drawable = shader.drawable};
  Parts texels(share.texels, drawn.invocations), lines(share.texel_lines, drawn.invocations);
  for (std::uint64_t left = drawn.invocations; left > 0;) {
    if (open.free_lanes == 0) {
      open.free_lanes = lanes;
      out.work.events[Event::kShaderLanes] += lanes;
      if (has_items_) out.items.warps.push_back(shader);
    }
    const std::uint64_t taken = std::min(left, open.free_lanes);
    if (has_items_) tile.add_lanes(taken, texels, lines, out.items);
    left -= taken, open.free_lanes -= taken;
  }
}

void SchemeWork::add_background(const OwnTile& own, TileShares& tile, Draw out) const {
  const std::uint64_t samples = own.work.events[Event::kBackgroundSamples];
  const DrawnShare share = tile.behind();
  add_lookups(share, out.work);
  for (const Event event : {Event::kBackgroundSamples, Event::kBackgroundLanes})
    out.work.events[event] = own.work.events[event];
  out.work.events[Event::kCompactedSamples] = samples;
  if (!has_items_) return;
  Parts texels(share.texels, samples), lines(share.texel_lines, samples);
  for (const timing::WarpItem& warp : own.warps)
    if (warp.kind == timing::WarpItem::kBackground) {
      timing::WarpItem& added = out.items.warps.emplace_back(warp);
      added.lanes = added.texels = added.texel_lines = 0;
      tile.add_lanes(warp.lanes, texels, lines, out.items);
    }
}

void SchemeWork::add_lights(const OwnTile& own, TileShares& tile, Draw out) const {
  const gpu::LightUse& light = own.light;
  timing::EventCounts& events = out.work.events;
  events[Event::kCompactedSamples] += light.invocations;
  events[Event::kShaderInvocations] += light.invocations;
  events[Event::kShaderLanes] += light.warps * static_cast<std::uint64_t>(gpu_.shader.warp_lanes);
  for (const Event event : {Event::kLightTests, Event::kLightLanes}) events[event] += own.work.events[event];
  add_lookups(tile.light(), out.work);
  if (!has_items_) return;
  for (const timing::WarpItem& warp : own.warps)
    if (warp.kind == timing::WarpItem::kLight || warp.makes_lights()) out.items.warps.push_back(warp);
  out.items.texel_lines.insert(out.items.texel_lines.end(), own.light_lines.begin(), own.light_lines.end());
}

// Draws patches in order, cut into batches. A patch without any remaining sample is shaded and set up with the next one.
void SchemeWork::add_batches(std::uint64_t patch_bytes, std::span<const ImmediateTraffic> traffic,
                             std::vector<TileShares>& shares, timing::WorkRound& round) const {
  constexpr std::uint64_t kBatchTriangles = 512;
  const std::uint64_t max_samples = static_cast<std::uint64_t>(job_.grid->tile_width()) *
                                    static_cast<std::uint64_t>(job_.grid->tile_height()) * samples_;
  std::uint64_t vertices = 0;
  for (const PatchWork& patch : geometry_.patches) vertices += patch.vertices;
  Parts records(patch_bytes, vertices);
  TileWork work;
  TileItems items;
  OpenWarp open;
  std::vector<std::uint32_t> alpha_lines;
  std::uint64_t set_up = 0, tested = 0, read = 0, written = 0;
  const auto end_batch = [&] {
    add_events(items.sub_patches, work);
    work.sub_patches = items.sub_patches.size();
    round.tiles.push_back(std::exchange(work, {}));
    items.texel_lines.insert(items.texel_lines.begin(), alpha_lines.begin(), alpha_lines.end());
    alpha_lines.clear();
    if (has_items_) round.items.push_back(std::move(items));
    items = {}, open = {};
    set_up = tested = 0;
  };
  std::size_t next = 0;
  const auto draw_next = [&] {
    const DrawnInTile& drawn = drawn_.order[next];
    const ImmediateTraffic& moved = traffic[next++];
    TileShares& tile = shares[drawn.tile];
    const DrawnShare share = tile.next(drawn.invocations);
    SubPatchItem& item = items.sub_patches.emplace_back(tests_of(drawn));
    item[Event::kAlphaTests] = static_cast<std::uint32_t>(share.alpha_tests);
    item.texel_lines = static_cast<std::uint32_t>(share.alpha_lines);
    for (std::uint32_t k = 0; k < item.texel_lines; ++k) alpha_lines.push_back(tile.next_alpha_line());
    work.events[Event::kCompactedSamples] += drawn.invocations;
    work.events[Event::kShaderInvocations] += drawn.invocations;
    work.events[Event::kBlendedLayers] += drawn.blended;
    add_lookups(share, work);
    add_warps(drawn, share, tile, {work, items}, open);
    tested += item[Event::kTriangleTests];
    items.list_bytes += moved.bytes_read - read;
    items.written_bytes += moved.bytes_written - written;
    work.dram_bytes[kVisibility] += moved.bytes_read - std::exchange(read, moved.bytes_read);
    work.dram_bytes[kStore] += moved.bytes_written - std::exchange(written, moved.bytes_written);
  };
  for (const PatchWork& patch : geometry_.patches) {
    SubPatchItem& set_up_item = items.sub_patches.emplace_back();
    set_up_item.drawable = job_.frame->assembly->patch_drawable[patch.patch] + 1;
    set_up_item[Event::kBoxes] = static_cast<std::uint32_t>(patch.triangles);
    set_up_item[Event::kDecodedElements] = static_cast<std::uint32_t>(decoded_for_vertices(patch.patch));
    shade_vertices(patch.patch, patch.vertices, items, set_up_item);
    const std::uint64_t bytes = records.next(patch.vertices);
    items.list_bytes += bytes;
    work.dram_bytes[kVisibility] += bytes;
    set_up += patch.triangles;
    while (next < drawn_.order.size() && drawn_.order[next].patch <= patch.patch) {
      draw_next();
      if (set_up >= kBatchTriangles || tested >= max_samples) end_batch();
    }
  }
  while (next < drawn_.order.size()) draw_next();
  end_batch();
}

timing::FrameWork SchemeWork::immediate(const BaselineCounters& scheme, std::span<const ImmediateTraffic> moved) const {
  timing::FrameWork work;
  work.tile_state_bytes = 1;  // batches keep no samples: the scheduler takes its maximum number of tiles
  timing::WorkRound& draws = work.rounds.emplace_back();
  draws.geometry = hull_stage(scheme);
  std::vector<TileShares> shares = this->shares();
  add_batches(scheme.patch_bytes_cached, moved, shares, draws);
  std::uint64_t read = 0, written = 0;
  if (!moved.empty()) read = moved.back().bytes_read, written = moved.back().bytes_written;
  timing::WorkRound& finish = work.rounds.emplace_back();
  const std::vector<std::uint64_t> reads = by_pixels(scheme.frame_bytes_read - read),
                                   writes = by_pixels(scheme.frame_bytes_written - written);
  for (std::size_t k = 0; k < order_.size(); ++k) {
    TileWork& tile = finish.tiles.emplace_back();
    tile.tile = order_[k] + machine_.first_tile;
    const TileWork& own = own_[order_[k]].work;
    const bool lights = job_.shading.has_gbuffer() && job_.shades() && !job_.stores_gbuffer();
    if (!job_.stores_gbuffer())
      tile.events[Event::kPixels] = pixels_of(*job_.grid, order_[k]) *
                                    ((samples_ > 1 && job_.finishes(order_[k]) ? 1u : 0u) + (job_.behind ? 1u : 0u));
    for (const Event event : {Event::kCodedPixels, Event::kCompressedPixels}) tile.events[event] = own.events[event];
    tile.dram_bytes[kStore] = reads[k] + writes[k];
    TileItems items;
    add_background(own_[order_[k]], shares[order_[k]], {tile, items});
    if (lights) add_lights(own_[order_[k]], shares[order_[k]], {tile, items});
    if (!has_items_) continue;
    items.resolve_bytes = reads[k], items.written_bytes = writes[k];
    finish.items.push_back(std::move(items));
  }
  return work;
}

FrontWork front_work(const BaselineCounters& scheme, const TriangleBuffer& buffer, std::uint64_t geometry_bytes) {
  const memory::Traffic lists = buffer.ledger().total();
  FrontWork of_scheme;
  of_scheme.vertices = scheme.position_evaluations;
  of_scheme.read_bytes = geometry_bytes + lists.read_bytes;
  of_scheme.written_bytes = lists.written_bytes;
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
  const gpu::CycleCost cost = gpu::cycle_cost(gpu, std::span(&work, 1));
  out.cycles = static_cast<std::uint64_t>(std::ceil(cost.cycles));  // as in stats.json
  out.energy_nj = static_cast<std::uint64_t>(std::llround(cost.energy_nj));
}

}  // namespace tessera::baselines

#include "gpu/cost_attribution.h"

#include <algorithm>
#include <utility>

namespace tessera::gpu {
namespace {

using Lists = std::vector<std::map<std::uint32_t, DrawableInTile>>;

std::vector<std::vector<DrawableInTile>> flatten(const Lists& lists) {
  std::vector<std::vector<DrawableInTile>> out(lists.size());
  for (std::size_t tile = 0; tile < lists.size(); ++tile)
    for (const auto& [drawable, of] : lists[tile]) out[tile].push_back(of);
  return out;
}

std::vector<std::vector<DrawableInTile>> lists_of(const timing::FrameWork& work, std::size_t tiles) {
  Lists lists(tiles);
  for (const timing::WorkRound& round : work.rounds)
    for (std::size_t t = 0; t < round.items.size(); ++t) {
      if (round.tiles[t].tile >= tiles) continue;  // a tile of a light's map
      auto& list = lists[round.tiles[t].tile];
      const auto at = [&](std::uint32_t drawable) -> DrawableInTile& {
        DrawableInTile& of = list[drawable];
        of.drawable = drawable;
        return of;
      };
      for (const timing::SubPatchItem& item : round.items[t].sub_patches) ++at(item.drawable).sub_patches;
      for (const timing::WarpItem& item : round.items[t].warps)
        if (item.kind == timing::WarpItem::kPixels || item.kind == timing::WarpItem::kEvaluating)
          at(item.drawable).invocations += item.lanes;
    }
  return flatten(lists);
}

void add(timing::TileShare& into, const timing::TileShare& from) {
  into.tile = from.tile;
  into.cycles += from.cycles;
  into.dram_bytes += from.dram_bytes;
  into.energy_nj += from.energy_nj;
  if (from.bound_cycles <= into.bound_cycles) return;
  into.bound_by = from.bound_by;
  into.bound_cycles = from.bound_cycles;
}

// [measured] With events each doubling takes as long as the frame: five times the model's time.
timing::TileBounds bounds_of_tiles(const GpuConfiguration& gpu, const timing::Schedule& schedule) {
  if (gpu.queues.model == hardware::TimingModel::kPhases) return timing::TileBounds::kDoubled;
  const auto recorded = [](const timing::TileSchedule& tile) { return tile.path.total() > 0; };
  return std::any_of(schedule.tiles.begin(), schedule.tiles.end(), recorded) ? timing::TileBounds::kEstimated
                                                                             : timing::TileBounds::kNone;
}

}  // namespace

void CostAttribution::add(const CostAttribution& view) {
  for (const auto& [drawable, share] : view.drawables) drawables[drawable] += share;
  std::map<std::uint32_t, timing::TileShare> joined;
  for (const auto* of : {&std::as_const(tiles), &view.tiles})
    for (const timing::TileShare& tile : *of) gpu::add(joined[tile.tile], tile);
  tiles.clear();
  for (const auto& [number, tile] : joined) tiles.push_back(tile);
  for (std::size_t tile = 0; tile < traffic.size(); ++tile)
    for (std::size_t p = 0; p < memory::kPurposeCount; ++p) {
      traffic[tile][p].read_bytes += view.traffic[tile][p].read_bytes;
      traffic[tile][p].written_bytes += view.traffic[tile][p].written_bytes;
    }
  Lists both(lists.size());
  for (const auto* of : {&std::as_const(lists), &view.lists})
    for (std::size_t tile = 0; tile < of->size(); ++tile)
      for (const DrawableInTile& drawn : (*of)[tile]) {
        DrawableInTile& into = both[tile][drawn.drawable];
        into.drawable = drawn.drawable;
        into.sub_patches += drawn.sub_patches;
        into.invocations += drawn.invocations;
      }
  lists = flatten(both);
}

CostAttribution attribute_costs(const GpuConfiguration& gpu, const timing::FrameWork& work,
                                const timing::Schedule& schedule, const timing::FrameTiming& timing,
                                const hardware::FrameEnergy& energy, std::vector<TileTraffic> traffic,
                                const timing::WarmCaches& before, bool bounds) {
  CostAttribution shares;
  shares.drawables = timing::attribute(gpu, work, timing, energy);
  if (bounds) shares.bounds = bounds_of_tiles(gpu, schedule);
  shares.tiles = timing::attribute_tiles(gpu, work, schedule, before, shares.bounds);
  std::erase_if(shares.tiles, [&](const timing::TileShare& tile) { return tile.tile >= traffic.size(); });
  shares.lists = lists_of(work, traffic.size());
  shares.traffic = std::move(traffic);
  return shares;
}

}  // namespace tessera::gpu

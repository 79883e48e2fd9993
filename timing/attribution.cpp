#include "timing/attribution.h"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "base/parallel.h"

namespace tessera::timing {
namespace {

constexpr std::size_t kLines = kStageCount, kParts = kStageCount + 1;  // requested lines stand for memory and latency
using Weights = std::array<double, kParts>;

double& of(Weights& weights, Stage stage) { return weights[static_cast<std::size_t>(stage)]; }

bool compiled(const hardware::Machine& gpu) {
  return gpu.queues.model == hardware::TimingModel::kEvents && gpu.shader.costs == hardware::ShaderCosts::kCompiled;
}

double constant_operations(const hardware::Machine& gpu, const WarpItem& item) {
  if (item.kind == WarpItem::kBackground) return gpu.operations(Event::kBackgroundLanes);
  if (item.kind == WarpItem::kVertices) return gpu.operations(Event::kVertexOutputLanes);
  if (item.makes_lights()) return gpu.operations(Event::kLightLanes);
  if (item.kind == WarpItem::kImage) return gpu.operations(Event::kImageLanes);
  return gpu.operations(Event::kShaderLanes) +
         (item.kind == WarpItem::kEvaluating ? gpu.operations(Event::kSurfaceLanes) : 0);
}

// Events of one drawable in a tile.
struct TilePart {
  Weights weights{};
  std::array<double, kPhaseCount> bytes{};  // bytes that it asks for: its weight in the tile's bytes
  std::uint64_t invocations = 0, tests = 0, lines = 0;
};
using TileParts = std::map<std::uint32_t, TilePart>;

TileParts parts_of(const hardware::Machine& gpu, const TileItems& items) {
  TileParts parts;
  const auto line_bytes = static_cast<double>(gpu.line_bytes());
  const double entry_bytes = items.sub_patches.empty() ? 0
                                                       : static_cast<double>(items.list_bytes + items.record_bytes) /
                                                             static_cast<double>(items.sub_patches.size());
  const auto bytes = [](TilePart& part, Phase phase) -> double& { return part.bytes[static_cast<std::size_t>(phase)]; };
  for (const SubPatchItem& item : items.sub_patches) {
    TilePart& part = parts[item.drawable];
    Weights& w = part.weights;
    of(w, Stage::kFetch) += 1;
    for (std::size_t e = 0; e < hardware::kItemEventCount; ++e) {
      const auto event = static_cast<Event>(hardware::kFirstItemEvent + e);
      if (event == Event::kVertices && gpu.shades_on_lanes()) {
        of(w, Stage::kShader) +=
            item[event] * (compiled(gpu) ? item.domain_clocks : gpu.operations(Event::kDomainInvocations));
        of(w, Stage::kTexture) += static_cast<double>(item[event]) * item.domain_texels;
      } else {
        of(w, *hardware::kEventTable[event].unit) += gpu.clocks(event, item[event]);
      }
    }
    w[kLines] += item.lines + item.texel_lines;
    part.tests += std::uint64_t{item[Event::kBoxLanes]} + item[Event::kTriangleLanes];
    part.lines += std::uint64_t{item.lines} + item.texel_lines;
    bytes(part, Phase::kVisibility) += entry_bytes + line_bytes * (item.lines + item.texel_lines);
  }
  for (const WarpItem& item : items.warps) {
    TilePart& part = parts[item.drawable];
    Weights& w = part.weights;
    const double lanes = item.lanes;
    if (item.is_packed()) of(w, Stage::kCompaction) += lanes;
    of(w, Stage::kShader) += lanes * (compiled(gpu) ? item.clocks : constant_operations(gpu, item));
    of(w, Stage::kTexture) += item.texels;
    w[kLines] += item.texel_lines;
    part.lines += item.texel_lines;
    bytes(part, Phase::kShading) += item.texel_lines;
    if (item.kind == WarpItem::kBackground || item.kind == WarpItem::kVertices || !item.is_packed()) continue;
    of(w, Stage::kBlend) += lanes;
    of(w, Stage::kResolve) += lanes;
    part.invocations += item.lanes;
    bytes(part, Phase::kStore) += lanes;
  }
  return parts;
}

bool of_geometry(Stage stage) { return stage == Stage::kFrontend || stage == Stage::kBinner; }
bool of_core(Stage stage) { return stage != Stage::kFrontend && stage != Stage::kBinner && stage != Stage::kDram; }

hardware::EnergyEvents tile_events(const hardware::Machine& gpu, const TileWork& tile, const TileItems* items) {
  FrameWork alone;
  alone.rounds.emplace_back().tiles.push_back(tile);
  hardware::EnergyEvents events = energy_events(alone);
  if (items != nullptr && compiled(gpu)) take_compiled(gpu, compiled_clocks(gpu, *items), events.counts);
  return events;
}

StageCycles tile_cycles(const hardware::Machine& gpu, const TileWork& tile, const TileItems* items) {
  StageCycles cycles = stage_cycles(gpu, tile);
  if (items != nullptr && compiled(gpu)) {
    double& shader = cycles[static_cast<std::size_t>(Stage::kShader)] = 0;
    const auto add = [&](std::uint64_t warps, std::uint32_t clocks) {
      shader += static_cast<double>(warps * static_cast<std::uint64_t>(gpu.shader.warp_lanes) * clocks) /
                static_cast<double>(gpu.shader.lanes);
    };
    for (const WarpItem& warp : items->warps) add(1, warp.clocks);
    if (gpu.shades_on_lanes())
      for (const SubPatchItem& item : items->sub_patches) add(domain_warps(gpu, item), item.domain_clocks);
  }
  return cycles;
}

// Parts of the frame's cycles, by unit.
Weights path_parts(const FrameTiming& timing) {
  Weights parts{};
  if (timing.events) {
    const PathTime& path = timing.events->path;
    for (std::size_t s = 0; s < kStageCount; ++s) parts[s] = path.clk[s];
    parts[kLines] = path[Bound::kLatency] + path[Bound::kL2];
  } else {
    double busy = 0;
    for (const double clk : timing.busy) busy += clk;
    for (std::size_t s = 0; s < kStageCount && busy > 0; ++s) parts[s] = timing.cycles * timing.busy[s] / busy;
  }
  parts[kLines] += std::exchange(of(parts, Stage::kDram), 0.0);
  return parts;
}

// Splits the tile's bytes into whole bytes that add up to them.
void add_bytes(const TileWork& tile, const TileParts& parts, std::map<std::uint32_t, DrawableShare>& shares) {
  for (std::size_t phase = 0; phase < kPhaseCount; ++phase) {
    double all = 0, upto = 0;
    for (const auto& [drawable, part] : parts) all += part.bytes[phase];
    std::uint64_t given = 0;
    for (const auto& [drawable, part] : parts) {
      if (all == 0) break;
      upto += part.bytes[phase];
      const auto end = static_cast<std::uint64_t>(static_cast<double>(tile.dram_bytes[phase]) * (upto / all));
      shares[drawable].dram_bytes += end - given;
      given = end;
    }
    shares[0].dram_bytes += tile.dram_bytes[phase] - given;
  }
}

using Entries = std::map<std::uint32_t, std::uint64_t>;  // of tile lists, by drawable

// Splits the round's bytes of the front end and the binner into whole bytes that add up to them.
void add_geometry_bytes(std::uint64_t bytes, const Entries& entries, std::map<std::uint32_t, DrawableShare>& shares) {
  std::uint64_t all = 0, upto = 0, given = 0;
  for (const auto& [drawable, count] : entries) all += count;
  for (const auto& [drawable, count] : entries) {
    upto += count;
    const auto end =
        static_cast<std::uint64_t>(static_cast<double>(bytes) * (static_cast<double>(upto) / static_cast<double>(all)));
    shares[drawable].dram_bytes += end - given;
    given = end;
  }
  shares[0].dram_bytes += bytes - given;
}

// Splits the energy outside the tiles' units: memory, L2, leakage, geometry.
void add_shared_energy(const hardware::FrameEnergy& energy, const Entries& entries,
                       std::map<std::uint32_t, DrawableShare>& shares) {
  const auto split = [&](std::string_view unit, const auto& weight) {
    const double nj = energy.by_unit_nj.at(std::string(unit));
    double all = 0;
    for (const auto& [drawable, share] : shares) all += static_cast<double>(weight(share));
    if (all == 0) shares[0].energy_nj += nj;
    for (auto& [drawable, share] : shares)
      if (all > 0) share.energy_nj += nj * (static_cast<double>(weight(share)) / all);
  };
  split(name(Stage::kDram), [](const DrawableShare& share) { return share.dram_bytes; });
  split("l2", [](const DrawableShare& share) { return share.requested_lines; });
  split("leakage", [](const DrawableShare& share) { return share.cycles; });
  double all = 0;
  for (const auto& [drawable, count] : entries) all += static_cast<double>(count);
  for (const Stage stage : geometry_stages()) {
    const double nj = energy.by_unit_nj.at(std::string(name(stage)));
    if (all == 0) shares[0].energy_nj += nj;
    for (const auto& [drawable, count] : entries) shares[drawable].energy_nj += nj * static_cast<double>(count) / all;
  }
}

}  // namespace

std::map<std::uint32_t, DrawableShare> attribute(const hardware::Machine& gpu, const FrameWork& work,
                                                 const FrameTiming& timing, const hardware::FrameEnergy& energy) {
  std::map<std::uint32_t, DrawableShare> shares;
  std::map<std::uint32_t, Weights> busy;  // cycles of units for each drawable
  Weights all{};
  Entries entries;
  shares[0].dram_bytes = work.other_bytes;
  for (const WorkRound& round : work.rounds) {
    Entries of_round;
    for (const TileItems& items : round.items)
      for (const SubPatchItem& item : items.sub_patches) ++of_round[item.drawable];
    for (const auto& [drawable, count] : of_round) entries[drawable] += count;
    add_geometry_bytes(round.geometry.dram_bytes, of_round, shares);
    for (std::size_t t = 0; t < round.tiles.size(); ++t) {
      const TileParts parts = parts_of(gpu, round.items[t]);
      Weights sums{};
      for (const auto& [drawable, part] : parts)
        for (std::size_t p = 0; p < kParts; ++p) sums[p] += part.weights[p];
      const StageCycles cycles = tile_cycles(gpu, round.tiles[t], &round.items[t]);
      const auto nj = hardware::frame_energy(gpu, tile_events(gpu, round.tiles[t], &round.items[t]), 0, 0).by_unit_nj;
      for (std::size_t p = 0; p < kParts; ++p) {
        const bool unit = p < kStageCount && of_core(static_cast<Stage>(p));
        const double clk = unit ? cycles[p] : p == kLines ? sums[p] : 0;
        const double of_unit = unit ? nj.at(std::string(name(static_cast<Stage>(p)))) : 0;
        all[p] += clk;
        if (sums[p] == 0) {
          busy[0][p] += clk, shares[0].energy_nj += of_unit;
          continue;
        }
        for (const auto& [drawable, part] : parts) {
          busy[drawable][p] += clk * part.weights[p] / sums[p];
          shares[drawable].energy_nj += of_unit * part.weights[p] / sums[p];
        }
      }
      for (const auto& [drawable, part] : parts) {
        DrawableShare& share = shares[drawable];
        share.invocations += part.invocations, share.tests += part.tests, share.requested_lines += part.lines;
      }
      add_bytes(round.tiles[t], parts, shares);
    }
  }
  for (std::size_t p = 0; p < kStageCount; ++p) {
    if (!of_geometry(static_cast<Stage>(p))) continue;
    for (const auto& [drawable, count] : entries) {
      busy[drawable][p] = static_cast<double>(count);
      all[p] += static_cast<double>(count);
    }
  }
  const Weights path = path_parts(timing);
  for (std::size_t p = 0; p < kParts; ++p) {
    if (all[p] == 0) {
      shares[0].cycles += path[p];
      continue;
    }
    for (const auto& [drawable, clk] : busy) shares[drawable].cycles += path[p] * clk[p] / all[p];
  }
  add_shared_energy(energy, entries, shares);
  return shares;
}

namespace {

using CyclesByTile = std::map<std::uint32_t, double>;  // by the tile's number

// Cycles from the core taking a tile to its last pixel, summed over its rounds.
CyclesByTile cycles_by_tile(const FrameWork& work, const Schedule& schedule) {
  CyclesByTile cycles;
  for (const TileSchedule& tile : schedule.tiles)
    cycles[work.rounds[tile.round].tiles[tile.index].tile] += tile.phases.back().end - tile.phases.front().begin;
  return cycles;
}

Schedule schedule_of(const hardware::Machine& gpu, const FrameWork& work, WarmCaches caches) {
  if (gpu.queues.model != hardware::TimingModel::kEvents) return schedule_frame(gpu, work);
  return simulate_events(gpu, work, &caches).schedule;
}

// The bounds that may limit a tile; the number of tiles and the work before all tiles are not among them.
std::vector<Bound> bounds_of_tiles(const hardware::Machine& gpu, const StageCycles& busy) {
  std::vector<Bound> bounds;
  for (std::size_t s = 0; s < kStageCount; ++s)
    if (busy[s] > 0 && of_core(static_cast<Stage>(s))) bounds.push_back(static_cast<Bound>(s));
  bounds.insert(bounds.end(), {bound_of(Stage::kDram), Bound::kLatency});
  // The model with phases has neither.
  if (gpu.queues.model == hardware::TimingModel::kEvents) bounds.insert(bounds.end(), {Bound::kL2, Bound::kCaches});
  return bounds;
}

// Cycles of each tile that doubling each bound saves.
std::vector<CyclesByTile> gains_by_doubling(const hardware::Machine& gpu, const FrameWork& work,
                                            const CyclesByTile& cycles, const WarmCaches& before,
                                            const std::vector<Bound>& bounds) {
  std::vector<CyclesByTile> gains(bounds.size());
  parallel_for(bounds.size(), [&](std::size_t b) {
    gains[b] = cycles_by_tile(work, schedule_of(doubled(gpu, bounds[b]), work, before));
    for (auto& [number, clk] : gains[b]) clk = cycles.at(number) - clk;
  });
  return gains;
}
std::vector<CyclesByTile> gains_by_path(const FrameWork& work, const Schedule& schedule,
                                        const std::vector<Bound>& bounds) {
  std::vector<CyclesByTile> gains(bounds.size());
  for (const TileSchedule& tile : schedule.tiles)
    for (std::size_t b = 0; b < bounds.size(); ++b)
      gains[b][work.rounds[tile.round].tiles[tile.index].tile] +=
          index(bounds[b]) < kPathParts ? tile.path[bounds[b]] / 2 : 0;
  return gains;
}

}  // namespace

std::vector<TileShare> attribute_tiles(const hardware::Machine& gpu, const FrameWork& work, const Schedule& schedule,
                                       const WarmCaches& before, TileBounds bounds) {
  std::map<std::uint32_t, TileShare> tiles;
  StageCycles busy{};
  for (const TileSchedule& scheduled : schedule.tiles) {
    const WorkRound& round = work.rounds[scheduled.round];
    const TileWork& tile = round.tiles[scheduled.index];
    TileShare& share = tiles[tile.tile];
    share.tile = tile.tile;
    for (const std::uint64_t bytes : tile.dram_bytes) share.dram_bytes += bytes;
    const TileItems* items = round.items.empty() ? nullptr : &round.items[scheduled.index];
    share.energy_nj += hardware::frame_energy(gpu, tile_events(gpu, tile, items), 0, 0).total_nj();
    const StageCycles cycles = tile_cycles(gpu, tile, items);
    for (std::size_t s = 0; s < kStageCount; ++s) busy[s] += cycles[s];
  }
  const CyclesByTile all_cycles = cycles_by_tile(work, schedule);
  const std::vector<Bound> all = bounds == TileBounds::kNone ? std::vector<Bound>{} : bounds_of_tiles(gpu, busy);
  const std::vector<CyclesByTile> gains = bounds == TileBounds::kEstimated
                                              ? gains_by_path(work, schedule, all)
                                              : gains_by_doubling(gpu, work, all_cycles, before, all);
  std::vector<TileShare> out;
  for (const auto& [number, cycles] : all_cycles) {
    TileShare& share = out.emplace_back(tiles.at(number));
    share.cycles = cycles;
    double best = 0;
    for (const CyclesByTile& of : gains) best = std::max(best, of.at(number));
    for (std::size_t b = 0; b < all.size() && best > 0 && !share.bound_by; ++b)
      if (const double gain = gains[b].at(number); gain >= kNearlyBest * best)
        share.bound_by = all[b], share.bound_cycles = gain;
  }
  return out;
}

}  // namespace tessera::timing

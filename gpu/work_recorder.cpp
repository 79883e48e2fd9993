#include "gpu/work_recorder.h"

#include <algorithm>
#include <utility>

#include "base/error.h"
#include "base/round_up.h"

namespace tessera::gpu {

using memory::Purpose;
using memory::Unit;
using timing::Event;
using timing::Phase;

namespace {

constexpr std::size_t kVisibility = static_cast<std::size_t>(Phase::kVisibility);

std::uint64_t& bytes_of(TileTraffic& traffic, Purpose purpose, bool write) {
  memory::Traffic& of = traffic[static_cast<std::size_t>(purpose)];
  return write ? of.written_bytes : of.read_bytes;
}

}  // namespace

WorkRecorder::WorkRecorder(const GpuConfiguration& gpu, const PatchTable& records, const DisplacementMemory* heights,
                           bool record_accesses, bool keep_items, memory::LineRange maps)
    : gpu_(gpu),
      records_(records),
      heights_(heights),
      image_cache_(gpu.caches.texture_bytes, hardware::Caches::kTextureWays, gpu.line_bytes()),
      record_accesses_(record_accesses),
      keep_items_(keep_items),
      maps_(maps),
      maps_read_(maps.end - maps.first, 0),
      l2_({gpu.caches.l2_bytes, gpu.caches.l2_ways, gpu.line_bytes()}) {
  using Features = hardware::ShaderFeatures;
  for (std::size_t surface = 0; surface < domain_costs_.size(); ++surface)
    for (std::size_t motion = 0; motion < domain_costs_[surface].size(); ++motion)
      domain_costs_[surface][motion] = hardware::shader_cost({.stage = Features::Stage::kDomain,
                                                              .surface = static_cast<Features::Surface>(surface),
                                                              .motion = static_cast<Features::Motion>(motion)});
}

const hardware::ShaderCost& WorkRecorder::domain_cost(const tilecore::TessellationRequest& request) const {
  using Features = hardware::ShaderFeatures;
  const auto surface = request.displaced ? Features::Surface::kDisplacedPatch
                       : scene::has_grid(*frame_->segment(request.segment).drawable_of(request.patch).drawable)
                           ? Features::Surface::kPatch
                           : Features::Surface::kTriangles;
  const auto motion = request.moving ? request.deforming ? Features::Motion::kDeforming : Features::Motion::kMoving
                                     : Features::Motion::kStill;
  return domain_costs_[static_cast<std::size_t>(surface)][static_cast<std::size_t>(motion)];
}

std::uint64_t WorkRecorder::since(const memory::Ledger& ledger, memory::Traffic& seen) {
  const memory::Traffic now = ledger.total(),
                        more{now.read_bytes - seen.read_bytes, now.written_bytes - seen.written_bytes};
  seen = now;
  rounds_.read_bytes += more.read_bytes;
  rounds_.written_bytes += more.written_bytes;
  return more.read_bytes + more.written_bytes;
}

void WorkRecorder::begin_view(std::uint32_t first_tile) {
  first_tile_ = first_tile;
  counted_ = {};
  front_end_traffic_ = binner_traffic_ = coarse_depth_ = {};
  front_end_tables_ = 0;
  front_end_lines_ = front_end_records_ = 0;
  textures_.clear();
  traffic_.clear();
  procedures_ = nullptr;
}

void WorkRecorder::end_view(const tilecore::TileJob& job) {
  const auto width = static_cast<std::uint64_t>(job.grid->tile_width()),
             height = static_cast<std::uint64_t>(job.grid->tile_height());
  const auto blocks = [](std::uint64_t pixels) {
    return (pixels + tilecore::DepthBlocks::kSide - 1) / tilecore::DepthBlocks::kSide;
  };
  state_bytes_.resize(record_.work.rounds.size(), width * height *
                                                          static_cast<std::uint64_t>(job.pattern->samples_per_pixel()) *
                                                          tilecore::sample_layout(job).room_bytes() +
                                                      blocks(width) * blocks(height) * sizeof(float));
}

void WorkRecorder::front_end(const scene::FrameGeometry& frame, const frontend::FrontEndResult& result) {
  frame_ = &frame;
  const std::uint64_t bytes = since(result.ledger, front_end_traffic_);
  const GeometryCounters before = counted_;
  counted_.frontend = result.counters;
  counted_.instances = result.instances;
  counted_.groups = result.groups;
  counted_.previous_depth = result.previous_depth;
  geometry_.patches += counted_.frontend.base_patches - before.frontend.base_patches;
  count_geometry(before);
  geometry_bytes_ += bytes;
  const std::uint64_t all_tables = result.ledger.traffic(Unit::kFrontend, Purpose::kTexture).read_bytes,
                      tables = all_tables - std::exchange(front_end_tables_, all_tables);
  keep_table_lines(result, tables);
  const memory::Traffic depth = result.ledger.traffic(Unit::kFrontend, Purpose::kCoarseDepth),
                        more{depth.read_bytes - coarse_depth_.read_bytes,
                             depth.written_bytes - coarse_depth_.written_bytes};
  if (record_accesses_) {
    log_front_end(result, bytes - tables - more.read_bytes - more.written_bytes);
    log_coarse_depth(more);
    geometry_log_.add_next(Unit::kFrontend, Purpose::kTexture, false, tables);
  }
  coarse_depth_ = depth;
}

void WorkRecorder::count_geometry(const GeometryCounters& before) {
  const auto counts = [](const GeometryCounters& g) {
    timing::EventCounts events;
#define TESSERA_GEOMETRY_COUNT(id, count) events[Event::id] = count;
#include "hardware/each_event.inc"
    events[Event::kSamplingOperations] = g.procedures.sparse_operations;
    return events;
  };
  geometry_.events += counts(counted_) - counts(before);
}

void WorkRecorder::keep_table_lines(const frontend::FrontEndResult& result, std::uint64_t missed) {
  const auto burst = static_cast<std::uint64_t>(gpu_.memory.burst_bytes), line_bytes = l2_.line_bytes();
  const std::size_t first = std::exchange(front_end_lines_, result.table_lines.size());
  geometry_.table_bytes += missed;
  if (!keep_items_) return;
  // Tables lie behind the records.
  for (std::size_t k = first; k < result.table_lines.size(); ++k) {
    const std::uint64_t line = records_.end() + result.table_lines[k] * burst / line_bytes;
    if (line > 0xFFFFFFFFu) throw LimitError("tables of heights lie behind 2^32 cache lines");
    geometry_lines_.push_back(static_cast<std::uint32_t>(line));
  }
}

void WorkRecorder::log_front_end(const frontend::FrontEndResult& result, std::uint64_t bytes) {
  const auto burst = static_cast<std::uint64_t>(gpu_.memory.burst_bytes);
  const std::vector<std::uint32_t>& lines = result.record_misses;
  std::uint64_t of_patches = 0;
  for (std::size_t k = std::exchange(front_end_records_, lines.size()); k < lines.size();) {
    std::size_t end = k + 1;
    while (end < lines.size() && lines[end] == lines[end - 1] + 1) ++end;
    geometry_log_.add(Unit::kFrontend, Purpose::kPatchData, false, lines[k] * burst, (end - k) * burst);
    of_patches += (end - std::exchange(k, end)) * burst;
  }
  // Reads of instances and groups lie behind the records.
  geometry_log_.add(Unit::kFrontend, Purpose::kPatchData, false, result.records_end * burst, bytes - of_patches);
}

void WorkRecorder::log_coarse_depth(const memory::Traffic& more) {
  constexpr std::uint64_t kDeferredAt = std::uint64_t{32} << 20;  // behind the depths of the largest frame
  geometry_log_.add(Unit::kFrontend, Purpose::kCoarseDepth, true, kDeferredAt, more.written_bytes);
  if (more.read_bytes == 0) return;
  geometry_log_.add(Unit::kFrontend, Purpose::kCoarseDepth, false, 0, more.read_bytes - coarse_depth_.written_bytes);
  geometry_log_.add(Unit::kFrontend, Purpose::kCoarseDepth, false, kDeferredAt, coarse_depth_.written_bytes);
}

void WorkRecorder::sparse_pass(const tilecore::ParameterMaps& maps) {
  procedures_ = &maps;
  const GeometryCounters before = counted_;
  tessera::merge(counted_.procedures, maps.counters());
  geometry_.patches += maps.counters().cells;
  count_geometry(before);
  memory::Traffic none;
  geometry_bytes_ += since(maps.ledger(), none);
  if (!record_accesses_) return;
  const auto log = [&](Purpose purpose) {
    const memory::Traffic& traffic = maps.ledger().traffic(Unit::kSampling, purpose);
    if (traffic.read_bytes > 0) geometry_log_.add_next(Unit::kSampling, purpose, false, traffic.read_bytes);
    if (traffic.written_bytes > 0) geometry_log_.add_next(Unit::kSampling, purpose, true, traffic.written_bytes);
  };
  log(Purpose::kPatchData);
  log(Purpose::kSamplingMaps);
}

WorkRecorder::Round WorkRecorder::begin_round(const binner::Binner& binner, const tilecore::TileOrder& order,
                                              const RoundPlace& place) {
  if (record_.work.passes.empty() || record_.work.passes.back() != place.pass)
    record_.work.passes.emplace_back(place.pass);
  waits_ = place.waits;
  const GeometryCounters before = counted_;
  counted_.binner = binner.buffer().counters();
  count_geometry(before);
  const timing::EventCounts& events = geometry_.events;
  const bool works = events[Event::kBinnedEntries] + events[Event::kDepthTests] + geometry_bytes_ > 0;
  geometry_.patches = std::max<std::uint64_t>(geometry_.patches, works ? 1 : 0);
  const std::uint64_t written = binner_traffic_.written_bytes;
  geometry_.dram_bytes = std::exchange(geometry_bytes_, 0) + since(binner.buffer().ledger(), binner_traffic_);
  geometry_.written_bytes = binner_traffic_.written_bytes - written;
  geometry_.queue_bytes = binner.buffer().bytes_in_use();
  slots_.resize(binner.grid().tile_count());
  textures_.resize(binner.grid().tile_count());
  traffic_.resize(binner.grid().tile_count());
  order_ = &order;
  return Round(*this);
}

WorkRecorder::Tile::Tile(WorkRecorder& recorder, std::size_t tile)
    : recorder_(recorder), slot_(recorder.slots_[tile]), tile_(tile) {
  slot_.used = true;
  slot_.work.tile = static_cast<std::uint32_t>(tile);
}

WorkRecorder::Tile::Tile(WorkRecorder& recorder, std::size_t tile, tilecore::TileCore& core) : Tile(recorder, tile) {
  if (recorder.record_accesses_) core.record_accesses(&slot_.log);
  core.keep_items(recorder.keep_items_);
}

void WorkRecorder::Tile::end(const tilecore::TileJob& job, tilecore::TileResult& result, bool finished) {
  Sums& sums = recorder_.sums_.local();
  slot_.texture_misses = std::move(result.texture_misses);
  slot_.visibility_misses = result.visibility_misses;
  slot_.patches_read = std::move(result.patches_read);
  slot_.history_lines = std::move(result.history_lines);
  slot_.work.extra_bytes = result.extra_bytes;
  slot_.light_records = result.light_records;

  timing::TileWork& work = slot_.work;
  work.events = tilecore::count_events(result.counters, job.warp_lanes());
  work.events[Event::kTexels] -= result.visibility_texels;  // texels of alpha tests
  work.events[Event::kPixels] += result.single_samples;
  if (finished && (job.depths == nullptr || result.stored)) {
    const IntRect pixels = job.grid->pixels(static_cast<binner::TileIndex>(tile_));
    work.events[Event::kPixels] +=
        static_cast<std::uint64_t>(pixels.width()) * static_cast<std::uint64_t>(pixels.height());
  }
  work.dram_bytes = timing::phase_bytes(result.ledger);
  for (std::size_t unit = 0; unit < memory::kUnitCount; ++unit)
    for (std::size_t purpose = 0; purpose < memory::kPurposeCount; ++purpose) {
      const memory::Traffic& more = result.ledger.traffic(static_cast<Unit>(unit), static_cast<Purpose>(purpose));
      recorder_.traffic_[tile_][purpose].read_bytes += more.read_bytes;
      recorder_.traffic_[tile_][purpose].written_bytes += more.written_bytes;
    }
  if (recorder_.keep_items_) take_items(result);
  tilecore::merge(sums.core, result.counters);
  sums.ledger += result.ledger;
}

void WorkRecorder::Tile::take_items(tilecore::TileResult& result) {
  timing::TileItems& items = slot_.items;
  items.sub_patches = std::move(result.sub_patches);
  items.warps = std::move(result.warps);
  items.texel_lines = std::move(result.texture_requests);
  for (std::size_t unit = 0; unit < memory::kUnitCount; ++unit)
    items.list_bytes += result.ledger.traffic(static_cast<Unit>(unit), Purpose::kTileQueue).read_bytes;
  const memory::Traffic all = result.ledger.total();
  items.load_bytes = slot_.work.dram_bytes[kVisibility] - items.list_bytes;
  items.resolve_bytes = all.read_bytes - items.list_bytes - items.load_bytes;
  items.written_bytes = all.written_bytes;
  // Events of the tile that belong to no sub-patch, such as recomputed farthest depths, count for the last sub-patch.
  if (items.sub_patches.empty()) return;
  timing::SubPatchItem& last = items.sub_patches.back();
  std::uint64_t counted = 0;
  for (const timing::SubPatchItem& item : items.sub_patches) counted += item[Event::kDepthBlocks];
  last[Event::kDepthBlocks] += static_cast<std::uint32_t>(slot_.work.events[Event::kDepthBlocks] - counted);
}

std::uint64_t WorkRecorder::share_records(Slot& slot, std::span<const std::uint32_t> records,
                                          binner::RecordCache& cache) {
  std::uint64_t bytes = 0;
  for (const std::uint32_t record : records) bytes += cache.read(record, record_accesses_ ? &slot.log : nullptr);
  rounds_.read_bytes += bytes;
  slot.work.dram_bytes[kVisibility] += bytes;
  bytes_of(traffic_[slot.work.tile], Purpose::kTileQueue, false) += bytes;
  return bytes;
}

std::uint64_t WorkRecorder::share(binner::TileIndex tile, const SharedRequests& use, SharedCaches caches) {
  Slot& slot = slots_[tile];
  const std::uint64_t table_bytes = share_records(slot, use.records, caches.records);
  const std::vector<tilecore::TessellationRequest>& requests = use.tessellations;
  slot.work.sub_patches += requests.size();
  slot.items.record_bytes += table_bytes;
  // Items are in the order in which the tile drew: a sub-patch each, or cells of procedures together.
  if (!use.cells.empty()) image_cache_.empty();
  std::size_t next = slot.items.sub_patches.size() - (keep_items_ ? requests.size() + use.cells.size() : 0);
  auto cells = use.cells.begin();
  for (std::size_t r = 0; r < requests.size(); ++r) {
    for (; cells != use.cells.end() && cells->requests_before <= r; ++cells) share_cells(slot, *cells, next);
    share_tessellation(slot, tile, requests[r], caches.tessellations,
                       keep_items_ ? &slot.items.sub_patches[next++] : nullptr);
  }
  for (; cells != use.cells.end(); ++cells) share_cells(slot, *cells, next);
  caches.tessellations.use(tile, {}, use.hidden);
  share_shading(slot);
  share_history(slot);
  return table_bytes;
}

void WorkRecorder::share_tessellation(Slot& slot, binner::TileIndex tile, const tilecore::TessellationRequest& request,
                                      tilecore::TessellationCache& cache, timing::SubPatchItem* item) {
  const std::size_t lines = slot.items.lines.size();
  const tilecore::TessellationCounters before = cache.counters();
  cache.use(tile, std::span(&request, 1));
  const tilecore::TessellationCounters& now = cache.counters();
  const hardware::ShaderCost& cost = domain_cost(request);
  const std::uint64_t vertices = now.domain_evaluations - before.domain_evaluations;
  const auto add = [&](Event event, std::uint64_t count) {
    slot.work.events[event] += count;
    if (item != nullptr) (*item)[event] += static_cast<std::uint32_t>(count);
  };
  add(Event::kVertices, vertices);
  add(Event::kTransforms, now.vertex_transforms - before.vertex_transforms);
  add(Event::kBoxTests, now.group_tests - before.group_tests);
  add(Event::kBoxLanes, now.group_tests - before.group_tests);
  slot.work.events[Event::kDomainTexels] += vertices * static_cast<std::uint64_t>(cost.texture_instructions);
  const Fetched fetched = now.sub_patches != before.sub_patches ? share_records_and_heights(slot, request) : Fetched();
  add(Event::kDecodedElements, fetched.elements);
  if (item == nullptr) return;
  if (vertices > 0) {
    item->domain_clocks = static_cast<std::uint32_t>(hardware::lane_clocks(cost));
    item->domain_registers = static_cast<std::uint32_t>(cost.registers);
    item->domain_texels = static_cast<std::uint32_t>(cost.texture_instructions);
  }
  item->height_lines = fetched.height_lines;
  item->lines = static_cast<std::uint32_t>(slot.items.lines.size() - lines);
}

void WorkRecorder::share_cells(Slot& slot, const tilecore::CellsDrawn& cells, std::size_t& next_item) {
  const std::size_t lines = slot.items.lines.size();
  for (const tilecore::SamplingController::CellRead& read : cells.reads) {
    const tilecore::ParameterCell& cell = procedures_->cells()[read.cell];
    const std::uint32_t patch = frame_->drawables[cell.drawable].drawable->first_patch;
    record_lines_.clear();
    if (read.first_of_piece) records_.of_piece(*frame_, patch, cell.piece, record_lines_);
    const std::size_t numbers = record_lines_.size();
    records_.of_image(*frame_, patch, {cell.u0, cell.v0, cell.u1, cell.v1}, record_lines_);
    if (procedures_->settings().mode == tilecore::ProcedureSettings::Mode::kPublished) keep_misses(numbers);
    for (const PatchTable::Lines& of : record_lines_) {
      share_lines(slot, of, Phase::kVisibility, Purpose::kPatchData);
      keep_lines(slot, of);
    }
    const PatchTable::Lines of = records_.of_cell(read.cell, tilecore::ParameterMaps::kCellBytes);
    share_lines(slot, of, Phase::kVisibility, Purpose::kSamplingMaps);
    keep_lines(slot, of);
  }
  if (keep_items_)
    slot.items.sub_patches[next_item++].lines = static_cast<std::uint32_t>(slot.items.lines.size() - lines);
}

void WorkRecorder::keep_misses(std::size_t first) {
  std::vector<PatchTable::Lines> missed;
  for (std::size_t k = first; k < record_lines_.size(); ++k)
    for (std::uint32_t line = record_lines_[k].first; line < record_lines_[k].end; ++line) {
      ++image_counts_.cache_requests;
      if (image_cache_.use(line)) continue;
      ++image_counts_.cache_misses;
      missed.push_back({line, line + 1});
    }
  record_lines_.resize(first);
  record_lines_.insert(record_lines_.end(), missed.begin(), missed.end());
}

std::uint64_t WorkRecorder::move(binner::TileIndex tile, TileArray& array, std::uint64_t offset, std::uint64_t bytes) {
  const auto burst = static_cast<std::uint64_t>(gpu_.memory.burst_bytes);
  const std::uint64_t first = std::max(offset / burst * burst, array.moved), end = round_up(offset + bytes, burst);
  if (bytes == 0 || end <= first) return 0;
  const std::uint64_t moved = end - first;
  array.moved = end;
  Slot& slot = slots_[tile];
  const Phase phase = timing::phase_of(array.unit, array.purpose, array.write);
  slot.work.dram_bytes[static_cast<std::size_t>(phase)] += moved;
  bytes_of(traffic_[tile], array.purpose, array.write) += moved;
  if (array.write) {
    slot.items.written_bytes += moved;
    arrays_.write(array.unit, array.purpose, moved);
  } else {
    (phase == Phase::kStore ? slot.items.resolve_bytes : slot.items.load_bytes) += moved;
    arrays_.read(array.unit, array.purpose, moved);
  }
  if (record_accesses_) slot.log.add(array.unit, array.purpose, array.write, array.base + first, moved);
  return moved;
}

WorkRecorder::Fetched WorkRecorder::share_records_and_heights(Slot& slot,
                                                              const tilecore::TessellationRequest& request) {
  Fetched fetched;
  fetched.elements = records_.of_tessellation(frame_->segment(request.segment), request, record_lines_);
  for (const PatchTable::Lines& lines : record_lines_) {
    share_lines(slot, lines, Phase::kVisibility, Purpose::kPatchData);
    keep_lines(slot, lines);
  }
  if (heights_ == nullptr || !request.displaced) return fetched;
  heights_->lines_of(*frame_, request.patch, request.range, height_lines_);
  for (const std::uint32_t line : height_lines_) share_line(slot, line, Phase::kVisibility);
  if (keep_items_) slot.items.lines.insert(slot.items.lines.end(), height_lines_.begin(), height_lines_.end());
  fetched.height_lines = static_cast<std::uint32_t>(height_lines_.size());
  return fetched;
}

void WorkRecorder::keep_lines(Slot& slot, const PatchTable::Lines& lines) {
  if (!keep_items_) return;
  for (std::uint32_t line = lines.first; line < lines.end; ++line) slot.items.lines.push_back(line);
}

void WorkRecorder::share_lines(Slot& slot, const PatchTable::Lines& lines, timing::Phase phase, Purpose purpose) {
  for (std::uint32_t line = lines.first; line < lines.end; ++line) share_line(slot, line, phase, purpose);
}

void WorkRecorder::share_shading(Slot& slot) {
  std::size_t next = 0;
  const std::vector<std::uint32_t>& misses = slot.texture_misses;
  for (; next < std::min(slot.visibility_misses, misses.size()); ++next)
    share_line(slot, misses[next], Phase::kVisibility);
  const std::size_t lines = slot.items.lines.size();
  for (const std::uint32_t patch : slot.patches_read) {
    slot.work.events[Event::kDecodedForShading] += frontend::decoded_elements(*frame_->assembly, patch);
    for (const PatchTable::Lines& read : {records_.of_shading(*frame_, patch), records_.of_instance(patch)}) {
      share_lines(slot, read, Phase::kShading, Purpose::kAttributes);
      keep_lines(slot, read);
    }
  }
  if (slot.light_records) {
    const PatchTable::Lines read = records_.of_lights(tilecore::light_record_bytes(*frame_));
    share_lines(slot, read, Phase::kShading, Purpose::kAttributes);
    keep_lines(slot, read);
  }
  slot.items.shading_lines = static_cast<std::uint32_t>(slot.items.lines.size() - lines);
  for (; next < misses.size(); ++next) share_line(slot, misses[next], Phase::kShading);
  slot.texture_misses.clear();
  slot.patches_read.clear();
}

void WorkRecorder::share_history(Slot& slot) {
  for (const std::uint32_t line : slot.history_lines)
    if (!share_line(slot, PatchTable::kHistoryAt + line, Phase::kStore, Purpose::kHistory))
      slot.items.resolve_bytes += l2_.line_bytes();
  slot.history_lines.clear();
}

bool WorkRecorder::share_line(Slot& slot, std::uint32_t line, timing::Phase phase, Purpose purpose) {
  if (purpose == Purpose::kTexture && line >= maps_.first && line < maps_.end) {
    purpose = Purpose::kShadowMap;
    if (std::exchange(maps_read_[line - maps_.first], std::uint8_t{1}) == 0) ++sums_.local().core.shadows.lines_read;
  }
  ++slot.work.events[Event::kL2Lines];
  const bool looked_up = purpose == Purpose::kTexture || purpose == Purpose::kShadowMap;
  TextureUse* const texture = looked_up ? &textures_[slot.work.tile] : nullptr;
  if (texture != nullptr) ++texture->l2_lines;
  const Unit unit = purpose == Purpose::kHistory ? Unit::kResolve : Unit::kTilecore;
  if (l2_.read(line, purpose, unit)) return true;
  const std::uint64_t bytes = l2_.line_bytes();
  ++slot.work.events[Event::kL2Lines];
  if (texture != nullptr) {
    ++texture->l2_lines;
    (phase == Phase::kVisibility ? texture->visibility_bytes : texture->shading_bytes) += bytes;
  }
  slot.work.dram_bytes[static_cast<std::size_t>(phase)] += bytes;
  bytes_of(traffic_[slot.work.tile], purpose, false) += bytes;
  const std::uint64_t first = purpose == Purpose::kTexture        ? 0
                              : purpose == Purpose::kShadowMap    ? maps_.first
                              : purpose == Purpose::kSamplingMaps ? PatchTable::kCellsAt
                              : purpose == Purpose::kHistory      ? PatchTable::kHistoryAt
                                                                  : records_.first_line();
  if (record_accesses_) slot.log.add(unit, purpose, false, (line - first) * bytes, bytes);
  return false;
}

void WorkRecorder::end_round() {
  timing::WorkRound round{std::exchange(geometry_, {}), {}, {}, std::exchange(geometry_lines_, {})};
  round.pass = static_cast<std::uint32_t>(record_.work.passes.size() - 1);
  if (!waits_) round.geometry_after = 0;
  FrameRecord::RoundAccesses accesses{std::exchange(geometry_log_, {}).accesses(), {}};
  for (const binner::TileIndex tile : order_->tiles()) {
    Slot& slot = slots_[tile];
    if (!slot.used) continue;
    round.tiles.push_back(slot.work);
    round.tiles.back().tile += first_tile_;
    if (keep_items_) round.items.push_back(std::move(slot.items));
    if (record_accesses_) accesses.tiles.push_back(std::move(slot.log.accesses()));
    slot = {};
  }
  record_.work.rounds.push_back(std::move(round));
  if (record_accesses_) record_.accesses.push_back(std::move(accesses));
}

WorkRecorder::Sums WorkRecorder::take_sums() {
  Sums all;
  sums_.for_each([&](Sums& sums) {
    tilecore::merge(all.core, sums.core);
    all.ledger += sums.ledger;
    sums = {};
  });
  tessera::merge(all.core.texture, std::exchange(image_counts_, {}));
  const memory::L2::Account l2 = l2_.take_account();
  all.l2 = l2.counters;
  all.ledger += l2.ledger;
  all.ledger += std::exchange(arrays_, {});
  memory::Traffic none;
  since(all.ledger, none);
  return all;
}

FrameRecord WorkRecorder::finish(const memory::Ledger& ledger) {
  // The frame's value is the minimum over all tiles; tiles of some views take more.
  if (!state_bytes_.empty()) record_.work.tile_state_bytes = *std::ranges::min_element(state_bytes_);
  for (std::size_t r = 0; r < state_bytes_.size(); ++r)
    for (timing::TileWork& tile : record_.work.rounds[r].tiles)
      tile.extra_bytes += state_bytes_[r] - record_.work.tile_state_bytes;
  const memory::Traffic all = ledger.total();
  record_.other = {all.read_bytes - rounds_.read_bytes, all.written_bytes - rounds_.written_bytes};
  record_.work.other_bytes = record_.other.read_bytes + record_.other.written_bytes;
  record_.work.other_written_bytes = record_.other.written_bytes;
  return std::move(record_);
}

}  // namespace tessera::gpu

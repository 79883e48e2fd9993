#include "gpu/pipeline.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "gpu/image_passes.h"
#include "gpu/pass_counters.h"
#include "tilecore/procedural/parameter_maps.h"
#include "tilecore/resolve/resolve_unit.h"
#include "tilecore/shading/transmission.h"

namespace tessera::gpu {

namespace {

// Depths of a frame in which no block has hit a surface yet.
frontend::CoarseDepth depths_to_store(const GpuConfiguration& gpu, const tilecore::TileJob& job) {
  frontend::CoarseDepth depth;
  depth.block_pixels = gpu.depth_block_pixels();
  depth.blocks = frontend::CoarseDepth::blocks_of(job.grid->region(), depth.block_pixels);
  depth.farthest.assign(
      static_cast<std::size_t>(depth.blocks.width()) * static_cast<std::size_t>(depth.blocks.height()),
      frontend::kNothingSeen);
  depth.projection = job.frame->projection;
  depth.view = job.frame->views[1];
  return depth;
}

}  // namespace

std::vector<bool> Pipeline::tiles_again(const binner::TileGrid& grid, const frontend::CoarseDepth& depth,
                                        const std::vector<frontend::BoundedSubPatch>& visible,
                                        frontend::PreviousDepthCounters& counters) {
  std::vector<bool> again(grid.tile_count(), false);
  for (const frontend::BoundedSubPatch& piece : visible) {
    const IntRect tiles = grid.covered(piece.bounds);
    const frontend::BlockFootprint whole = depth.footprint(piece.bounds);
    for (int row = tiles.y0; row < tiles.y1; ++row)
      for (int column = tiles.x0; column < tiles.x1; ++column) {
        const binner::TileIndex tile = grid.index(column, row);
        if (again[tile]) continue;
        const IntRect blocks = frontend::CoarseDepth::blocks_of(grid.pixels(tile), depth.block_pixels);
        again[tile] = !depth.hides({whole.blocks.intersect(blocks), whole.nearest}, counters.blocks_tested);
      }
  }
  counters.tiles_again += static_cast<std::uint64_t>(std::ranges::count(again, true));
  return again;
}

void Pipeline::second_pass(const ViewRun& run, TileScheduler& scheduler, binner::Binner& binner,
                           frontend::FrontEndResult& front_end) {
  // Tiles that are rendered again do not store their depths again.
  frontend::CoarseDepth depth = std::exchange(run.result.targets.coarse_depth, {});
  const auto burst_bytes = static_cast<std::uint64_t>(gpu_.memory.burst_bytes);
  front_end.ledger.read(memory::Unit::kFrontend, memory::Purpose::kCoarseDepth,
                        memory::burst_bytes(0, scheduler.depth_bytes(), burst_bytes));
  std::vector<frontend::BoundedSubPatch> visible =
      frontend::second_pass_visible(*run.job.frame, pyramids_, gpu_.front_end_spec(), depth, front_end);
  const std::vector<bool> again = tiles_again(binner.grid(), depth, visible, front_end.previous_depth);
  run.recorder.front_end(*run.job.frame, front_end);
  if (std::ranges::count(again, true) == 0) {
    visible.clear();
  } else if (run.result.counters.binner.partial_renders > 0) {
    // A partial render emptied the lists, so they no longer hold all sub-patches of the tiles.
    scheduler.empty_lists();
    visible.insert(visible.begin(), front_end.sub_patches.begin(), front_end.sub_patches.end());
  }
  scheduler.render({.name = "again", .sub_patches = visible, .only = again, .binned = visible.empty()});
  run.result.targets.coarse_depth = std::move(depth);
}

bool Pipeline::render_tiles(const ViewRun& run, TileScheduler& scheduler, const binner::TileGrid& grid,
                            const std::vector<frontend::BoundedSubPatch>& sub_patches, bool binned) {
  std::vector<frontend::BoundedSubPatch> behind, transmissive;
  if (run.job.scene_color != nullptr)
    for (const frontend::BoundedSubPatch& piece : sub_patches)
      (tilecore::transmits(run.job.frame->drawable_of(piece.base_patch)) ? transmissive : behind).push_back(piece);
  if (transmissive.empty()) {
    bool again = binned;
    if (run.job.depths == nullptr && run.job.shading.path == tilecore::ShadingPath::kPrepass) {
      scheduler.render({.name = run.prepass, .sub_patches = sub_patches, .binned = binned, .depths_only = true});
      // The lists still hold all, unless a partial render emptied them.
      again = run.result.counters.binner.partial_renders == 0;
      if (!again) scheduler.empty_lists();
    }
    scheduler.render({.name = run.pass, .sub_patches = sub_patches, .binned = again});
    if (run.job.stores_gbuffer()) scheduler.light();
    return true;
  }
  std::vector<bool> open(grid.tile_count(), false);
  for (const frontend::BoundedSubPatch& piece : transmissive) {
    const IntRect tiles = grid.covered(piece.bounds);
    for (int row = tiles.y0; row < tiles.y1; ++row)
      for (int column = tiles.x0; column < tiles.x1; ++column) open[grid.index(column, row)] = true;
  }
  scheduler.render({.name = "behind", .sub_patches = behind, .open = open});
  scheduler.render(reduce_pass(run, scheduler.tiles()));
  // The lists still hold the opaque sub-patches, unless a partial render emptied them; this pass adds the others.
  const bool emptied = run.result.counters.binner.partial_renders > 0;
  if (emptied) {
    scheduler.empty_lists();
    transmissive.insert(transmissive.begin(), behind.begin(), behind.end());
  }
  scheduler.render({.name = run.pass, .sub_patches = transmissive, .only = open, .waits = emptied});
  return false;
}

void Pipeline::find_materials(const ViewRun& run, const std::vector<frontend::BoundedSubPatch>& sub_patches) {
  const std::vector<scene::Material>& materials = run.job.frame->assembly->materials;
  if (std::ranges::none_of(materials, [](const scene::Material& m) { return m.effects.any(); })) return;
  MaterialPlaces& places = run.result.materials;
  for (const frontend::BoundedSubPatch& piece : sub_patches) {
    const scene::MaterialEffects& effects = run.job.frame->drawable_of(piece.base_patch).material->effects;
    if (effects.none()) continue;
    for (std::size_t effect = 0; effect < effects.size(); ++effect) places.sub_patches[effect] += effects[effect];
    if (places.tiles.empty()) places.tiles.resize(run.job.grid->tile_count());
  }
}

void Pipeline::take_totals(const ViewRun& run) {
  cores_->for_each([&](tilecore::TileCore& core) {
    tilecore::CoreTotals totals = core.take_totals();
    merge(run.result.drawables, totals.drawables);
    if (run.job.resolve != nullptr) run.result.stage_seconds["resolve_threads"] += totals.resolve_seconds;
  });
}

void Pipeline::bound(const ViewRun& run, const PreviousDepth& previous, scene::MemoryBudget& budget) {
  const StageTimer timer(run.result, "bound");
  const std::uint64_t pose = previous.store ? 0 : run.job.frame->identity;
  if (pose != 0 && kept_.pose == pose) return;
  kept_.clear();
  kept_.front_end = frontend::run_front_end(*run.job.frame, pyramids_, gpu_.front_end_spec(), previous.guess, &budget);
  if (run.job.procedures != nullptr) {
    const std::vector<frontend::BoundedSubPatch>& cells = run.job.procedures->sub_patches();
    budget.charge(cells.size(), sizeof(frontend::BoundedSubPatch), "cells of procedures");
    kept_.front_end.sub_patches.insert(kept_.front_end.sub_patches.end(), cells.begin(), cells.end());
  }
  kept_.pose = pose;
}

void Pipeline::render(const ViewRun& run, const PreviousDepth& previous) {
  const tilecore::TileJob& job = run.job;
  FrameResult& result = run.result;
  // The part of the memory that the capture and its textures left.
  const scene::Capture& capture = *job.frame->assembly->capture;
  const std::uint64_t left = capture.max_bytes - job.frame->assembly->charged_bytes();
  scene::MemoryBudget budget(capture.max_bytes, capture.file.string(),
                             capture.max_bytes - left / job.frame->request.memory_parts);
  run.recorder.begin_view(run.first_tile);
  bound(run, previous, budget);
  frontend::FrontEndResult& front_end = kept_.front_end;
  run.recorder.front_end(*job.frame, front_end);
  if (job.procedures != nullptr) run.recorder.sparse_pass(*job.procedures);
  const bool binned =
      std::exchange(kept_.binned, false) && run.recorder.binner_log() == nullptr && run.inputs == nullptr;
  if (!binned) {
    kept_.binner.emplace(gpu_.binner_spec(), *job.grid);
    kept_.binner->buffer().record_accesses(run.recorder.binner_log());
    kept_.binner->buffer().limit(&budget);
  }
  binner::Binner& binner = *kept_.binner;
  find_materials(run, front_end.sub_patches);
  if (previous.store) result.targets.coarse_depth = depths_to_store(gpu_, job);
  result.maps = TileMaps(*job.grid);
  const tilecore::TileOrder order(gpu_.tilecore.tile_order, *job.grid);
  tilecore::TessellationCache cache(static_cast<std::uint64_t>(gpu_.tessellator.cache_bytes), *job.grid, order);
  PassCounters passes(run, front_end, binner, cache);
  TileScheduler scheduler(run, *cores_, binner, order, cache, [&](std::string_view pass) { passes.end(pass); });
  if (job.resolve != nullptr) tilecore::TileCore::begin_resolve(job);
  const bool all_binned = render_tiles(run, scheduler, binner.grid(), front_end.sub_patches, binned);
  if (previous.store) second_pass(run, scheduler, binner, front_end);
  if (job.resolve != nullptr && job.resolve->settings.reach == tilecore::StencilReach::kNeighbours)
    scheduler.render(stencil_pass(run));
  const std::size_t drawn = result.passes.size() - (job.stores_gbuffer() ? 1 : 0);
  if (run.taa != nullptr) scheduler.render(taa_pass(run, scheduler.tiles()));
  std::vector<Image> bloom;
  if (run.bloom != nullptr)
    for (const BloomStep& step : run.bloom->steps()) scheduler.render(bloom_pass(run, scheduler.tiles(), step, bloom));
  for (const CopyPass& copy : run.copies)
    scheduler.render(copy_pass(run, scheduler.tiles(), copy, copy.adds_bloom ? &bloom.front() : nullptr));
  result.image_passes = result.passes.size() - drawn;
  passes.finish();
  run.recorder.end_view(job);
  take_totals(run);
  binner.buffer().limit(nullptr);
  binner.buffer().record_accesses(nullptr);
  // Lists that a partial render emptied cannot be reused, and a second pass belongs to its frame.
  if (kept_.pose == 0)
    kept_.clear();
  else if (!all_binned || result.counters.binner.partial_renders > 0)
    kept_.binner.reset();
  else
    kept_.binned = true;
}

}  // namespace tessera::gpu

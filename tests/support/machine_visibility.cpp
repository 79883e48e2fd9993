#include "tests/support/machine_visibility.h"
#include "tests/support/tests.h"

namespace tessera::test {

using Clock = std::chrono::steady_clock;

MachineVisibility::Result MachineVisibility::run(const scene::FrameGeometry& frame,
                                                 const frontend::PyramidLibrary& pyramids, bool keep_tiles,
                                                 bool force_motion, const tilecore::VisibilityKernels* kernels) {
  Result result;
  auto lap = Clock::now();
  const auto charge = [&](double& seconds) {
    const auto now = Clock::now();
    seconds += std::chrono::duration<double>(now - lap).count();
    lap = now;
  };
  tilecore::TileJob job;
  job.frame = &frame;
  job.grid = &grid_;
  job.pattern = &pattern_;
  job.forced.motion = force_motion;
  job.kernels = kernels;
  job.machine = &gpu_;
  job.core.occlusion_culling = gpu_.tilecore.occlusion_culling;
  job.core.visibility = gpu_.tilecore.visibility;

  frontend::FrontEndResult front_end = frontend::run_front_end(frame, pyramids, gpu_.front_end_spec());
  charge(result.stages.bound_seconds);

  const std::size_t tile_count = grid_.tile_count();
  binner::Binner binner(gpu_.binner_spec(), grid_);
  binner::Binner::Cursor cursor;
  PerThread<std::uint64_t> queue_bytes_read;
  PerThread<tilecore::TileCoreCounters> counters;
  const tilecore::TileOrder order(gpu_.tilecore.tile_order, grid_);
  tilecore::TessellationCache cache(static_cast<std::uint64_t>(gpu_.tessellator.cache_bytes), grid_, order);
  std::vector<std::vector<tilecore::TessellationRequest>> requests(tile_count);
  for (bool done = false, first = true; !done; first = false) {
    done = binner.run(frame, front_end.sub_patches, cursor);
    charge(result.stages.bin_seconds);
    // A full parameter buffer: the tiles' samples so far must survive.
    const bool keep = keep_tiles || !done || !first;
    if (keep) result.tiles.resize(tile_count);
    parallel_for(tile_count, [&](std::size_t t) {
      const auto tile = static_cast<binner::TileIndex>(t);
      tilecore::TileCore& core = cores_.local();
      memory::Ledger ledger;
      std::vector<binner::ListEntry> entries = binner.read_tile(frame, tile, ledger, queue_bytes_read.local());
      core.charge(ledger);
      tilecore::TileState& state = keep ? result.tiles[t] : states_.local();
      if (!keep) state.started = false;
      core.render_entries(job, tile, std::move(entries), state);
      tilecore::TileResult tile_result = core.take_result();
      requests[t] = std::move(tile_result.tessellations);
      tessera::merge(counters.local(), tile_result.counters.tilecore);
    });
    for (const binner::TileIndex tile : order.tiles()) cache.use(tile, requests[tile]);
    charge(result.stages.tile_seconds);
    if (!done) binner.reset();
  }
  result.tessellation = cache.counters();
  counters.for_each([&](const tilecore::TileCoreCounters& counted) { tessera::merge(result.counters, counted); });
  result.sub_patches = std::move(front_end.sub_patches);
  return result;
}

}  // namespace tessera::test

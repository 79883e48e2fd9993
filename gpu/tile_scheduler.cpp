#include "gpu/tile_scheduler.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "base/check.h"
#include "base/thread_clock.h"
#include "gpu/image_passes.h"

namespace tessera::gpu {
namespace {

// Number of neighbouring tiles that one thread renders: it finds most of their meshes in its own memory.
constexpr std::size_t kTilesTogether = 16;

// Adds the thread's processor time during the object's life.
class BusyTimer {
 public:
  explicit BusyTimer(double& seconds) : seconds_(seconds), start_(thread_seconds()) {}
  ~BusyTimer() { seconds_ += thread_seconds() - start_; }
  BusyTimer(const BusyTimer&) = delete;
  BusyTimer& operator=(const BusyTimer&) = delete;

 private:
  double& seconds_;
  double start_;
};

// Returns a function that gives the bytes of a tile in an array with so many bytes a pixel.
auto bytes_of(std::uint64_t pixel_bytes) {
  return [pixel_bytes](IntRect pixels) {
    return pixel_bytes * static_cast<std::uint64_t>(pixels.width()) * static_cast<std::uint64_t>(pixels.height());
  };
}

void add_lights(const tilecore::CoreCounters& counters, LightUse& use) {
  use.invocations += counters.gbuffer.filled;
  use.warps += counters.gbuffer.light_warps;
  use.lookups += counters.gbuffer.light_lookups;
  use.tile_bytes += counters.gbuffer.tile_bytes + counters.lights.tile_bytes;
}

}  // namespace

struct TileScheduler::Round {
  WorkRecorder::Round work;
  std::vector<SharedRequests> shared;            // per tile
  std::vector<tilecore::TileState>& unfinished;  // empty unless there are partial renders
  const GeometryPass& pass;
  bool last;                    // last round of the pass: no partial render follows
  std::vector<bool> unchanged;  // tiles that are not rendered; empty: none
  // Units that tiles share, in the state that earlier tiles in emulated order left.
  binner::RecordCache records;
  TileArray depths{memory::Unit::kTilecore, memory::Purpose::kCoarseDepth, true};
  std::uint64_t depth_offset = 0;
};

TileScheduler::TileScheduler(const ViewRun& run, PerThread<tilecore::TileCore>& cores, binner::Binner& binner,
                             const tilecore::TileOrder& order, tilecore::TessellationCache& cache, PassEnd pass_end)
    : run_(run), cores_(cores), binner_(binner), order_(order), cache_(cache), pass_end_(std::move(pass_end)) {}

void TileScheduler::render_tile(Round& round, std::size_t t) {
  const tilecore::TileJob& job = run_.job;
  const auto tile = static_cast<binner::TileIndex>(t);
  current_work_place() = {run_.result.frame, static_cast<std::int64_t>(t), -1};
  tilecore::TileCore& core = cores_.local();
  TileCounts& counts = run_.result.maps.tiles[t];
  WorkRecorder::Tile work = round.work.tile(t, core);
  memory::Ledger ledger;
  ledger.record_into(work.log());
  std::vector<binner::ListEntry> entries = binner_.read_tile(*job.frame, tile, ledger, counts.queue_bytes_read);
  core.charge(ledger);
  SharedRequests& shared = round.shared[t];
  const auto blends = [&](const binner::ListEntry& entry) {
    return job.frame->drawable_of(entry.base_patch).material->alpha_mode == scene::AlphaMode::kBlend;
  };
  if (round.pass.depths_only) std::erase_if(entries, blends);
  for (const binner::ListEntry& entry : entries) shared.records.push_back(entry.record);
  if (std::vector<scene::MaterialEffects>& drawn = run_.result.materials.tiles; !drawn.empty())
    for (const binner::ListEntry& entry : entries)
      drawn[t] |= job.frame->drawable_of(entry.base_patch).material->effects;
  tilecore::TileState fresh;
  tilecore::TileState& state = round.unfinished.empty() ? fresh : round.unfinished[t];
  if (round.last || !entries.empty()) {
    shared.began = !state.started && round.pass.only.empty();
    state.depths_alone = round.pass.depths_only;
    if (!prepass_.empty() && !round.pass.depths_only && shared.began) {
      state.hide_behind(prepass_[t], job.grid->pixels(tile).width(), job.pattern->samples_per_pixel());
      core.count(run_.arrays->sample_depths.load(t));
    }
    if (shared.began && !round.pass.depths_only && !run_.job.stores_gbuffer()) core.load_colors(job, tile, job.actions);
    if (state.started) core.load_state(job, state);
    if (ObservedWork* const record = round.pass.record_of(run_))
      for (const binner::ListEntry& entry : entries) {
        record->entries[t].push_back(entry);
        record->entries[t].back().record += records_before_;
      }
    core.render_entries(job, tile, std::move(entries), state);
    if (round.last)
      shared.finished = finish_tile(round, t, state);
    else
      core.store_state(job, state);
  }
  tilecore::TileResult result = core.take_result();
  count_tessellations(result.tessellations, counts);
  if (ObservedWork* const record = round.pass.record_of(run_)) add_lights(result.counters, record->lights[t]);
  work.end(job, result, shared.finished && !run_.job.stores_gbuffer());
  count_work(result.counters, counts);
  shared.tessellations = std::move(result.tessellations);
  shared.hidden = std::move(result.hidden);
  shared.cells = std::move(result.cells);
  shared.stored = result.stored;
  if (shared.finished && run_.job.stores_gbuffer()) light_tile(t, state);
}

bool TileScheduler::finish_tile(const Round& round, std::size_t t, tilecore::TileState& state) {
  const std::vector<bool>& open = round.pass.open;
  const auto tile = static_cast<binner::TileIndex>(t);
  tilecore::TileCore& core = cores_.local();
  const bool finished = open.empty() || !open[t];
  if (round.pass.depths_only)
    prepass_[t] = core.prepass_depths(state);
  else if (run_.job.stores_gbuffer())
    core.fill(run_.job, tile, state);
  else if (run_.job.depths != nullptr)
    core.finish_depths(run_.job, tile, state);
  else if (finished)
    core.finish(run_.job, tile, state, run_.result.targets, !open.empty());
  else
    core.finish_scene_color(run_.job, tile, state);
  if (finished) store_texels(round.pass, t, state);
  return finished;
}

std::vector<bool> TileScheduler::compare_inputs(bool complete) {
  if (!complete) {
    run_.inputs->forget();
    return {};
  }
  const StageTimer timer(run_.result, "signatures");
  const SignatureMemory place = signature_memory();
  const std::uint64_t bytes = binner_.grid().tile_count() * run_.job.store.signature_bytes();
  const int frame = run_.result.frame;
  if (run_.inputs->known()) binner_.buffer().read_signatures(place.of_inputs(frame - 1), bytes);
  binner_.buffer().write_signatures(place.of_inputs(frame), bytes);
  EliminationCounters& counters = run_.result.counters.elimination;
  const std::uint64_t before = counters.signature_bytes;
  std::vector<bool> unchanged = run_.inputs->unchanged(run_.gpu, run_.job, binner_, counters);
  run_.recorder.hashed(counters.signature_bytes - before);
  return unchanged;
}

SignatureMemory TileScheduler::signature_memory() const {
  return {binner_.grid().tile_count(), run_.job.store.signature_bytes(), run_.job.burst_bytes()};
}

void TileScheduler::share_signatures(WorkRecorder::Round& round, std::span<const SharedRequests> tiles,
                                     const tilecore::FrameStore& store, std::uint64_t place) {
  using memory::Purpose;
  using memory::Unit;
  if (store.before == nullptr) return;
  const std::uint64_t bytes = store.signature_bytes();
  TileArray before{Unit::kResolve, Purpose::kSignatures, false, place},
      now{Unit::kResolve, Purpose::kSignatures, true, place};
  std::uint64_t offset = 0;
  for (const binner::TileIndex tile : order_.tiles()) {
    if (tiles[tile].finished) {
      if (store.before->known) round.move(tile, before, offset, bytes);
      round.move(tile, now, offset, bytes);
    }
    offset += bytes;
  }
}

void TileScheduler::move_attachment(WorkRecorder::Round& round, std::span<const SharedRequests> tiles,
                                    const tilecore::ColorAttachment& attachment, bool write) {
  TileArray array{write ? memory::Unit::kResolve : memory::Unit::kTilecore, memory::Purpose::kAttachment, write,
                  attachment.base};
  const auto moves = [&](binner::TileIndex tile) { return write ? tiles[tile].stored : tiles[tile].began; };
  const tilecore::FrameStore* const store = run_.job.store_of(attachment);
  if (store == nullptr) {  // the history of temporal antialiasing
    run_.arrays->history.move(round, order_, write, moves);
    return;
  }
  if (!store->compressed) {
    this->tiles().move(round, array, bytes_of(attachment.pixel_bytes()), moves);
    return;
  }
  array.base += tilecore::TileStore::header_offset(*store, binner_.grid().region());
  this->tiles().move(
      round, array, [&](IntRect pixels) { return tilecore::TileStore::header_bytes(*store, pixels); }, moves);
}

void TileScheduler::share_stores(WorkRecorder::Round& round, std::span<const SharedRequests> tiles,
                                 const tilecore::AttachmentActions& actions) {
  using memory::Purpose;
  using memory::Unit;
  const auto began = [&](binner::TileIndex tile) { return tiles[tile].began; };
  const auto finished = [&](binner::TileIndex tile) { return tiles[tile].finished; };
  const OrderedTiles all = this->tiles();
  if (actions.color) {
    if (actions.load_color) move_attachment(round, tiles, *actions.color, false);
    move_attachment(round, tiles, *actions.color, true);
    if (const tilecore::FrameStore* const store = run_.job.store_of(*actions.color))
      share_signatures(round, tiles, *store, signature_memory().of_attachment(actions.color->number));
  } else {
    const tilecore::FrameStore& store = run_.job.store;
    const std::uint64_t place = tilecore::TileStore::header_offset(store, binner_.grid().region());
    const auto bytes = [&](IntRect pixels) { return tilecore::TileStore::header_bytes(store, pixels); };
    if (actions.load_color) all.move(round, {Unit::kTilecore, Purpose::kFrameBuffer, false, place}, bytes, began);
    all.move(round, {Unit::kResolve, Purpose::kFrameBuffer, true, place}, bytes,
             [&](binner::TileIndex tile) { return tiles[tile].stored; });
    share_signatures(round, tiles, store, signature_memory().of_colors());
  }
  if (actions.depth_bytes > 0) run_.arrays->depths.move(round, order_, true, finished);
  if (actions.velocity_bytes > 0) run_.arrays->velocities.move(round, order_, true, finished);
}

void TileScheduler::share_flags(Round& round) {
  if (run_.job.depths == nullptr || !round.last) return;
  TileArray flags{memory::Unit::kResolve, memory::Purpose::kShadowMap, true, run_.job.depths->bytes()};
  std::uint64_t number = 0;
  for (const binner::TileIndex tile : order_.tiles()) {
    if (round.shared[tile].finished) round.work.move(tile, flags, number / 8, 1);
    ++number;
  }
}

std::uint64_t TileScheduler::tile_depth_bytes() const {
  const auto blocks = [&](int side) { return static_cast<std::uint64_t>(side / run_.gpu.depth_block_pixels()); };
  return blocks(run_.gpu.tile.width) * blocks(run_.gpu.tile.height) * sizeof(frontend::DepthCode);
}

void TileScheduler::share(Round& round, binner::TileIndex t) {
  FrameResult& result = run_.result;
  SharedRequests& use = round.shared[t];
  const std::uint64_t table_bytes = round.work.share(t, use, {round.records, cache_});
  result.maps.tiles[t].queue_bytes_read += table_bytes;
  if (round.last && !result.targets.coarse_depth.farthest.empty()) {
    round.work.move(t, round.depths, round.depth_offset, tile_depth_bytes());
    round.depth_offset += tile_depth_bytes();
  }
  if (ObservedWork* const record = round.pass.record_of(run_))
    record->tessellations.insert(record->tessellations.end(), use.tessellations.begin(), use.tessellations.end());
  // share_stores() reads the rest.
  use.records = {}, use.tessellations = {}, use.hidden = {}, use.cells = {};
}

void TileScheduler::render(const GeometryPass& pass) {
  const tilecore::TileJob& job = run_.job;
  const binner::TileIndex tile_count = binner_.grid().tile_count();
  const bool whole = pass.only.empty() && pass.open.empty();
  if (pass.depths_only) prepass_.resize(tile_count);
  if (run_.job.stores_gbuffer()) lit_.resize(tile_count);
  binner::Binner::Cursor cursor;
  ObservedWork* const record = pass.record_of(run_);
  if (record != nullptr) {
    record->entries.resize(tile_count), record->lights.resize(tile_count);
    record->open = pass.open;
  }
  std::vector<tilecore::TileState> unfinished;
  RoundPlace place{pass.name, std::exchange(first_pass_, false) ? run_.waits : pass.waits};
  for (bool done = false; !done;) {
    {
      const StageTimer timer(run_.result, "bin");
      done = pass.binned || binner_.run(*job.frame, pass.sub_patches, cursor);
    }
    std::vector<bool> unchanged;
    if (run_.inputs != nullptr && pass.only.empty()) {
      // A pass behind a prepass draws the same lists.
      if (prepass_.empty() || pass.depths_only) unchanged_ = compare_inputs(whole && done && unfinished.empty());
      unchanged = unchanged_;
    }
    Round round{.work = run_.recorder.begin_round(binner_, order_, place),
                .shared = {},
                .unfinished = unfinished,
                .pass = pass,
                .last = done,
                .unchanged = std::move(unchanged),
                .records = binner::RecordCache(run_.gpu.binner_spec())};
    const StageTimer timer(run_.result, "tiles");
    round.shared.resize(tile_count);
    if (!done) {
      ++run_.result.counters.binner.partial_renders;
      unfinished.resize(tile_count);
    }
    PerThread<double> busy_seconds;
    if (run_.progress != nullptr)
      run_.progress->begin(pass.only.empty() ? tile_count
                                             : static_cast<std::size_t>(std::ranges::count(pass.only, true)));
    const auto render = [&](binner::TileIndex tile) {
      if (!pass.only.empty() && !pass.only[tile]) return;
      const BusyTimer busy(busy_seconds.local());
      if (!round.unchanged.empty() && round.unchanged[tile])
        run_.inputs->keep_images(binner_.grid().pixels(tile), run_.result.targets);
      else
        render_tile(round, tile);
      if (run_.progress != nullptr) run_.progress->tile_done();
    };
    const std::vector<binner::TileIndex>& order = order_.tiles();
    parallel_in_order(
        tile_count, kTilesTogether, [&](std::size_t k) { render(order[k]); },
        [&](std::size_t k) { share(round, order[k]); });
    if (run_.progress != nullptr) run_.progress->end();
    busy_seconds.for_each([&](double seconds) { run_.result.stage_seconds["tile_threads"] += seconds; });
    if (pass.depths_only)
      move_depths(round.work, round.shared, true);
    else if (run_.job.stores_gbuffer())
      move_gbuffer(round.work, round.shared, true);
    else
      share_stores(round.work, round.shared, job.actions);
    if (!prepass_.empty() && !pass.depths_only) move_depths(round.work, round.shared, false);
    share_flags(round);
    if (done && !pass.open.empty()) move_scene_color(round.work, tiles(), job, 0, true);
    run_.result.counters.ledger += round.records.ledger();
    if (!done) empty_lists();
    place.waits = true;
  }
  // The pass after another one, and the light pass of a stored G-buffer, count their lookups apart.
  if (record != nullptr && (pass.comes_before() || run_.job.stores_gbuffer()))
    record->textures = run_.recorder.take_textures();
  pass_end_(pass.name);
}

void TileScheduler::render(const ImagePass& pass) {
  const StageTimer timer(run_.result, pass.stage);
  if (pass.begin) pass.begin();
  WorkRecorder::Round round = run_.recorder.begin_round(binner_, order_, {pass.name, pass.waits});
  std::vector<SharedRequests> shared(binner_.grid().tile_count());
  parallel_for(shared.size(), [&](std::size_t t) {
    if (pass.copy != nullptr && !unchanged_.empty() && unchanged_[t]) return;
    tilecore::TileCore& core = cores_.local();
    WorkRecorder::Tile work = round.tile(t, core);
    if (const tilecore::ColorAttachment* const source = pass.copy != nullptr ? &pass.copy->source : pass.loads) {
      core.load_attachment(run_.job, static_cast<binner::TileIndex>(t), *source);
      if (run_.job.store_of(*source) == nullptr) core.count(run_.arrays->history.load(t));
    }
    pass.work(core, static_cast<binner::TileIndex>(t));
    tilecore::TileResult result = core.take_result();
    shared[t].began = pass.copy != nullptr || pass.loads != nullptr;
    shared[t].finished = pass.copy != nullptr;
    shared[t].stored = result.stored;
    work.end(run_.job, result, shared[t].finished);
    count_work(result.counters, run_.result.maps.tiles[t]);
  });
  if (pass.copy != nullptr) {
    move_attachment(round, shared, pass.copy->source, false);
    share_stores(round, shared, pass.copy->actions);
  }
  if (pass.loads != nullptr) move_attachment(round, shared, *pass.loads, false);
  if (pass.share) pass.share(round);
  pass_end_(pass.name);
}

// ---- Shading paths

void TileScheduler::light_tile(std::size_t t, tilecore::TileState& state) {
  tilecore::TileCore& core = cores_.local();
  Lit& lit = lit_[t];
  lit.there = true;
  if (run_.recorder.binner_log() != nullptr) core.record_accesses(&lit.log);
  if (run_.job.shading.layout == tilecore::GbufferLayout::kPacked) core.count(run_.arrays->sample_depths.load(t));
  core.count(run_.arrays->gbuffer.load(t));
  core.load_colors(run_.job, static_cast<binner::TileIndex>(t), run_.job.actions);
  core.light(run_.job, static_cast<binner::TileIndex>(t), state, run_.result.targets);
  lit.result = core.take_result();
}

void TileScheduler::light() {
  const StageTimer timer(run_.result, "light");
  WorkRecorder::Round round = run_.recorder.begin_round(binner_, order_, {run_.light, true});
  std::vector<SharedRequests> shared(binner_.grid().tile_count());
  for (const binner::TileIndex t : order_.tiles()) {
    Lit& lit = lit_[t];
    if (!lit.there) continue;
    WorkRecorder::Tile work = round.tile(t);
    if (work.log() != nullptr) *work.log() = std::move(lit.log);
    shared[t].began = shared[t].finished = true;
    shared[t].stored = lit.result.stored;
    work.end(run_.job, lit.result, true);
    count_work(lit.result.counters, run_.result.maps.tiles[t]);
    round.share_lookups(t);
  }
  move_gbuffer(round, shared, false);
  share_stores(round, shared, run_.job.actions);
  pass_end_(run_.light);
}

void TileScheduler::store_texels(const GeometryPass& pass, std::size_t t, const tilecore::TileState& state) {
  if (run_.arrays == nullptr || run_.job.depths != nullptr) return;
  StoredArrays& arrays = *run_.arrays;
  const tilecore::TileJob& job = run_.job;
  tilecore::TileCore& core = cores_.local();
  const auto spp = static_cast<std::size_t>(job.pattern->samples_per_pixel());
  const auto store_depths = [&](StoredArray& array, bool single) {
    core.count(array.store(t, [&](tilecore::TexelEncoder& encoder) {
      encoder.add_plane([&](int sample, std::size_t texel) {
        return tilecore::depth_code(state.z[texel * spp + static_cast<std::size_t>(sample)], single);
      });
    }));
  };
  if (pass.depths_only) return store_depths(arrays.sample_depths, true);
  const tilecore::AttachmentActions& actions = job.actions;
  if (run_.job.stores_gbuffer()) {
    if (job.shading.layout == tilecore::GbufferLayout::kPacked) store_depths(arrays.sample_depths, true);
    core.count(
        arrays.gbuffer.store(t, [&](tilecore::TexelEncoder& encoder) { core.encode_gbuffer(job, state, encoder); }));
  }
  if (actions.depth_bytes > 0)
    store_depths(arrays.depths, actions.depth_bytes == 4 * static_cast<std::uint64_t>(actions.depth_samples));
  if (actions.velocity_bytes == 0) return;
  const Image& velocity = job.velocities->velocity;
  const IntRect piece = arrays.velocities.piece(t), all = job.velocities->region;
  core.count(arrays.velocities.store(t, [&](tilecore::TexelEncoder& encoder) {
    const auto columns = static_cast<std::size_t>(piece.width());
    encoder.add_plane([&](int, std::size_t texel) {
      const auto v = velocity.at(piece.x0 - all.x0 + static_cast<int>(texel % columns),
                                 piece.y0 - all.y0 + static_cast<int>(texel / columns));
      return tilecore::PixelCode{tilecore::half_bits(v[0]), tilecore::half_bits(v[1]), 0, 0};
    });
  }));
}

void TileScheduler::move_depths(WorkRecorder::Round& round, std::span<const SharedRequests> tiles, bool write) const {
  run_.result.counters.gbuffer.depth_bytes += run_.arrays->sample_depths.move(
      round, order_, write, [&](binner::TileIndex tile) { return write ? tiles[tile].finished : tiles[tile].began; });
}

void TileScheduler::move_gbuffer(WorkRecorder::Round& round, std::span<const SharedRequests> tiles, bool write) const {
  if (run_.job.shading.layout == tilecore::GbufferLayout::kPacked) move_depths(round, tiles, write);
  tilecore::GbufferCounters& counters = run_.result.counters.gbuffer;
  (write ? counters.stored_bytes : counters.loaded_bytes) += run_.arrays->gbuffer.move(
      round, order_, write, [&](binner::TileIndex tile) { return write ? tiles[tile].finished : tiles[tile].began; });
}

void TileScheduler::empty_lists() {
  records_before_ += binner_.buffer().end_of_records();
  binner_.reset();
}

}  // namespace tessera::gpu

#include "timing/events/event_model.h"

#include <algorithm>
#include <deque>
#include <limits>
#include <memory>
#include <optional>

#include "base/check.h"
#include "base/parallel.h"
#include "timing/events/event_queue.h"
#include "timing/events/memory_layout.h"
#include "timing/events/shader_core.h"
#include "timing/events/texture_path.h"
#include "timing/events/visibility_pipe.h"
#include "timing/round_queues.h"

namespace tessera::timing {
namespace {

constexpr std::uint64_t kStoredPixels = 64;      // pixels of a block that is resolved and stored together
constexpr std::uint64_t kGeometryBlock = 32;     // patches that the front end reads together
constexpr std::uint32_t kGeometryReadAhead = 4;  // number of such blocks

// Size of part `index` when `total` is split into `count` nearly equal parts.
std::uint64_t part(std::uint64_t total, std::uint64_t index, std::uint64_t count) {
  return total / count + (index < total % count ? 1 : 0);
}

// The front end and the binner: blocks of patches are read ahead, bounded, binned, and their entries written. Tables of
// heights are read through the L2, at most frontend.fetched_lines at a time.
class GeometryPipe {
 public:
  GeometryPipe(const hardware::Machine& gpu, const MemoryLayout& layout, EventQueue& events, MemoryPath& memory)
      : max_lines_(static_cast<std::size_t>(gpu.queues.table_lines)),
        layout_(layout),
        events_(events),
        memory_(memory) {}

  void begin(const WorkRound& round, double frontend, double binner, double now) {
    const GeometryWork& work = round.geometry;
    work_ = &work;
    lines_ = &round.geometry_lines;
    read_bytes_ = work.dram_bytes - work.written_bytes - (lines_->empty() ? 0 : work.table_bytes);
    next_line_ = lines_waiting_ = 0;
    blocks_ = static_cast<std::uint32_t>(std::clamp<std::uint64_t>(work.patches / kGeometryBlock, 1, 1u << 16));
    frontend_each_ = frontend / blocks_;
    binner_each_ = binner / blocks_;
    asked_ = binned_ = written_ = 0;
    read_at_ = layout_.patches(), write_at_ = layout_.entries();
    frontend_free_ = binner_free_ = now;
    read_ahead(now);
  }
  // Called when the reads of a block have arrived.
  void read(double now) {
    frontend_free_ = std::max(frontend_free_, now) + frontend_each_;
    binner_free_ = std::max(binner_free_, frontend_free_) + binner_each_;
    events_.push(binner_free_, Spent(bound_of(Stage::kBinner), bound_of(Stage::kFrontend), frontend_free_ - now),
                 EventKind::kGeometry);
  }
  // Called when a line of tables for a block has arrived.
  void line_read(std::uint32_t block, double now) {
    --lines_waiting_;
    const auto of = std::find_if(blocks_with_lines_.begin(), blocks_with_lines_.end(),
                                 [&](const BlockLines& b) { return b.block == block; });
    if (--of->to_come == 0) {
      memory_.close_group(of->group, now);
      blocks_with_lines_.erase(of);
    }
    ask_lines(now);
  }
  // Called when a block is binned: its entries are written.
  void binned(double now) {
    const std::uint64_t bytes = part(work_->written_bytes, binned_++, blocks_);
    const std::uint32_t group = memory_.open_group(EventKind::kGeometryWritten, 0, 0);
    memory_.write_bytes(std::exchange(write_at_, write_at_ + bytes), bytes, group, now);
    memory_.close_group(group, now);
    read_ahead(now);
  }
  // Called when the memory has taken a block's entries; returns true after the last block.
  bool written() { return ++written_ == blocks_; }

 private:
  void read_ahead(double now) {
    for (; asked_ < blocks_ && asked_ < binned_ + kGeometryReadAhead; ++asked_) {
      const std::uint64_t bytes = part(read_bytes_, asked_, blocks_), lines = part(lines_->size(), asked_, blocks_);
      const std::uint32_t group = memory_.open_group(EventKind::kGeometryRead, 0, asked_);
      memory_.read_bytes(std::exchange(read_at_, read_at_ + bytes), bytes, group, now);
      if (lines == 0)
        memory_.close_group(group, now);
      else
        blocks_with_lines_.push_back({asked_, group, lines, lines});
    }
    ask_lines(now);
  }

  void ask_lines(double now) {
    for (BlockLines& of : blocks_with_lines_)
      for (; of.to_ask > 0 && lines_waiting_ < max_lines_; --of.to_ask, ++lines_waiting_) {
        const std::uint32_t group = memory_.open_group(EventKind::kGeometryLine, 0, of.block);
        memory_.read_line((*lines_)[next_line_++], group, now);
        memory_.close_group(group, now);
      }
  }

  // A block that waits for lines.
  struct BlockLines {
    std::uint32_t block, group;
    std::uint64_t to_ask, to_come;
  };

  std::size_t max_lines_;
  const MemoryLayout& layout_;
  EventQueue& events_;
  MemoryPath& memory_;
  const GeometryWork* work_ = nullptr;
  const std::vector<std::uint32_t>* lines_ = nullptr;
  std::vector<BlockLines> blocks_with_lines_;  // read ahead, in order
  std::uint64_t read_bytes_ = 0;               // bytes read past the L2
  std::size_t next_line_ = 0, lines_waiting_ = 0;
  std::uint32_t blocks_ = 0, asked_ = 0, binned_ = 0, written_ = 0;
  std::uint64_t read_at_ = 0, write_at_ = 0;
  double frontend_each_ = 0, binner_each_ = 0, frontend_free_ = 0, binner_free_ = 0;
};

// The resolve unit of a core: it resolves and writes blocks of pixels. It waits while more than store_bytes are in
// flight; a tile is stored when the memory has taken all of it.
class StoreUnit {
 public:
  StoreUnit(std::uint32_t core, const hardware::Machine& gpu, EventQueue& events, MemoryPath& memory)
      : core_(core),
        store_bytes_(static_cast<std::uint64_t>(gpu.queues.store_bytes)),
        events_(events),
        memory_(memory) {}

  void begin(const TileWork& work, const TileItems& items, std::uint64_t address, double cycles, double now) {
    items_ = &items;
    address_ = address;
    blocks_ = std::max<std::uint64_t>(work.events[Event::kPixels] / kStoredPixels, 1);
    each_ = cycles / static_cast<double>(blocks_);
    resolved_ = written_ = 0;
    resolving_ = false;
    const std::uint32_t group = memory_.open_group(EventKind::kStore, core_, kRead);
    memory_.read_bytes(address, items.resolve_bytes, group, now);
    memory_.close_group(group, now);
  }
  // Called when the reads for resolving have arrived, or a block is resolved.
  void step(std::uint32_t what, double now) {
    if (what != kRead) {
      const std::uint64_t bytes = part(items_->written_bytes, resolved_++, blocks_);
      const std::uint32_t group = memory_.open_group(EventKind::kWritten, core_, 0);
      memory_.write_bytes(std::exchange(address_, address_ + bytes), bytes, group, now);
      memory_.close_group(group, now);
      resolving_ = false;
    }
    resolve(now);
  }
  // Called when the memory has taken a block; returns true for the last block of the tile.
  bool written(double now) {
    ++written_;
    resolve(now);
    return written_ == blocks_;
  }

 private:
  static constexpr std::uint32_t kRead = 1;

  void resolve(double now) {
    if (resolving_ || resolved_ == blocks_) return;
    const std::uint64_t waiting = (resolved_ - written_) * part(items_->written_bytes, 0, blocks_);
    if (resolved_ > written_ && waiting > store_bytes_) return;
    resolving_ = true;
    events_.push(now + each_, Stage::kResolve, EventKind::kStore, core_, 0);
  }

  std::uint32_t core_;
  std::uint64_t store_bytes_;
  EventQueue& events_;
  MemoryPath& memory_;
  const TileItems* items_ = nullptr;
  std::uint64_t blocks_ = 0, resolved_ = 0, written_ = 0, address_ = 0;
  double each_ = 0;
  bool resolving_ = false;
};

// A core: its units, and the tiles in their phases.
struct Core {
  Core(const hardware::Machine& gpu, const ShaderCore::Rates& rates, std::uint32_t number, EventQueue& events,
       MemoryPath& memory)
      : textures(gpu, number, events, memory),
        shader(number, rates, events, textures),
        visibility(gpu, number, events, {memory, textures, shader}),
        store(number, gpu, events, memory) {}

  TexturePath textures;
  ShaderCore shader;
  VisibilityPipe visibility;
  StoreUnit store;
  std::optional<TileMemory> tile_memory;
  std::array<std::deque<std::size_t>, kPhaseCount> waiting;  // tiles, as positions in Schedule::tiles
  std::array<std::optional<std::size_t>, kPhaseCount> busy;
  // If paths are recorded, for each phase: the path to its begin, and the time that the tile which left it last spent there.
  std::array<PathTime, kPhaseCount> begun{}, spent{};
};

class EventSimulation {
 public:
  EventSimulation(const hardware::Machine& gpu, const FrameWork& work, bool record_path, double limit,
                  std::vector<memory::Burst>* transactions)
      : gpu_(gpu),
        work_(work),
        limit_(limit),
        layout_(work, static_cast<std::uint64_t>(gpu.line_bytes())),
        events_(record_path),
        memory_(gpu, events_, transactions),
        geometry_(gpu, layout_, events_, memory_),
        queues_(gpu, work) {
    const ShaderCore::Rates rates = ShaderCore::rates_of(gpu);
    for (std::uint32_t c = 0; c < static_cast<std::uint32_t>(gpu.cores.count); ++c)
      cores_.push_back(std::make_unique<Core>(gpu, rates, c, events_, memory_));
    for (auto& core : cores_) core->tile_memory.emplace(gpu, work);
    out_.schedule.tiles = tiles_of(work);
    out_.schedule.geometry.resize(work.rounds.size());
    count_units();
  }

  void warm(const WarmCaches& caches) {
    if (caches.l2) memory_.l2() = *caches.l2;
    for (std::size_t c = 0; c < std::min(cores_.size(), caches.textures.size()); ++c)
      cores_[c]->textures.cache() = caches.textures[c];
    for (const memory::LineRange& lines : work_.stored_lines) {
      memory_.l2().drop(lines.first, lines.end);
      for (const auto& core : cores_) core->textures.cache().drop(lines.first, lines.end);
    }
  }
  // Copies the caches after run(), when no request is in flight.
  void keep(WarmCaches& caches) {
    caches.l2 = memory_.l2();
    caches.textures.clear();
    for (const auto& core : cores_) caches.textures.push_back(core->textures.cache());
  }

  EventSchedule run() {
    while (!queues_.done()) {
      start(events_.now());
      while (!events_.empty()) {
        if (events_.now() > limit_) {
          out_.schedule.cycles = events_.now();
          return std::move(out_);
        }
        handle(events_.pop());
      }
    }
    end_ = events_.now();
    run_other();
    collect();
    return std::move(out_);
  }

 private:
  static double cycles(const StageCycles& all, Stage stage) { return all[static_cast<std::size_t>(stage)]; }

  // Moves the bytes that belong to no round, in one stream.
  void run_other() {
    const double begin = end_;
    const std::uint64_t read = work_.other_bytes - work_.other_written_bytes;
    const std::uint32_t group = memory_.open_group(EventKind::kGeometryWritten, 0, 0);
    memory_.read_bytes(layout_.other(), read, group, begin);
    memory_.write_bytes(layout_.other() + read, work_.other_written_bytes, group, begin);
    memory_.close_group(group, begin);
    for (bool done = false; !done;) {
      const SimulationEvent event = events_.pop();
      done = event.kind == EventKind::kGeometryWritten;
      if (!done) handle(event);
      end_ = std::max(end_, event.time);
    }
    out_.schedule.other = {begin, end_};
    out_.schedule.cycles = end_;
  }

  // Counts the work of all units, round by round.
  void count_units() {
    const auto count_geometry = [&](const WorkRound& round) {
      add_busy(stage_cycles(gpu_, round.geometry), geometry_stages(), 1);
    };
    for (std::size_t r = 0; r < work_.rounds.size(); ++r) {
      const WorkRound& round = work_.rounds[r];
      if (r > 0 || !overlaps(gpu_)) count_geometry(round);
      for (const TileWork& tile : round.tiles) {
        tile_cycles_.push_back(stage_cycles(gpu_, tile));
        for (std::size_t p = 0; p < kPhaseCount; ++p)
          add_busy(tile_cycles_.back(), phase_stages(static_cast<Phase>(p)), static_cast<double>(gpu_.cores.count));
      }
    }
    if (overlaps(gpu_) && !work_.rounds.empty()) count_geometry(work_.rounds.front());
  }

  // Starts geometry, then tiles, of all rounds that need not wait.
  void start(double now) {
    do {
      do begin_geometry(now);
      while (queues_.open_tiles());
      dispatch(now);
    } while (queues_.open_tiles());
  }
  void begin_geometry(double now) {
    while (const std::optional<std::size_t> number = queues_.begin_geometry(events_.empty())) {
      const WorkRound& round = work_.rounds[*number];
      out_.schedule.geometry[*number] = {now, now};
      if (round.geometry.patches == 0) {
        queues_.end_geometry();
        continue;
      }
      const StageCycles all = stage_cycles(gpu_, round.geometry);
      geometry_.begin(round, cycles(all, Stage::kFrontend), cycles(all, Stage::kBinner), now);
    }
  }

  void add_busy(const StageCycles& all, std::span<const Stage> stages, double instances) {
    for (const Stage stage : stages) {
      const auto s = static_cast<std::size_t>(stage);
      out_.busy[s] += all[s] / instances;
    }
  }

  const TileWork& tile_of(std::size_t tile) const {
    const TileSchedule& of = out_.schedule.tiles[tile];
    return work_.rounds[of.round].tiles[of.index];
  }
  const TileItems& items_of(std::size_t tile) const {
    const TileSchedule& of = out_.schedule.tiles[tile];
    return work_.rounds[of.round].items[of.index];
  }
  TileSchedule::Span& span_of(std::uint32_t core, Phase phase) {
    const auto p = static_cast<std::size_t>(phase);
    return out_.schedule.tiles[*cores_[core]->busy[p]].phases[p];
  }

  void handle(const SimulationEvent& e) {
    const double now = e.time;
    switch (e.kind) {
      case EventKind::kMemory:
        return memory_.memory_has_read(e.what, now);
      case EventKind::kTextureFill:
        return cores_[e.who]->textures.fill(e.what, now);
      case EventKind::kTextureFree:
        return cores_[e.who]->textures.free_again(now);
      case EventKind::kFetch:
        return cores_[e.who]->visibility.fetch(now);
      case EventKind::kListRead:
        span_of(e.who, Phase::kVisibility).flow = now;
        return cores_[e.who]->visibility.list_read(now);
      case EventKind::kItemRead:
        return cores_[e.who]->visibility.item_read(e.what, now);
      case EventKind::kDomainStart:
        return cores_[e.who]->visibility.domain_start(e.what, now);
      case EventKind::kDomainRead:
        return cores_[e.who]->shader.heights_read(e.what, now);
      case EventKind::kDomainShaded:
        return cores_[e.who]->visibility.domain_shaded(e.what, now);
      case EventKind::kAlphaStart:
        return cores_[e.who]->visibility.alpha_start(e.what, now);
      case EventKind::kAlphaRead:
        return cores_[e.who]->visibility.alpha_read(e.what, now);
      case EventKind::kTested:
        return end_phase(e.who, Phase::kVisibility, now);
      case EventKind::kShadingRead:
        span_of(e.who, Phase::kShading).flow = now;
        return cores_[e.who]->shader.begin(items_of(*cores_[e.who]->busy[1]), now);
      case EventKind::kWarpReady:
        return cores_[e.who]->shader.warp_packed(now);
      case EventKind::kIssue:
        return cores_[e.who]->shader.lanes_free(now);
      case EventKind::kWarpRead:
        return cores_[e.who]->shader.texels_read(e.what, now);
      case EventKind::kShaded:
        return shaded(e.who, now);
      case EventKind::kBanks:
        return memory_.banks_answer(now);
      case EventKind::kStore:
        return cores_[e.who]->store.step(e.what, now);
      case EventKind::kWritten:
        if (cores_[e.who]->store.written(now)) end_phase(e.who, Phase::kStore, now);
        return;
      case EventKind::kGeometryLine:
        return geometry_.line_read(e.what, now);
      case EventKind::kGeometryRead:
        return geometry_.read(now);
      case EventKind::kGeometry:
        return geometry_.binned(now);
      case EventKind::kGeometryWritten:
        if (geometry_.written()) end_geometry(now);
        return;
    }
  }

  // The blend unit composes layers while others are shaded; it ends when it has had time for all of them.
  void shaded(std::uint32_t c, double now) {
    const std::size_t tile = *cores_[c]->busy[1];
    const double blended = span_of(c, Phase::kShading).flow + cycles(tile_cycles_[tile], Stage::kBlend);
    if (blended > now)
      events_.push(blended, Stage::kBlend, EventKind::kShaded, c);
    else
      end_phase(c, Phase::kShading, now);
  }

  void dispatch(double now) {
    for (bool again = true; again;) {
      again = false;
      for (std::uint32_t c = 0; c < cores_.size(); ++c)
        for (std::size_t phase = kPhaseCount; phase-- > 1;) {
          Core& core = *cores_[c];
          if (core.busy[phase] || core.waiting[phase].empty()) continue;
          const std::size_t tile = core.waiting[phase].front();
          core.waiting[phase].pop_front();
          begin_phase(c, static_cast<Phase>(phase), tile, now);
          again = true;
        }
      again = give_tile(now) || again;
    }
  }

  // Gives the next tile to the core with the fewest tiles in progress, the first of equals.
  bool give_tile(double now) {
    const std::size_t next = queues_.next_tile();
    if (next == queues_.tiles_open()) return false;
    std::uint32_t best = 0;
    bool found = false;
    for (std::uint32_t c = 0; c < cores_.size(); ++c) {
      if (cores_[c]->busy[0] || !cores_[c]->tile_memory->has_room(tile_of(next)) ||
          (found && cores_[c]->tile_memory->tiles() >= cores_[best]->tile_memory->tiles()))
        continue;
      best = c;
      found = true;
    }
    if (!found) return false;
    cores_[best]->tile_memory->take(tile_of(next));
    out_.schedule.tiles[next].core = best;
    queues_.give_tile();
    begin_phase(best, Phase::kVisibility, next, now);
    return true;
  }

  void begin_phase(std::uint32_t c, Phase phase, std::size_t tile, double now) {
    Core& core = *cores_[c];
    core.busy[static_cast<std::size_t>(phase)] = tile;
    span_of(c, phase).begin = span_of(c, phase).flow = now;
    if (events_.recording()) begin_path(core, phase, tile);
    if (phase == Phase::kVisibility) {
      core.visibility.begin(tile_of(tile), items_of(tile), layout_.list_of(tile_of(tile).tile), now);
    } else if (phase == Phase::kShading) {
      const TileItems& items = items_of(tile);
      const std::uint32_t group = memory_.open_group(EventKind::kShadingRead, c, 0);
      for (std::size_t k = items.lines.size() - items.shading_lines; k < items.lines.size(); ++k)
        memory_.read_line(items.lines[k], group, now);
      memory_.close_group(group, now);
    } else {
      core.store.begin(tile_of(tile), items_of(tile), layout_.pixels_of(tile_of(tile).tile),
                       cycles(tile_cycles_[tile], Stage::kResolve), now);
    }
  }

  void end_phase(std::uint32_t c, Phase phase, double now) {
    Core& core = *cores_[c];
    const auto p = static_cast<std::size_t>(phase);
    span_of(c, phase).end = now;
    const std::size_t tile = *core.busy[p];
    if (events_.recording()) end_path(core, phase, tile);
    core.busy[p].reset();
    if (phase == Phase::kStore) {
      core.tile_memory->free(tile_of(tile));
      queues_.tile_stored(out_.schedule.tiles[tile].round);
    } else {
      core.waiting[p + 1].push_back(tile);
    }
    start(now);
  }

  void end_geometry(double now) {
    out_.schedule.geometry[queues_.end_geometry()].end = now;
    start(now);
  }

  // A wait for a phase that works on another tile is split as that tile's time in the phase.
  void begin_path(Core& core, Phase phase, std::size_t tile) {
    const auto p = static_cast<std::size_t>(phase);
    core.begun[p] = events_.path();
    const auto& phases = out_.schedule.tiles[tile].phases;
    if (p > 0) add_share(tile, core.spent[p], phases[p].begin - phases[p - 1].end);
  }
  // Lines that other tiles asked for bring those tiles' paths: a part that is smaller than at the begin counts as zero.
  void end_path(Core& core, Phase phase, std::size_t tile) {
    const auto p = static_cast<std::size_t>(phase);
    for (std::size_t k = 0; k < kPathParts; ++k)
      core.spent[p].clk[k] = std::max(events_.path().clk[k] - core.begun[p].clk[k], 0.0);
    const TileSchedule::Span& span = out_.schedule.tiles[tile].phases[p];
    add_share(tile, core.spent[p], span.end - span.begin);
  }
  // Adds `clk` cycles to the path of a tile, split in proportion to `parts`.
  void add_share(std::size_t tile, const PathTime& parts, double clk) {
    const double all = parts.total();
    PathTime& path = out_.schedule.tiles[tile].path;
    for (std::size_t k = 0; k < kPathParts && all > 0; ++k) path.clk[k] += clk * parts.clk[k] / all;
  }

  void collect() {
    SimulationCounts& counts = out_.counts;
    counts.memory = memory_.counts();
    counts.events = events_.count();
    counts.path = events_.path();
    const auto cores = static_cast<double>(cores_.size());
    for (const auto& core : cores_) {
      core->shader.end(end_);
      counts.texture_requests += core->textures.requests();
      counts.texture_misses += core->textures.misses();
      const DomainCounts& domain = core->shader.domain();
      counts.domain.vertices += domain.vertices, counts.domain.warps += domain.warps;
      counts.domain.texels += domain.texels, counts.domain.lanes_busy += domain.lanes_busy / cores;
      for (std::size_t s = 0; s < kStallCount; ++s) counts.stalls[s] += core->shader.stalls()[s] / cores;
    }
    const auto busy = [&](Stage stage) -> double& { return out_.busy[static_cast<std::size_t>(stage)]; };
    busy(Stage::kDram) = counts.memory.memory_busy;
    // The counts of these units come from the units themselves.
    busy(Stage::kShader) = busy(Stage::kTexture) = 0;
    for (const auto& core : cores_) {
      busy(Stage::kShader) += core->shader.busy() / cores;
      busy(Stage::kTexture) += core->textures.busy() / cores;
    }
  }

  const hardware::Machine& gpu_;
  const FrameWork& work_;
  double limit_;
  MemoryLayout layout_;
  EventQueue events_;
  MemoryPath memory_;
  GeometryPipe geometry_;
  std::vector<std::unique_ptr<Core>> cores_;
  RoundQueues queues_;
  std::vector<StageCycles> tile_cycles_;
  double end_ = 0;
  EventSchedule out_;
};

}  // namespace

namespace {

// Doubling a unit halves its part of the path and saves little more, as tiles and lines also change their order. With
// more cache, more requests or more tiles in flight waits may vanish, but no unit's busy time shrinks.
constexpr double kOtherOrder = 1.05;

std::vector<BoundGuess> guesses_of(const hardware::Machine& gpu, const EventSchedule& schedule) {
  const PathTime& path = schedule.counts.path;
  std::vector<BoundGuess> guesses;
  for (std::size_t s = 0; s < kStageCount; ++s) guesses.push_back({static_cast<Bound>(s), path.clk[s] / 2});
  const double memory = path[bound_of(Stage::kDram)],
               geometry = path[bound_of(Stage::kFrontend)] + path[bound_of(Stage::kBinner)];
  const double slack = schedule.schedule.cycles - *std::max_element(schedule.busy.begin(), schedule.busy.end());
  guesses.push_back({Bound::kLatency, std::min(slack, path[Bound::kLatency] + path[Bound::kL2])});
  guesses.push_back({Bound::kL2, path[Bound::kL2] / 2});
  guesses.push_back({Bound::kCaches, memory + path[Bound::kLatency] + path[Bound::kL2]});
  guesses.push_back({Bound::kTileMemory, std::min(slack, waits_for_tile_memory(gpu, schedule.schedule))});
  guesses.push_back({Bound::kGeometry, geometry / 2});
  guesses.push_back({Bound::kTileCores, tile_time(schedule.schedule) / 2});
  for (BoundGuess& guess : guesses) guess.most *= kOtherOrder;
  return guesses;
}

}  // namespace

bool has_items(const FrameWork& work) {
  return std::all_of(work.rounds.begin(), work.rounds.end(),
                     [](const WorkRound& round) { return round.items.size() == round.tiles.size(); });
}

EventSchedule simulate_events(const hardware::Machine& gpu, const FrameWork& work, WarmCaches* caches, bool record_path,
                              double limit, std::vector<memory::Burst>* transactions) {
  TESSERA_CHECK(has_items(work), "events are made of items");
  EventSimulation simulation(gpu, work, record_path, limit, transactions);
  if (caches != nullptr) simulation.warm(*caches);
  EventSchedule out = simulation.run();
  if (transactions != nullptr)
    std::stable_sort(transactions->begin(), transactions->end(),
                     [](const memory::Burst& a, const memory::Burst& b) { return a.cycle < b.cycle; });
  if (caches != nullptr && out.schedule.cycles <= limit) simulation.keep(*caches);
  return out;
}

namespace {

// The unit with the most work.
Bound likely_bound(const hardware::Machine& gpu, const FrameWork& work) {
  StageCycles busy{};
  const auto add = [&](const StageCycles& cycles, double instances) {
    for (std::size_t s = 0; s < kStageCount; ++s) busy[s] += cycles[s] / instances;
  };
  for (const WorkRound& round : work.rounds) {
    add(stage_cycles(gpu, round.geometry), 1);
    for (const TileWork& tile : round.tiles) add(stage_cycles(gpu, tile), static_cast<double>(gpu.cores.count));
  }
  busy[static_cast<std::size_t>(Stage::kDram)] = static_cast<double>(work.dram_bytes()) / memory_rate(gpu);
  return static_cast<Bound>(std::max_element(busy.begin(), busy.end()) - busy.begin());
}

}  // namespace

TimedEvents time_events(const hardware::Machine& gpu, const FrameWork& work, WarmCaches* caches,
                        std::vector<memory::Burst>* transactions) {
  const WarmCaches before = caches != nullptr ? *caches : WarmCaches();
  const auto with_twice = [&](Bound bound, double limit) {
    WarmCaches own = before;
    return simulate_events(doubled(gpu, bound), work, &own, false, limit).schedule.cycles;
  };
  TimedEvents out;
  const Bound likely = likely_bound(gpu, work);
  std::optional<double> with_likely;
  parallel_for(thread_count() > 1 ? 2 : 1, [&](std::size_t k) {
    if (k == 0)
      out.events = simulate_events(gpu, work, caches, true, std::numeric_limits<double>::infinity(), transactions);
    else
      with_likely = with_twice(likely, std::numeric_limits<double>::infinity());
  });
  const Schedule& schedule = out.events.schedule;
  FrameTiming& timing = out.timing;
  timing.cycles = schedule.cycles;
  timing.latency = latency(gpu, schedule);
  timing.busy = out.events.busy;
  count_tiles(gpu, work, schedule, timing);
  timing.events = out.events.counts;
  timing.bind(
      find_bound(timing.cycles, guesses_of(gpu, out.events), imbalance(gpu, schedule), [&](Bound bound, double limit) {
        return bound == likely && with_likely ? *with_likely : with_twice(bound, limit);
      }));
  return out;
}

void SimulationCounts::accumulate(const SimulationCounts& frame) {
  memory.l2_requests += frame.memory.l2_requests;
  memory.l2_misses += frame.memory.l2_misses;
  memory.read_bytes += frame.memory.read_bytes;
  memory.written_bytes += frame.memory.written_bytes;
  memory.memory_busy += frame.memory.memory_busy;
  memory.activates += frame.memory.activates;
  memory.row_hits += frame.memory.row_hits;
  texture_requests += frame.texture_requests;
  texture_misses += frame.texture_misses;
  domain.vertices += frame.domain.vertices;
  domain.warps += frame.domain.warps;
  domain.texels += frame.domain.texels;
  domain.lanes_busy += frame.domain.lanes_busy;
  for (std::size_t s = 0; s < kStallCount; ++s) stalls[s] += frame.stalls[s];
  events += frame.events;
  for (std::size_t p = 0; p < kPathParts; ++p) path.clk[p] += frame.path.clk[p];
}

}  // namespace tessera::timing

#include "timing/events/event_model.h"

#include <algorithm>
#include <deque>
#include <limits>
#include <memory>

#include "base/check.h"
#include "timing/events/event_queue.h"
#include "timing/events/shader_core.h"
#include "timing/events/texture_path.h"
#include "timing/events/visibility_pipe.h"

namespace tessera::timing {
namespace {

constexpr std::uint64_t kStoredPixels = 64;      // of a block that is resolved and stored together
constexpr std::uint64_t kGeometryBlock = 32;     // patches that the front end reads together
constexpr std::uint32_t kGeometryReadAhead = 4;  // such blocks

// Part `index` of `total` in `count` nearly equal parts.
std::uint64_t part(std::uint64_t total, std::uint64_t index, std::uint64_t count) {
  return total / count + (index < total % count ? 1 : 0);
}

// The front end and the binner: blocks of patches are read ahead, bounded, binned, and their entries written.
class GeometryPipe {
 public:
  GeometryPipe(EventQueue& events, MemoryPath& memory) : events_(events), memory_(memory) {}

  void begin(const GeometryWork& work, double frontend, double binner, double now) {
    work_ = &work;
    blocks_ = static_cast<std::uint32_t>(std::clamp<std::uint64_t>(work.patches / kGeometryBlock, 1, 1u << 16));
    frontend_each_ = frontend / blocks_;
    binner_each_ = binner / blocks_;
    asked_ = done_ = 0;
    frontend_free_ = binner_free_ = now;
    read_ahead(now);
  }
  // What block `block` reads is there; blocks come in order.
  void read(double now) {
    frontend_free_ = std::max(frontend_free_, now) + frontend_each_;
    binner_free_ = std::max(binner_free_, frontend_free_) + binner_each_;
    // Written when it is binned; the memory takes it then or later.
    events_.push(binner_free_, EventKind::kGeometry);
  }
  // The block in hand is binned. True: it was the last.
  bool binned(double now) {
    const double taken = memory_.write_bytes(part(work_->written_bytes, done_, blocks_), now);
    end_ = std::max(end_, taken);
    ++done_;
    read_ahead(now);
    return done_ == blocks_;
  }
  double end() const { return end_; }

 private:
  void read_ahead(double now) {
    for (; asked_ < blocks_ && asked_ < done_ + kGeometryReadAhead; ++asked_) {
      const std::uint32_t group = memory_.open_group(EventKind::kGeometryRead, 0, asked_);
      memory_.read_bytes(part(work_->dram_bytes - work_->written_bytes, asked_, blocks_), group, now);
      memory_.close_group(group, now);
    }
  }

  EventQueue& events_;
  MemoryPath& memory_;
  const GeometryWork* work_ = nullptr;
  std::uint32_t blocks_ = 0, asked_ = 0, done_ = 0;
  double frontend_each_ = 0, binner_each_ = 0, frontend_free_ = 0, binner_free_ = 0, end_ = 0;
};

// The resolve unit of a core: blocks of pixels are resolved and written; writes wait where too many bytes do.
class StoreUnit {
 public:
  StoreUnit(std::uint32_t core, const hardware::Machine& gpu, EventQueue& events, MemoryPath& memory)
      : core_(core),
        slack_(static_cast<double>(gpu.queues.store_bytes) / memory_rate(gpu)),
        events_(events),
        memory_(memory) {}

  void begin(const TileWork& work, const TileItems& items, double cycles, double now) {
    items_ = &items;
    blocks_ = std::max<std::uint64_t>(work.pixels / kStoredPixels, 1);
    each_ = cycles / static_cast<double>(blocks_);
    done_ = 0;
    reading_ = items.resolve_bytes > 0;
    if (reading_) {
      const std::uint32_t group = memory_.open_group(EventKind::kStore, core_, 0);
      memory_.read_bytes(items.resolve_bytes, group, now);
      memory_.close_group(group, now);
    } else {
      events_.push(now + each_, EventKind::kStore, core_);
    }
  }
  // True: the tile is stored.
  bool step(double now) {
    if (std::exchange(reading_, false)) {
      events_.push(now + each_, EventKind::kStore, core_);
      return false;
    }
    const double taken = memory_.write_bytes(part(items_->written_bytes, done_, blocks_), now);
    if (++done_ == blocks_) return true;
    // The next block may be written once no more than store_bytes wait.
    events_.push(std::max(now + each_, taken - slack_), EventKind::kStore, core_);
    return false;
  }

 private:
  std::uint32_t core_;
  double slack_;
  EventQueue& events_;
  MemoryPath& memory_;
  const TileItems* items_ = nullptr;
  std::uint64_t blocks_ = 0, done_ = 0;
  double each_ = 0;
  bool reading_ = false;
};

// A core: its units, and the tiles that are in them.
struct Core {
  Core(const hardware::Machine& gpu, const ShaderCore::Rates& rates, std::uint32_t number, EventQueue& events,
       MemoryPath& memory, std::optional<Stage> fast)
      : textures(gpu, number, events, memory),
        visibility(gpu, number, events, memory, textures, fast),
        shader(number, rates, events, textures),
        store(number, gpu, events, memory) {}

  TexturePath textures;
  VisibilityPipe visibility;
  ShaderCore shader;
  StoreUnit store;
  std::uint64_t in_flight = 0;
  std::array<std::deque<std::size_t>, kPhaseCount> waiting;  // tiles, as positions in Schedule::tiles
  std::array<std::optional<std::size_t>, kPhaseCount> busy;
};

class EventSimulation {
 public:
  EventSimulation(const hardware::Machine& gpu, const FrameWork& work, std::optional<Stage> fast)
      : gpu_(gpu), work_(work), fast_(fast), memory_(gpu, events_, fast == Stage::kDram), geometry_(events_, memory_) {
    ShaderCore::Rates rates = ShaderCore::rates_of(gpu, static_cast<std::uint64_t>(gpu.shader.warp_lanes));
    if (fast == Stage::kShader) rates.operations = rates.surface_operations = 0;
    if (fast == Stage::kCompaction) rates.compaction_clk = 0;
    if (fast == Stage::kTexture) rates.texels_per_clk = std::numeric_limits<double>::infinity();
    for (std::uint32_t c = 0; c < static_cast<std::uint32_t>(gpu.cores.count); ++c)
      cores_.push_back(std::make_unique<Core>(gpu, rates, c, events_, memory_, fast));
    in_flight_ = tiles_in_flight(gpu, work);
  }

  void warm(const WarmCaches& caches) {
    if (caches.l2) memory_.l2() = *caches.l2;
    for (std::size_t c = 0; c < std::min(cores_.size(), caches.textures.size()); ++c)
      cores_[c]->textures.cache() = caches.textures[c];
  }
  // After run(), when nothing is under way.
  void keep(WarmCaches& caches) {
    caches.l2 = memory_.l2();
    caches.textures.clear();
    for (const auto& core : cores_) caches.textures.push_back(core->textures.cache());
  }

  EventSchedule run() {
    for (round_ = 0; round_ < work_.rounds.size(); ++round_) {
      run_geometry();
      run_tiles();
    }
    const double begin = end_;
    for (const bool write : {false, true}) {
      const std::uint64_t bytes = write ? work_.other_written_bytes : work_.other_bytes - work_.other_written_bytes;
      end_ = std::max(end_, write ? memory_.write_bytes(bytes, begin) : memory_.take_bytes(bytes, begin));
    }
    out_.schedule.other = {begin, end_};
    out_.schedule.cycles = end_ = std::max(end_, memory_.free_at());
    collect();
    return std::move(out_);
  }

 private:
  double cycles(const StageCycles& all, Stage stage) const {
    return stage == fast_ ? 0 : all[static_cast<std::size_t>(stage)];
  }

  void run_geometry() {
    const GeometryWork& work = work_.rounds[round_].geometry;
    const StageCycles all = stage_cycles(gpu_, work);
    add_busy(all, geometry_stages(), 1);
    const double begin = end_;
    if (work.patches > 0) {
      geometry_.begin(work, cycles(all, Stage::kFrontend), cycles(all, Stage::kBinner), begin);
      bool done = false;
      while (!done) {
        const Event event = events_.pop();
        if (event.kind == EventKind::kGeometryRead)
          geometry_.read(event.time);
        else if (event.kind == EventKind::kGeometry)
          done = geometry_.binned(event.time);
        else
          handle(event);
      }
      end_ = std::max(events_.now(), geometry_.end());
    }
    out_.schedule.geometry.push_back({begin, end_});
  }

  void run_tiles() {
    const WorkRound& round = work_.rounds[round_];
    first_ = out_.schedule.tiles.size();
    next_ = 0;
    tile_cycles_.clear();
    for (std::size_t i = 0; i < round.tiles.size(); ++i) {
      TileSchedule& tile = out_.schedule.tiles.emplace_back();
      tile.round = static_cast<std::uint32_t>(round_);
      tile.index = static_cast<std::uint32_t>(i);
      tile_cycles_.push_back(stage_cycles(gpu_, round.tiles[i]));
      for (std::size_t p = 0; p < kPhaseCount; ++p)
        add_busy(tile_cycles_.back(), phase_stages(static_cast<Phase>(p)), static_cast<double>(gpu_.cores.count));
    }
    dispatch(end_);
    while (!events_.empty()) {
      const Event event = events_.pop();
      handle(event);
    }
    end_ = std::max(end_, events_.now());
  }

  void add_busy(const StageCycles& all, std::span<const Stage> stages, double instances) {
    for (const Stage stage : stages) {
      const auto s = static_cast<std::size_t>(stage);
      out_.busy[s] += all[s] / instances;
    }
  }

  const TileWork& tile_of(std::size_t tile) const { return work_.rounds[round_].tiles[tile]; }
  const TileItems& items_of(std::size_t tile) const { return work_.rounds[round_].items[tile]; }
  TileSchedule::Span& span_of(std::uint32_t core, Phase phase) {
    const auto p = static_cast<std::size_t>(phase);
    return out_.schedule.tiles[first_ + *cores_[core]->busy[p]].phases[p];
  }

  void handle(const Event& e) {
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
      case EventKind::kStore:
        if (cores_[e.who]->store.step(now)) end_phase(e.who, Phase::kStore, now);
        return;
      case EventKind::kGeometry:
      case EventKind::kGeometryRead:
        break;
    }
    TESSERA_CHECK(false, "geometry has no events while tiles are rendered");
  }

  // The blend unit composes layers while others are shaded, and is done when it had time for all of them.
  void shaded(std::uint32_t c, double now) {
    const std::size_t tile = *cores_[c]->busy[1];
    const double blended = span_of(c, Phase::kShading).flow + cycles(tile_cycles_[tile], Stage::kBlend);
    if (blended > now)
      events_.push(blended, EventKind::kShaded, c);
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

  // The next tile to the core with the fewest tiles in work, the first of equals.
  bool give_tile(double now) {
    if (next_ == work_.rounds[round_].tiles.size()) return false;
    std::uint32_t best = 0;
    bool found = false;
    for (std::uint32_t c = 0; c < cores_.size(); ++c) {
      if (cores_[c]->busy[0] || cores_[c]->in_flight == in_flight_ ||
          (found && cores_[c]->in_flight >= cores_[best]->in_flight))
        continue;
      best = c;
      found = true;
    }
    if (!found) return false;
    ++cores_[best]->in_flight;
    out_.schedule.tiles[first_ + next_].core = best;
    begin_phase(best, Phase::kVisibility, next_++, now);
    return true;
  }

  void begin_phase(std::uint32_t c, Phase phase, std::size_t tile, double now) {
    Core& core = *cores_[c];
    core.busy[static_cast<std::size_t>(phase)] = tile;
    span_of(c, phase).begin = span_of(c, phase).flow = now;
    if (phase == Phase::kVisibility) {
      core.visibility.begin(tile_of(tile), items_of(tile), now);
    } else if (phase == Phase::kShading) {
      const TileItems& items = items_of(tile);
      const std::uint32_t group = memory_.open_group(EventKind::kShadingRead, c, 0);
      for (std::size_t k = items.lines.size() - items.shading_lines; k < items.lines.size(); ++k)
        memory_.read_line(items.lines[k], group, now);
      memory_.close_group(group, now);
    } else {
      core.store.begin(tile_of(tile), items_of(tile), cycles(tile_cycles_[tile], Stage::kResolve), now);
    }
  }

  void end_phase(std::uint32_t c, Phase phase, double now) {
    Core& core = *cores_[c];
    const auto p = static_cast<std::size_t>(phase);
    span_of(c, phase).end = now;
    const std::size_t tile = *core.busy[p];
    core.busy[p].reset();
    if (phase == Phase::kStore)
      --core.in_flight;
    else
      core.waiting[p + 1].push_back(tile);
    dispatch(now);
  }

  void collect() {
    EventCounts& counts = out_.counts;
    counts.memory = memory_.counts();
    counts.events = events_.count();
    const auto cores = static_cast<double>(cores_.size());
    for (const auto& core : cores_) {
      core->shader.end(end_);
      counts.texture_requests += core->textures.requests();
      counts.texture_misses += core->textures.misses();
      for (std::size_t s = 0; s < kStallCount; ++s) counts.stalls[s] += core->shader.stalls()[s] / cores;
    }
    out_.busy[static_cast<std::size_t>(Stage::kDram)] = counts.memory.memory_busy;
  }

  const hardware::Machine& gpu_;
  const FrameWork& work_;
  std::optional<Stage> fast_;
  EventQueue events_;
  MemoryPath memory_;
  GeometryPipe geometry_;
  std::vector<std::unique_ptr<Core>> cores_;
  std::uint64_t in_flight_ = 1;
  std::size_t round_ = 0, first_ = 0, next_ = 0;
  std::vector<StageCycles> tile_cycles_;
  double end_ = 0;
  EventSchedule out_;
};

}  // namespace

bool has_items(const FrameWork& work) {
  return std::all_of(work.rounds.begin(), work.rounds.end(),
                     [](const WorkRound& round) { return round.items.size() == round.tiles.size(); });
}

EventSchedule simulate_events(const hardware::Machine& gpu, const FrameWork& work, std::optional<Stage> infinitely_fast,
                              WarmCaches* caches) {
  TESSERA_CHECK(has_items(work), "events are made of items");
  EventSimulation simulation(gpu, work, infinitely_fast);
  if (caches != nullptr) simulation.warm(*caches);
  EventSchedule out = simulation.run();
  if (caches != nullptr) simulation.keep(*caches);
  return out;
}

FrameTiming time_events(const hardware::Machine& gpu, const FrameWork& work, const EventSchedule& schedule,
                        const WarmCaches& before) {
  FrameTiming timing;
  timing.cycles = schedule.schedule.cycles;
  timing.busy = schedule.busy;
  timing.cores_busy = cores_busy(gpu, schedule.schedule);
  timing.events = schedule.counts;
  find_bound(timing, [&](Stage stage) {
    WarmCaches caches = before;
    return simulate_events(gpu, work, stage, &caches).schedule.cycles;
  });
  return timing;
}

void EventCounts::accumulate(const EventCounts& frame) {
  memory.l2_requests += frame.memory.l2_requests;
  memory.l2_misses += frame.memory.l2_misses;
  memory.read_bytes += frame.memory.read_bytes;
  memory.written_bytes += frame.memory.written_bytes;
  memory.memory_busy += frame.memory.memory_busy;
  texture_requests += frame.texture_requests;
  texture_misses += frame.texture_misses;
  for (std::size_t s = 0; s < kStallCount; ++s) stalls[s] += frame.stalls[s];
  events += frame.events;
}

}  // namespace tessera::timing

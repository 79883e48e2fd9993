#include "timing/timing_model.h"

#include <algorithm>
#include <deque>
#include <limits>
#include <optional>

#include "base/check.h"
#include "base/parallel.h"
#include "timing/round_queues.h"

namespace tessera::timing {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

// A timed piece of work: it waits for its first data, then flows as fast as its units and its share of the memory allow.
struct Job {
  double latency = 0;
  double natural = 0;  // cycles with a memory that never delays it
  double bytes = 0;
};

struct Running {
  Job job;
  std::uint32_t slot = 0;
  double wake = 0;  // time at which the flow begins
  bool flowing = false;
  double left = 1;       // part of the flow that is left
  double rate = 0;       // parts of the flow per cycle
  double bandwidth = 0;  // bytes per clock that it gets
};

// Jobs that run side by side and share the memory.
class SharedTime {
 public:
  explicit SharedTime(double memory_rate) : memory_rate_(memory_rate) {}

  double now() const { return now_; }
  bool idle() const { return running_.empty(); }
  void start(std::uint32_t slot, const Job& job) {
    running_.push_back({job, slot, now_ + job.latency, false, 1, 0, 0});
    changed_ = true;
  }

  // Advances to the next time at which jobs end and returns their slots, in the order in which the jobs were started.
  // Calls `began` for each job whose flow begins.
  template <class Began>
  const std::vector<std::uint32_t>& advance(const Began& began) {
    ended_.clear();
    while (ended_.empty()) {
      for (Running& r : running_)
        if (!r.flowing && r.wake <= now_) r.flowing = changed_ = true, began(r.slot, now_);
      if (changed_) share_memory();
      step();
    }
    return ended_;
  }

 private:
  // Max-min fairness: a job that needs less than an equal share gets its need, and the others share the rest.
  void share_memory() {
    changed_ = false;
    open_.clear();
    double left = memory_rate_;
    for (Running& r : running_) {
      if (!r.flowing) continue;
      r.bandwidth = 0;
      if (r.job.bytes > 0) open_.push_back(&r);
    }
    while (!open_.empty()) {
      const double equal = left / static_cast<double>(open_.size());
      const auto modest = std::stable_partition(
          open_.begin(), open_.end(), [&](const Running* r) { return r->job.bytes > equal * r->job.natural; });
      if (modest == open_.end()) {
        for (Running* r : open_) r->bandwidth = equal;
        break;
      }
      for (auto r = modest; r != open_.end(); ++r) left -= (*r)->bandwidth = (*r)->job.bytes / (*r)->job.natural;
      open_.erase(modest, open_.end());
    }
    for (Running& r : running_) {
      if (!r.flowing) continue;
      const double memory = r.job.bytes > 0 ? r.bandwidth / r.job.bytes : kNever,
                   units = r.job.natural > 0 ? 1 / r.job.natural : kNever;
      r.rate = std::min(memory, units);
    }
  }

  void step() {
    double next = kNever;
    for (const Running& r : running_) next = std::min(next, r.flowing ? r.left / r.rate : r.wake - now_);
    TESSERA_CHECK(next < kNever, "something runs");
    next = std::max(next, 0.0);
    for (Running& r : running_)
      if (r.flowing) r.left = r.left / r.rate <= next ? 0 : r.left - next * r.rate;
    now_ += next;
    // Rounding of the sum must not miss a wake-up.
    for (Running& r : running_)
      if (!r.flowing && r.wake - now_ <= 1e-9 * now_) r.wake = now_;
    const auto done = [](const Running& r) { return r.flowing && r.left == 0; };
    for (const Running& r : running_)
      if (done(r)) ended_.push_back(r.slot), changed_ = true;
    std::erase_if(running_, done);
  }

  double memory_rate_, now_ = 0;
  bool changed_ = false;
  std::vector<Running> running_;
  std::vector<Running*> open_;
  std::vector<std::uint32_t> ended_;
};

constexpr std::array kGeometryStages = {Stage::kFrontend, Stage::kBinner};
constexpr std::array kVisibilityStages = {Stage::kFetch,         Stage::kTessellator, Stage::kBoxes,
                                          Stage::kBoxTests,      Stage::kStencil,     Stage::kSampling,
                                          Stage::kTriangleTests, Stage::kAlphaTests,  Stage::kCoarseDepth};
constexpr std::array kShadingStages = {Stage::kCompaction, Stage::kShader, Stage::kTexture, Stage::kBlend};
constexpr std::array kStoreStages = {Stage::kResolve};

constexpr std::uint64_t kStoredBlock = 64;  // pixels that are stored together

double length_of(const PhaseCycles& phase) { return pipeline_ends(phase.cycles, phase.items).back(); }

// The simulation of one frame.
class FrameSimulation {
 public:
  FrameSimulation(const hardware::Machine& gpu, const FrameWork& work)
      : gpu_(gpu),
        work_(work),
        queues_(gpu, work),
        time_(memory_rate(gpu)),
        cores_(static_cast<std::size_t>(gpu.cores.count)) {
    for (Core& core : cores_) core.memory.emplace(gpu, work);
    schedule_.tiles = tiles_of(work);
    schedule_.geometry.resize(work.rounds.size());
  }

  Schedule run() {
    while (true) {
      start();
      if (time_.idle()) {
        if (queues_.done()) break;
        continue;
      }
      const auto began = [&](std::uint32_t slot, double now) {
        if (slot != geometry_slot()) span_of(slot).flow = now;
      };
      for (const std::uint32_t slot : time_.advance(began)) {
        if (slot == geometry_slot())
          end_geometry();
        else
          end_phase(slot / kPhaseCount, slot % kPhaseCount);
      }
    }
    schedule_.other = run_alone({0, 0, static_cast<double>(work_.other_bytes)});
    schedule_.cycles = time_.now();
    return std::move(schedule_);
  }

 private:
  struct Core {
    std::optional<TileMemory> memory;
    std::array<std::deque<std::size_t>, kPhaseCount>
        waiting;  // tiles, as positions in schedule_.tiles; none for visibility
    std::array<std::optional<std::size_t>, kPhaseCount> busy;
  };

  Job geometry_job(const WorkRound& round) const {
    const GeometryWork& work = round.geometry;
    if (work.patches == 0) return {};
    const auto bytes = static_cast<double>(work.dram_bytes);
    const StageCycles cycles = stage_cycles(gpu_, round.geometry);
    PhaseCycles stages{{}, work.patches};
    for (const Stage stage : kGeometryStages) stages.cycles.push_back(cycles[static_cast<std::size_t>(stage)]);
    return {gpu_.latency_clk(), length_of(stages), bytes};
  }

  Job tile_job(const TileWork& work, Phase phase) const {
    Job job;
    const std::uint64_t bytes = work.dram_bytes[static_cast<std::size_t>(phase)];
    // Latencies in a row: the list, the sub-patches' records, their patches' records; for shading the texels that
    // were asked for first. Stores are posted.
    if (phase == Phase::kVisibility) job.latency = gpu_.latency_clk() * (work.sub_patches > 0 ? 3 : bytes > 0 ? 1 : 0);
    if (phase == Phase::kShading && bytes > 0) job.latency = gpu_.latency_clk();
    job.natural = length_of(phase_cycles(gpu_, work, phase));
    job.bytes = static_cast<double>(bytes);
    return job;
  }

  Schedule::Span run_alone(const Job& job) {
    const double begin = time_.now();
    if (job.latency + job.natural + job.bytes > 0) {
      time_.start(0, job);
      time_.advance([](std::uint32_t, double) {});
    }
    return {begin, time_.now()};
  }

  std::uint32_t geometry_slot() const { return static_cast<std::uint32_t>(cores_.size() * kPhaseCount); }

  // Starts geometry, then tiles, of all rounds that need not wait.
  void start() {
    do {
      do begin_geometry();
      while (queues_.open_tiles());
      dispatch();
    } while (queues_.open_tiles());
  }
  void begin_geometry() {
    while (const std::optional<std::size_t> round = queues_.begin_geometry(time_.idle())) {
      schedule_.geometry[*round] = {time_.now(), time_.now()};
      const Job job = geometry_job(work_.rounds[*round]);
      if (job.latency + job.natural + job.bytes > 0)
        time_.start(geometry_slot(), job);
      else
        end_geometry();
    }
  }

  void end_geometry() { schedule_.geometry[queues_.end_geometry()].end = time_.now(); }

  TileSchedule::Span& span_of(std::uint32_t slot) {
    const std::size_t phase = slot % kPhaseCount;
    return schedule_.tiles[*cores_[slot / kPhaseCount].busy[phase]].phases[phase];
  }

  // Starts all jobs that can start now. A phase that takes no time ends at once, which may let others start.
  void dispatch() {
    bool again = true;
    while (again) {
      again = false;
      for (std::uint32_t c = 0; c < cores_.size(); ++c)
        for (std::size_t phase = kPhaseCount; phase-- > 1;) again = again || start_waiting(c, phase);
      again = again || give_tile();
    }
  }

  bool start_waiting(std::uint32_t c, std::size_t phase) {
    Core& core = cores_[c];
    if (core.busy[phase] || core.waiting[phase].empty()) return false;
    const std::size_t tile = core.waiting[phase].front();
    core.waiting[phase].pop_front();
    begin_phase(c, phase, tile);
    return true;
  }

  const TileWork& work_of(std::size_t tile) const {
    const TileSchedule& scheduled = schedule_.tiles[tile];
    return work_.rounds[scheduled.round].tiles[scheduled.index];
  }

  bool give_tile() {
    const std::size_t next = queues_.next_tile();
    if (next == queues_.tiles_open()) return false;
    std::uint32_t best = 0;
    bool found = false;
    for (std::uint32_t c = 0; c < cores_.size(); ++c) {
      if (cores_[c].busy[0] || !cores_[c].memory->has_room(work_of(next)) ||
          (found && cores_[c].memory->tiles() >= cores_[best].memory->tiles()))
        continue;
      best = c;
      found = true;
    }
    if (!found) return false;
    cores_[best].memory->take(work_of(next));
    schedule_.tiles[next].core = best;
    queues_.give_tile();
    begin_phase(best, 0, next);
    return true;
  }

  void begin_phase(std::uint32_t c, std::size_t phase, std::size_t tile) {
    cores_[c].busy[phase] = tile;
    TileSchedule& scheduled = schedule_.tiles[tile];
    scheduled.phases[phase].begin = scheduled.phases[phase].flow = time_.now();
    const Job job = tile_job(work_.rounds[scheduled.round].tiles[scheduled.index], static_cast<Phase>(phase));
    if (job.latency + job.natural + job.bytes > 0)
      time_.start(static_cast<std::uint32_t>(c * kPhaseCount + phase), job);
    else
      end_phase(c, phase);
  }

  void end_phase(std::size_t c, std::size_t phase) {
    Core& core = cores_[c];
    const std::size_t tile = *core.busy[phase];
    core.busy[phase].reset();
    schedule_.tiles[tile].phases[phase].end = time_.now();
    if (phase + 1 < kPhaseCount) {
      core.waiting[phase + 1].push_back(tile);
    } else {
      core.memory->free(work_of(tile));
      queues_.tile_stored(schedule_.tiles[tile].round);
    }
  }

  const hardware::Machine& gpu_;
  const FrameWork& work_;
  RoundQueues queues_;
  SharedTime time_;
  std::vector<Core> cores_;
  Schedule schedule_;
};

}  // namespace

std::span<const Stage> geometry_stages() { return kGeometryStages; }

std::span<const Stage> phase_stages(Phase phase) {
  if (phase == Phase::kVisibility) return kVisibilityStages;
  if (phase == Phase::kShading) return kShadingStages;
  return kStoreStages;
}

std::vector<double> pipeline_ends(std::span<const double> cycles, std::uint64_t items) {
  // The last item leaves unit u when it has passed units 1 to u itself, after the slowest of them has done all earlier items.
  std::vector<double> ends;
  const auto n = static_cast<double>(std::max<std::uint64_t>(items, 1));
  double sum = 0, slowest = 0;
  for (const double c : cycles) {
    sum += c;
    slowest = std::max(slowest, c);
    ends.push_back(sum / n + slowest * ((n - 1) / n));
  }
  return ends;
}

PhaseCycles phase_cycles(const hardware::Machine& gpu, const TileWork& work, Phase phase) {
  const StageCycles all = stage_cycles(gpu, work);
  PhaseCycles out;
  for (const Stage stage : phase_stages(phase)) out.cycles.push_back(all[static_cast<std::size_t>(stage)]);
  if (phase == Phase::kVisibility) {
    out.items = work.sub_patches;
  } else if (phase == Phase::kShading) {
    out.items = work.events[Event::kShaderLanes] / static_cast<std::uint64_t>(gpu.shader.lanes);
  } else {
    out.items = work.events[Event::kPixels] / kStoredBlock;
    out.cycles.push_back(static_cast<double>(work.dram_bytes.back()) / memory_rate(gpu));
  }
  return out;
}

Schedule schedule_frame(const hardware::Machine& gpu, const FrameWork& work) {
  return FrameSimulation(gpu, work).run();
}

double cores_busy(const hardware::Machine& gpu, const Schedule& schedule) {
  std::vector<double> until(static_cast<std::size_t>(gpu.cores.count), 0.0);
  double busy = 0;
  for (const TileSchedule& tile : schedule.tiles) {
    const double begin = std::max(until[tile.core], tile.phases.front().begin), end = tile.phases.back().end;
    if (end > begin) busy += end - begin;
    until[tile.core] = std::max(until[tile.core], end);
  }
  return busy / static_cast<double>(gpu.cores.count);
}

double latency(const hardware::Machine& gpu, const Schedule& schedule) {
  return overlaps(gpu) ? 2 * schedule.cycles : schedule.cycles;
}

double tile_time(const Schedule& schedule) {
  double time = 0, before = 0;  // `before`: the end of all earlier rounds
  for (std::size_t t = 0; t < schedule.tiles.size();) {
    const std::uint32_t round = schedule.tiles[t].round;
    const double begin = std::max(schedule.tiles[t].phases.front().begin, before);
    for (; t < schedule.tiles.size() && schedule.tiles[t].round == round; ++t)
      before = std::max(before, schedule.tiles[t].phases.back().end);
    time += before - begin;
  }
  return time;
}

double imbalance(const hardware::Machine& gpu, const Schedule& schedule) {
  double idle = 0;
  for (std::size_t t = 0; t < schedule.tiles.size();) {
    const std::uint32_t round = schedule.tiles[t].round;
    std::vector<double> ends(static_cast<std::size_t>(gpu.cores.count), schedule.tiles[t].phases.front().begin);
    for (; t < schedule.tiles.size() && schedule.tiles[t].round == round; ++t) {
      double& end = ends[schedule.tiles[t].core];
      end = std::max(end, schedule.tiles[t].phases.back().end);
    }
    const double last = *std::max_element(ends.begin(), ends.end());
    for (const double end : ends) idle += (last - end) / static_cast<double>(ends.size());
  }
  return idle;
}

namespace {

PassTime pass_time(const FrameWork& work, const Schedule& schedule, std::uint32_t pass) {
  std::optional<Schedule::Span> all;
  const auto add = [&](double begin, double end) {
    if (!all) all = {begin, end};
    all->begin = std::min(all->begin, begin), all->end = std::max(all->end, end);
  };
  for (const TileSchedule& tile : schedule.tiles)
    if (work.rounds[tile.round].pass == pass) add(tile.phases.front().begin, tile.phases.back().end);
  // The next frame's geometry, which begins beside the last tiles, is left out.
  for (std::size_t r = 0; r < work.rounds.size(); ++r)
    if (const Schedule::Span& span = schedule.geometry[r];
        work.rounds[r].pass == pass && work.rounds[r].geometry.patches > 0 && (!all || span.begin < all->end))
      add(span.begin, span.end);
  const Schedule::Span span = all.value_or(Schedule::Span());
  return {work.passes[pass], span.begin, span.end};
}

}  // namespace

void count_tiles(const hardware::Machine& gpu, const FrameWork& work, const Schedule& schedule, FrameTiming& timing) {
  timing.passes.clear();
  for (std::uint32_t pass = 0; pass < work.passes.size(); ++pass)
    timing.passes.push_back(pass_time(work, schedule, pass));
  timing.cores_busy = cores_busy(gpu, schedule);
  for (const TileSchedule& tile : schedule.tiles)
    timing.tiles_busy += (tile.phases.back().end - tile.phases.front().begin) / static_cast<double>(gpu.cores.count);
  timing.memory_waits = waits_for_tile_memory(gpu, schedule);
}

double waits_for_tile_memory(const hardware::Machine& gpu, const Schedule& schedule) {
  struct Core {
    std::uint32_t round = 0xFFFFFFFFu;
    double until = 0, waited = 0;
  };
  std::vector<Core> cores(static_cast<std::size_t>(gpu.cores.count));
  double most = 0;
  for (const TileSchedule& tile : schedule.tiles) {
    Core& core = cores[tile.core];
    const TileSchedule::Span& visibility = tile.phases.front();
    if (core.round == tile.round) core.waited += std::max(0.0, visibility.begin - core.until);
    core.round = tile.round;
    core.until = visibility.end;
    most = std::max(most, core.waited);
  }
  return most;
}

namespace {

// Guesses for units that are busy long enough to matter, and for the other bounds; simulating all of them is cheap.
std::vector<BoundGuess> guesses_of(const hardware::Machine& gpu, const FrameTiming& timing, const Schedule& schedule) {
  std::vector<BoundGuess> guesses;
  const auto busy = [&](Stage stage) { return timing.busy[static_cast<std::size_t>(stage)]; };
  for (std::size_t s = 0; s < kStageCount; ++s)
    if (busy(static_cast<Stage>(s)) * 10 >= timing.cycles) guesses.push_back({static_cast<Bound>(s), timing.cycles});
  guesses.push_back({Bound::kLatency, timing.cycles});
  if (waits_for_tile_memory(gpu, schedule) * 10 >= timing.cycles)
    guesses.push_back({Bound::kTileMemory, timing.cycles});
  if ((busy(Stage::kFrontend) + busy(Stage::kBinner)) * 10 >= timing.cycles)
    guesses.push_back({Bound::kGeometry, timing.cycles});
  guesses.push_back({Bound::kTileCores, tile_time(schedule)});
  return guesses;
}

}  // namespace

FrameTiming time_frame(const hardware::Machine& gpu, const FrameWork& work, const Schedule& schedule) {
  FrameTiming timing;
  timing.cycles = schedule.cycles;
  timing.latency = latency(gpu, schedule);
  for (const WorkRound& round : work.rounds) {
    const StageCycles geometry = stage_cycles(gpu, round.geometry);
    for (const Stage stage : kGeometryStages)
      timing.busy[static_cast<std::size_t>(stage)] += geometry[static_cast<std::size_t>(stage)];
    for (const TileWork& tile : round.tiles) {
      const StageCycles cycles = stage_cycles(gpu, tile);
      for (std::size_t p = 0; p < kPhaseCount; ++p)
        for (const Stage stage : phase_stages(static_cast<Phase>(p)))
          timing.busy[static_cast<std::size_t>(stage)] += cycles[static_cast<std::size_t>(stage)];
    }
  }
  const auto cores = static_cast<double>(gpu.cores.count);
  for (std::size_t p = 0; p < kPhaseCount; ++p)
    for (const Stage stage : phase_stages(static_cast<Phase>(p))) timing.busy[static_cast<std::size_t>(stage)] /= cores;
  timing.busy[static_cast<std::size_t>(Stage::kDram)] = static_cast<double>(work.dram_bytes()) / memory_rate(gpu);
  count_tiles(gpu, work, schedule, timing);

  timing.bind(find_bound(timing.cycles, guesses_of(gpu, timing, schedule), imbalance(gpu, schedule),
                         [&](Bound bound, double) { return schedule_frame(doubled(gpu, bound), work).cycles; }));
  return timing;
}

void FrameTiming::bind(const BoundGain& gain) {
  if (cycles == 0) return;
  bound_by = gain.bound;
  bound_cycles = bound_total[index(gain.bound)] = gain.cycles;
}

void FrameTiming::accumulate(const FrameTiming& frame) {
  cycles += frame.cycles;
  latency += frame.latency;
  cores_busy += frame.cores_busy;
  tiles_busy += frame.tiles_busy;
  memory_waits += frame.memory_waits;
  coarse_cycles += frame.coarse_cycles;
  for (std::size_t s = 0; s < kStageCount; ++s) busy[s] += frame.busy[s];
  if (!bound_by) bound_by = frame.bound_by;
  for (std::size_t b = 0; b < kBoundCount; ++b) {
    bound_total[b] += frame.bound_total[b];
    if (bound_total[b] > bound_total[index(*bound_by)]) bound_by = static_cast<Bound>(b);
  }
  bound_cycles = bound_by ? bound_total[index(*bound_by)] : 0;
  if (!frame.events) return;
  if (!events) events.emplace();
  events->accumulate(*frame.events);
}

}  // namespace tessera::timing

#include "gpu/frame_timeline.h"

#include <algorithm>
#include <span>

namespace tessera::gpu {
namespace {

using timing::kPhaseCount;
using timing::Phase;
using timing::Stage;
using timing::TileSchedule;
using timing::TileWork;

constexpr std::size_t kWindows = FrameTimeline::kWindows;

std::size_t at(Phase phase) { return static_cast<std::size_t>(phase); }

double pipeline_cycles(const GpuConfiguration& gpu, const TileWork& work, Phase phase) {
  const timing::PhaseCycles stages = timing::phase_cycles(gpu, work, phase);
  return timing::pipeline_ends(stages.cycles, stages.items).back();
}

// Times at which the last item of the tile left each stage of a phase, scaled to the phase's actual length.
std::vector<double> stage_ends(const GpuConfiguration& gpu, const TileWork& work, const TileSchedule& tile,
                               Phase phase) {
  const timing::PhaseCycles stages = timing::phase_cycles(gpu, work, phase);
  std::vector<double> ends = timing::pipeline_ends(stages.cycles, stages.items);
  const TileSchedule::Span& span = tile.phases[at(phase)];
  const double scale = ends.back() > 0 ? (span.end - span.flow) / ends.back() : 0;
  for (double& end : ends) end = span.flow + end * scale;
  ends.back() = span.end;
  return ends;
}

// Stages of the tile, each from the end of the previous one, and its waits between phases.
TileTrack track_of(const GpuConfiguration& gpu, const TileWork& work, const TileSchedule& tile) {
  TileTrack track;
  track.round = tile.round, track.index = tile.index, track.tile = work.tile, track.core = tile.core;
  track.begin = tile.phases.front().begin, track.end = tile.phases.back().end;
  double upto = track.begin;
  const auto go_on = [&](Activity activity, double end) {
    if (end > upto) track.spans.push_back({activity, upto, end});
    upto = std::max(upto, end);
  };
  const auto begin = [&](Phase phase) {
    const TileSchedule::Span& span = tile.phases[at(phase)];
    track.unit_wait += std::max(0.0, span.begin - upto);
    go_on(Activity::kWaitForUnit, span.begin);
    track.data_wait += std::max(0.0, span.flow - upto);
    go_on(Activity::kWaitForData, span.flow);
    track.rate_wait += std::max(0.0, span.end - span.flow - pipeline_cycles(gpu, work, phase));
  };
  begin(Phase::kVisibility);
  const std::vector<double> visibility = stage_ends(gpu, work, tile, Phase::kVisibility);
  go_on(Activity::kFetch, visibility[0]);
  go_on(Activity::kTessellate, visibility[1]);
  go_on(Activity::kBvh, visibility[2]);
  go_on(Activity::kSample, visibility.back());
  begin(Phase::kShading);
  go_on(Activity::kShade, tile.phases[at(Phase::kShading)].end);
  begin(Phase::kStore);
  const std::vector<double> store = stage_ends(gpu, work, tile, Phase::kStore);
  go_on(Activity::kResolve, store[0]);
  go_on(Activity::kStore, store.back());
  return track;
}

// Amounts spread over the windows of a frame.
class Windows {
 public:
  explicit Windows(double width) : width_(width), amounts_(kWindows) {}
  void add(double begin, double end, double amount) {
    if (amount <= 0 || width_ <= 0) return;
    const auto window = [&](double clk) { return std::min(kWindows - 1, static_cast<std::size_t>(clk / width_)); };
    for (std::size_t w = window(begin); w <= window(end); ++w) {
      const double low = std::max(begin, width_ * static_cast<double>(w)),
                   high = std::min(end, width_ * static_cast<double>(w + 1));
      amounts_[w] += end > begin ? amount * std::max(0.0, high - low) / (end - begin) : amount;
      if (end <= begin) return;
    }
  }
  // Scales the amounts so that they add up to `sum`, over `unit`.
  std::vector<double> scaled(double sum, double unit) && {
    double all = 0;
    for (const double amount : amounts_) all += amount;
    for (double& amount : amounts_) amount = all > 0 && unit > 0 ? amount * (sum / all) / unit : 0;
    return std::move(amounts_);
  }
  std::vector<double> amounts() && { return std::move(amounts_); }

 private:
  double width_;
  std::vector<double> amounts_;
};

FrameTimeline::Geometry geometry_of(const GpuConfiguration& gpu, const timing::GeometryWork& work,
                                    const timing::Schedule::Span& span) {
  const timing::StageCycles cycles = stage_cycles(gpu, work);
  const double front_end = cycles[static_cast<std::size_t>(Stage::kFrontend)],
               binner = cycles[static_cast<std::size_t>(Stage::kBinner)];
  const std::vector<double> ends = timing::pipeline_ends(std::vector<double>{front_end, binner}, work.patches);
  const double scale = ends.back() > 0 ? (span.end - span.begin) / ends.back() : 0;
  // The binner starts when the first patch has passed the front end.
  const double first = span.begin + scale * front_end / static_cast<double>(std::max<std::uint64_t>(work.patches, 1));
  return {0,
          span.begin,
          work.events[timing::Event::kBounds] > 0 ? span.begin + ends.front() * scale : span.begin,
          first,
          span.end,
          work.events[timing::Event::kBounds],
          work.events[timing::Event::kBinnedEntries]};
}

using Steps = std::vector<std::pair<double, double>>;

// The sum of two functions of time that are 0 before their first step.
Steps sum_of(const Steps& a, const Steps& b) {
  Steps sum;
  double value_a = 0, value_b = 0;
  for (auto i = a.begin(), j = b.begin(); i != a.end() || j != b.end();) {
    const bool first = j == b.end() || (i != a.end() && i->first <= j->first);
    const double at = first ? i->first : j->first;
    if (first)
      value_a = (i++)->second;
    else
      value_b = (j++)->second;
    sum.emplace_back(at, value_a + value_b);
  }
  return sum;
}

void add_lists(const timing::WorkRound& round, const timing::Schedule::Span& geometry, const TileSchedule* tiles,
               Steps& lists) {
  Steps out;
  const auto all = static_cast<double>(round.geometry.queue_bytes);
  out.emplace_back(geometry.begin, 0);
  out.emplace_back(geometry.end, all);
  // A tile's lists are read to their ends when its visibility phase is done; then their memory could serve again.
  std::uint64_t entries = 0;
  std::vector<std::pair<double, std::uint64_t>> read;
  for (std::size_t i = 0; i < round.tiles.size(); ++i) {
    entries += round.tiles[i].events[timing::Event::kFetchedEntries];
    read.emplace_back(tiles[i].phases.front().end, round.tiles[i].events[timing::Event::kFetchedEntries]);
  }
  std::sort(read.begin(), read.end());
  std::uint64_t left = entries;
  for (const auto& [clk, count] : read) {
    if (count == 0) continue;
    left -= count;
    out.emplace_back(clk, all * static_cast<double>(left) / static_cast<double>(entries));
  }
  // Passes that overlap have lists at once.
  if (lists.empty() || out.front().first >= lists.back().first)
    lists.insert(lists.end(), out.begin(), out.end());
  else
    lists = sum_of(lists, out);
}

void add_tracks(const GpuConfiguration& gpu, const timing::FrameWork& work, const timing::Schedule& schedule,
                FrameTimeline& timeline) {
  std::vector<std::vector<double>> until(static_cast<std::size_t>(gpu.cores.count));  // by core and slot
  for (const TileSchedule& tile : schedule.tiles) {
    TileTrack& track = timeline.tiles.emplace_back(track_of(gpu, work.rounds[tile.round].tiles[tile.index], tile));
    std::vector<double>& slots = until[tile.core];
    const auto free = std::find_if(slots.begin(), slots.end(), [&](double end) { return end <= track.begin; });
    track.slot = static_cast<std::uint32_t>(free - slots.begin());
    if (free == slots.end())
      slots.push_back(track.end);
    else
      *free = track.end;
    timeline.slots = std::max(timeline.slots, static_cast<std::uint32_t>(slots.size()));
  }
}

// Keeps the sum of each window at or below `most`, the peak of a memory or a unit. A surplus moves to the window before, since
// data and work were asked for before they were done; if the windows before are full, it moves to those behind.
void limit_windows(double most, std::span<std::vector<double>> amounts) {
  const auto move = [&](std::size_t from, std::size_t to) {
    double all = 0;
    for (const std::vector<double>& of : amounts) all += of[from];
    if (all <= most) return;
    for (std::vector<double>& of : amounts) {
      const double over = of[from] * (1 - most / all);
      of[from] -= over;
      of[to] += over;
    }
  };
  for (std::size_t w = FrameTimeline::kWindows; w-- > 1;) move(w, w - 1);
  for (std::size_t w = 0; w + 1 < FrameTimeline::kWindows; ++w) move(w, w + 1);
}

void add_windows(const GpuConfiguration& gpu, const timing::FrameWork& work, const timing::Schedule& schedule,
                 const timing::FrameTiming& timing, FrameTimeline& timeline) {
  std::vector<Windows> bytes(kSourceCount, Windows(timeline.window)),
      busy(timing::kStageCount, Windows(timeline.window));
  const auto add_bytes = [&](Source source, double begin, double end, std::uint64_t count) {
    bytes[static_cast<std::size_t>(source)].add(begin, end, static_cast<double>(count));
  };
  for (std::size_t r = 0; r < schedule.geometry.size(); ++r) {
    const timing::Schedule::Span& span = schedule.geometry[r];
    add_bytes(Source::kGeometry, span.begin, span.end, work.rounds[r].geometry.dram_bytes);
    const timing::StageCycles cycles = stage_cycles(gpu, work.rounds[r].geometry);
    for (const Stage stage : timing::geometry_stages())
      busy[static_cast<std::size_t>(stage)].add(span.begin, span.end, cycles[static_cast<std::size_t>(stage)]);
  }
  for (const TileSchedule& tile : schedule.tiles) {
    const TileWork& of = work.rounds[tile.round].tiles[tile.index];
    const timing::StageCycles cycles = stage_cycles(gpu, of);
    for (std::size_t p = 0; p < kPhaseCount; ++p) {
      const TileSchedule::Span& span = tile.phases[p];
      add_bytes(static_cast<Source>(p + 1), span.begin, span.end, of.dram_bytes[p]);
      for (const Stage stage : timing::phase_stages(static_cast<Phase>(p)))
        busy[static_cast<std::size_t>(stage)].add(span.flow, span.end, cycles[static_cast<std::size_t>(stage)]);
    }
  }
  add_bytes(Source::kOther, schedule.other.begin, schedule.other.end, work.other_bytes);
  for (std::size_t s = 0; s < kSourceCount; ++s) timeline.bytes[s] = std::move(bytes[s]).amounts();
  limit_windows(gpu.peak_gb_per_s() * 1e3 / gpu.clock_mhz * timeline.window, timeline.bytes);
  Windows all(timeline.window);
  for (std::size_t s = 0; s < kSourceCount; ++s) {
    for (std::size_t w = 0; w < kWindows; ++w) {
      const double begin = timeline.window * (static_cast<double>(w) + 0.25);
      all.add(begin, begin + timeline.window / 2, timeline.bytes[s][w]);
    }
  }
  busy[static_cast<std::size_t>(Stage::kDram)] = all;
  for (std::size_t s = 0; s < timing::kStageCount; ++s) {
    timeline.busy[s] = std::move(busy[s]).scaled(timing.busy[s], timeline.window);
    limit_windows(1, {&timeline.busy[s], 1});
  }
}

}  // namespace

FrameTimeline frame_timeline(const GpuConfiguration& gpu, const timing::FrameWork& work,
                             const timing::Schedule& schedule, const timing::FrameTiming& timing) {
  FrameTimeline timeline;
  timeline.cycles = schedule.cycles;
  timeline.window = timeline.cycles / static_cast<double>(kWindows);
  std::size_t next = 0;
  for (std::size_t r = 0; r < schedule.geometry.size(); ++r) {
    const timing::WorkRound& round = work.rounds[r];
    timeline.geometry.push_back(geometry_of(gpu, round.geometry, schedule.geometry[r]));
    timeline.geometry.back().pass = round.pass;
    add_lists(round, schedule.geometry[r], schedule.tiles.data() + next, timeline.list_bytes);
    next += round.tiles.size();
  }
  add_tracks(gpu, work, schedule, timeline);
  add_windows(gpu, work, schedule, timing, timeline);
  return timeline;
}

}  // namespace tessera::gpu

#include "gpu/timeline.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

namespace tessera::gpu {
namespace {

using timing::kPhaseCount;
using timing::Phase;
using timing::Stage;
using timing::TileSchedule;
using timing::TileWork;

constexpr int kFrontEndTrack = 1, kBinnerTrack = 2, kDramTrack = 3, kFirstCoreTrack = 10;
constexpr std::size_t kWindows = 256;  // of a frame, for what is shown over time

// When the last item of the tile left each stage of a phase, with the phase as long as it was.
std::vector<double> stage_ends(const GpuConfiguration& gpu, const TileWork& work, const TileSchedule& tile,
                               Phase phase) {
  const timing::PhaseCycles stages = timing::phase_cycles(gpu, work, phase);
  std::vector<double> ends = timing::pipeline_ends(stages.cycles, stages.items);
  const TileSchedule::Span& span = tile.phases[static_cast<std::size_t>(phase)];
  const double scale = ends.back() > 0 ? (span.end - span.flow) / ends.back() : 0;
  for (double& end : ends) end = span.flow + end * scale;
  ends.back() = span.end;
  return ends;
}

struct Stop {
  const char* stage;
  double begin, end;
};

// The stages of a tile, each from the end of the one before.
std::vector<Stop> stops(const GpuConfiguration& gpu, const TileWork& work, const TileSchedule& tile) {
  const std::vector<double> visibility = stage_ends(gpu, work, tile, Phase::kVisibility),
                            store = stage_ends(gpu, work, tile, Phase::kStore);
  const TileSchedule::Span& shading = tile.phases[static_cast<std::size_t>(Phase::kShading)];
  return {{"fetch", tile.phases.front().begin, visibility[0]},
          {"tessellate", visibility[0], visibility[1]},
          {"BVH", visibility[1], visibility[2]},
          {"sample", visibility[2], visibility.back()},
          {"shade", visibility.back(), shading.end},
          {"resolve", shading.end, store[0]},
          {"store", store[0], store.back()}};
}

// Bytes over the memory interface in each of kWindows parts of the frame.
class Windows {
 public:
  explicit Windows(double cycles) : width_(cycles / kWindows), bytes_(kWindows) {}
  void add(double begin, double end, double bytes) {
    if (bytes <= 0 || width_ <= 0) return;
    const auto window = [&](double at) { return std::min(kWindows - 1, static_cast<std::size_t>(at / width_)); };
    for (std::size_t w = window(begin); w <= window(end); ++w) {
      const double low = std::max(begin, width_ * static_cast<double>(w)),
                   high = std::min(end, width_ * static_cast<double>(w + 1));
      bytes_[w] += end > begin ? bytes * std::max(0.0, high - low) / (end - begin) : bytes;
      if (end <= begin) return;
    }
  }
  double bytes(std::size_t w) const { return bytes_[w]; }
  double begin(std::size_t w) const { return width_ * static_cast<double>(w); }
  double width() const { return width_; }

 private:
  double width_;
  std::vector<double> bytes_;
};

}  // namespace

Timeline::Timeline(const std::filesystem::path& file, const GpuConfiguration& gpu, Limits limits)
    : file_(file), gpu_(gpu), limits_(limits) {
  file_.write("{\"displayTimeUnit\": \"ns\", \"traceEvents\": [");
  event(R"json({"ph": "M", "pid": 1, "name": "process_name", "args": {"name": "GPU (model time)"}})json");
  track(kFrontEndTrack, "front end");
  track(kBinnerTrack, "binner");
  track(kDramTrack, "DRAM");
  for (int c = 0; c < static_cast<int>(gpu.cores.count); ++c) track(kFirstCoreTrack + c, fmt::format("core {}", c));
}

void Timeline::add(int frame, const MachineModel& model) {
  add_geometry(frame, model);
  add_cores(frame, model);
  add_memory(frame, model);
  add_queues(model);
  start_ += model.schedule.cycles;
}

void Timeline::commit() {
  file_.write("\n]}\n");
  file_.commit();
}

void Timeline::add_geometry(int frame, const MachineModel& model) {
  for (const int track : {kFrontEndTrack, kBinnerTrack})
    slice(track, fmt::format("frame {}", frame), 0, model.schedule.cycles);
  for (std::size_t r = 0; r < model.schedule.geometry.size(); ++r) {
    const timing::Schedule::Span& span = model.schedule.geometry[r];
    const timing::GeometryWork& work = model.record.work.rounds[r].geometry;
    const timing::StageCycles cycles = stage_cycles(gpu_, work);
    const double front_end = cycles[static_cast<std::size_t>(Stage::kFrontend)],
                 binner = cycles[static_cast<std::size_t>(Stage::kBinner)];
    const std::vector<double> ends = timing::pipeline_ends(std::vector<double>{front_end, binner}, work.patches);
    const double scale = ends.back() > 0 ? (span.end - span.begin) / ends.back() : 0;
    // The binner starts when the first patch has passed the front end.
    const double first = span.begin + scale * front_end / static_cast<double>(std::max<std::uint64_t>(work.patches, 1));
    if (work.bounds > 0)
      slice(kFrontEndTrack, "bound", span.begin, span.begin + ends.front() * scale,
            fmt::format("\"bounds\": {}", work.bounds));
    slice(kBinnerTrack, "bin", first, span.end, fmt::format("\"entries\": {}", work.entries));
  }
}

void Timeline::add_cores(int frame, const MachineModel& model) {
  for (int c = 0; c < static_cast<int>(gpu_.cores.count); ++c)
    slice(kFirstCoreTrack + c, fmt::format("frame {}", frame), 0, model.schedule.cycles);
  std::vector<double> until(static_cast<std::size_t>(gpu_.cores.count), 0.0);
  for (const TileSchedule& tile : model.schedule.tiles) {
    const double from = std::max(until[tile.core], tile.phases.front().begin);
    until[tile.core] = tile.phases.back().end;
    const std::uint32_t number = model.record.work.rounds[tile.round].tiles[tile.index].tile;
    if (number >= limits_.first_tile && number < limits_.last_tile) add_tile(model, tile, from);
  }
}

void Timeline::add_tile(const MachineModel& model, const TileSchedule& tile, double from) {
  const TileWork& work = model.record.work.rounds[tile.round].tiles[tile.index];
  const int track = kFirstCoreTrack + static_cast<int>(tile.core);
  slice(track, fmt::format("tile {}", work.tile), from, tile.phases.back().end,
        fmt::format("\"begun\": {}, \"entries\": {}, \"shader_invocations\": {}, \"dram_bytes\": {}",
                    microseconds(start_ + tile.phases.front().begin), work.entries, work.shader_invocations,
                    work.dram_bytes[0] + work.dram_bytes[1] + work.dram_bytes[2]));
  for (const Stop& stop : stops(gpu_, work, tile))
    slice(track, stop.stage, std::max(from, stop.begin), std::max(from, stop.end));
}

void Timeline::add_memory(int frame, const MachineModel& model) {
  Windows windows(model.schedule.cycles);
  for (std::size_t r = 0; r < model.schedule.geometry.size(); ++r)
    windows.add(model.schedule.geometry[r].begin, model.schedule.geometry[r].end,
                static_cast<double>(model.record.work.rounds[r].geometry.dram_bytes));
  for (const TileSchedule& tile : model.schedule.tiles)
    for (std::size_t p = 0; p < kPhaseCount; ++p)
      windows.add(tile.phases[p].flow, tile.phases[p].end,
                  static_cast<double>(model.record.work.rounds[tile.round].tiles[tile.index].dram_bytes[p]));
  windows.add(model.schedule.other.begin, model.schedule.other.end, static_cast<double>(model.record.work.other_bytes));

  slice(kDramTrack, fmt::format("frame {}", frame), 0, model.schedule.cycles);
  for (std::size_t w = 0; w < kWindows && windows.width() > 0; ++w) {
    // Bytes per microsecond are megabytes per second.
    counter("DRAM bandwidth", "GB/s", windows.begin(w), windows.bytes(w) / windows.width() * gpu_.clock_mhz * 1e-3);
    if (windows.bytes(w) > 0)
      slice(kDramTrack, "transfer", windows.begin(w), std::min(windows.begin(w + 1), model.schedule.cycles),
            fmt::format("\"bytes\": {}", static_cast<std::uint64_t>(windows.bytes(w))));
  }
  counter("DRAM bandwidth", "GB/s", model.schedule.cycles, 0);
}

void Timeline::add_queues(const MachineModel& model) {
  std::size_t next = 0;
  for (std::size_t r = 0; r < model.schedule.geometry.size(); ++r) {
    const timing::WorkRound& round = model.record.work.rounds[r];
    counter("live queue memory", "bytes", model.schedule.geometry[r].begin, 0);
    counter("live queue memory", "bytes", model.schedule.geometry[r].end,
            static_cast<double>(round.geometry.queue_bytes));
    // Queues are read to their ends when their tiles' visibility is done; then their memory could serve again.
    std::uint64_t entries = 0, left = 0;
    for (const TileWork& tile : round.tiles) entries += tile.entries;
    left = entries;
    std::vector<std::pair<double, std::uint64_t>> read;
    for (std::size_t i = 0; i < round.tiles.size(); ++i, ++next)
      read.push_back({model.schedule.tiles[next].phases.front().end, round.tiles[i].entries});
    std::sort(read.begin(), read.end());
    for (const auto& [at, count] : read) {
      if (count == 0) continue;
      left -= count;
      counter(
          "live queue memory", "bytes", at,
          static_cast<double>(round.geometry.queue_bytes) * static_cast<double>(left) / static_cast<double>(entries));
    }
  }
}

void Timeline::track(int number, const std::string& name) {
  event(fmt::format(R"({{"ph": "M", "pid": 1, "tid": {}, "name": "thread_name", "args": {{"name": "{}"}}}})", number,
                    name));
  event(fmt::format(
      R"({{"ph": "M", "pid": 1, "tid": {0}, "name": "thread_sort_index", "args": {{"sort_index": {0}}}}})", number));
}

void Timeline::slice(int track, const std::string& name, double begin, double end, const std::string& arguments) {
  const double from = microseconds(start_ + begin), to = microseconds(start_ + end);
  if (to <= from) return;
  event(fmt::format(R"({{"ph": "X", "pid": 1, "tid": {}, "name": "{}", "ts": {}, "dur": {}, "args": {{{}}}}})", track,
                    name, from, to - from, arguments));
}

void Timeline::counter(const std::string& name, const std::string& unit, double at, double value) {
  event(fmt::format(R"({{"ph": "C", "pid": 1, "name": "{}", "ts": {}, "args": {{"{}": {}}}}})", name,
                    microseconds(start_ + at), unit, value));
}

void Timeline::event(const std::string& text) {
  file_.write(first_ ? "\n" : ",\n");
  file_.write(text);
  first_ = false;
}

double Timeline::microseconds(double cycle) const { return std::floor(cycle / gpu_.clock_mhz * 1024) / 1024; }

}  // namespace tessera::gpu

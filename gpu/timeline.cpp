#include "gpu/timeline.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace tessera::gpu {
namespace {

constexpr int kFrontEndTrack = 1, kBinnerTrack = 2, kDramTrack = 3, kFirstStageTrack = 16, kFirstSlotTrack = 256,
              kSlotsOfCore = 16;
// Most tracks of a stage, for passes that overlap.
constexpr std::size_t kMaxRows = 32;

// Prefix of a slice's name: the name of its pass, if the frame has several.
std::string pass_prefix(const timing::FrameWork& work, std::uint32_t pass) {
  return work.passes.size() > 1 ? work.passes[pass] + ": " : std::string();
}

int slot_track(std::uint32_t core, std::uint32_t slot) {
  return kFirstSlotTrack + static_cast<int>(core) * kSlotsOfCore + static_cast<int>(slot);
}

}  // namespace

Timeline::Timeline(const std::filesystem::path& file, const GpuConfiguration& gpu, Limits limits,
                   std::string depth_pass)
    : file_(open_trace_file(file)),
      gpu_(gpu),
      limits_(limits),
      depth_pass_(std::move(depth_pass)),
      slots_(static_cast<std::size_t>(gpu.cores.count), 0u) {
  track(kFrontEndTrack, "front end");
  track(kBinnerTrack, "binner");
  track(kDramTrack, "DRAM");
}

void Timeline::track(int number, const std::string& name) { file_->track(number, name); }

void Timeline::add(const FrameResult& result) {
  const MachineModel& model = *result.model;
  const FrameTimeline timeline = frame_timeline(gpu_, model);
  for (std::uint32_t core = 0; core < slots_.size(); ++core)
    for (; slots_[core] < std::max(timeline.slots, 1u); ++slots_[core])
      track(slot_track(core, slots_[core]), fmt::format("core {}, slot {}", core, slots_[core]));
  const std::string name = fmt::format("frame {}", result.frame);
  for (const int of : {kFrontEndTrack, kBinnerTrack, kDramTrack}) slice(of, name, 0, timeline.cycles);
  add_geometry(model, timeline);
  add_stages(result, timeline);
  for (const TileTrack& tile : timeline.tiles)
    if (tile.tile >= limits_.first_tile && tile.tile < limits_.last_tile) add_tile(model, tile, result.maps.columns);
  add_memory(timeline);
  add_waits(timeline);
  add_units(timeline);
  file_->flush();
  start_ += timeline.cycles;
}

void Timeline::add_geometry(const MachineModel& model, const FrameTimeline& frame) {
  for (const FrameTimeline::Geometry& round : frame.geometry) {
    const std::string pass = pass_prefix(model.record.work, round.pass);
    if (round.bounds > 0)
      slice(kFrontEndTrack, pass + "bound", round.bound_begin, round.bound_end,
            std::array{TraceFile::Argument{"bounds", round.bounds}});
    slice(kBinnerTrack, pass + "bin", round.bin_begin, round.bin_end,
          std::array{TraceFile::Argument{"entries", round.entries}});
  }
}

// Each pass takes the first row of its stage that is free when the pass begins.
void Timeline::add_stages(const FrameResult& result, const FrameTimeline& frame) {
  const timing::FrameWork& work = result.model->record.work;
  std::vector<StageSpan> spans = render_stages(frame, work, result.passes, depth_pass_);
  std::stable_sort(spans.begin(), spans.end(),
                   [](const StageSpan& a, const StageSpan& b) { return a.begin < b.begin; });
  std::array<std::vector<double>, kRenderStageCount> ends;
  for (const StageSpan& span : spans) {
    const auto stage = static_cast<std::size_t>(span.stage);
    std::vector<double>& rows = ends[stage];
    std::size_t row = 0;
    while (row < rows.size() && rows[row] > span.begin && row + 1 < kMaxRows) ++row;
    if (row == rows.size()) rows.push_back(0);
    const double begin = std::max(span.begin, rows[row]);
    rows[row] = std::max(rows[row], span.end);
    const int number = kFirstStageTrack + static_cast<int>(stage * kMaxRows + row);
    for (; rows_[stage] < rows.size(); ++rows_[stage]) {
      const std::string queue =
          span.stage == RenderStage::kBinning ? "vertex queue" : fmt::format("fragment queue: {}", name(span.stage));
      track(number, row == 0 ? queue : fmt::format("{} ({})", queue, row + 1));
    }
    slice(number, name(span.stage), begin, span.end,
          std::array{TraceFile::Argument{"pass", work.passes[span.pass]},
                     TraceFile::Argument{span.stage == RenderStage::kBinning ? "rounds" : "tiles",
                                         std::uint64_t{span.tiles}}});
  }
}

void Timeline::add_tile(const MachineModel& model, const TileTrack& tile, int columns) {
  const timing::TileWork& work = model.record.work.rounds[tile.round].tiles[tile.index];
  const auto column = static_cast<std::uint32_t>(std::max(columns, 1));
  const auto whole = [](double cycles) { return static_cast<std::uint64_t>(cycles); };
  const int track = slot_track(tile.core, tile.slot);
  const std::string pass = pass_prefix(model.record.work, model.record.work.rounds[tile.round].pass);
  slice(track, fmt::format("{}tile {}", pass, tile.tile), tile.begin, tile.end,
        std::array{TraceFile::Argument{"x", std::uint64_t{tile.tile % column}},
                   TraceFile::Argument{"y", std::uint64_t{tile.tile / column}},
                   TraceFile::Argument{"entries", work.events[timing::Event::kFetchedEntries]},
                   TraceFile::Argument{"shader_invocations", work.events[timing::Event::kShaderInvocations]},
                   TraceFile::Argument{"dram_bytes", work.dram_bytes[0] + work.dram_bytes[1] + work.dram_bytes[2]},
                   TraceFile::Argument{"cycles", whole(tile.end - tile.begin)},
                   TraceFile::Argument{"cycles_waiting_for_unit", whole(tile.unit_wait)},
                   TraceFile::Argument{"cycles_waiting_for_first_data", whole(tile.data_wait)},
                   TraceFile::Argument{"cycles_waiting_for_bandwidth", whole(tile.rate_wait)}});
  for (const TileTrack::Span& span : tile.spans) slice(track, name(span.activity), span.begin, span.end);
}

void Timeline::add_memory(const FrameTimeline& frame) {
  for (std::size_t w = 0; w < FrameTimeline::kWindows && frame.window > 0; ++w) {
    const double begin = frame.window * static_cast<double>(w);
    double bytes = 0;
    for (const std::vector<double>& of : frame.bytes) bytes += of[w];
    // Bytes per microsecond are megabytes per second.
    counter("DRAM bandwidth", "GB/s", begin, bytes / frame.window * gpu_.clock_mhz * 1e-3);
    if (bytes > 0)
      slice(kDramTrack, "transfer", begin, std::min(begin + frame.window, frame.cycles),
            std::array{TraceFile::Argument{"bytes", static_cast<std::uint64_t>(bytes)}});
  }
  counter("DRAM bandwidth", "GB/s", frame.cycles, 0);
  for (const auto& [at, bytes] : frame.list_bytes) counter("live list memory", "bytes", at, bytes);
}

// Numbers of working and of waiting tiles, from one change to the next.
void Timeline::add_waits(const FrameTimeline& frame) {
  constexpr std::array<std::string_view, 3> kNames = {"tiles at work", "tiles waiting for a unit",
                                                      "tiles waiting for data"};
  std::array<std::vector<std::pair<double, int>>, kNames.size()> steps;
  for (const TileTrack& tile : frame.tiles)
    for (const TileTrack::Span& span : tile.spans) {
      auto& of = steps[span.activity == Activity::kWaitForUnit ? 1 : span.activity == Activity::kWaitForData ? 2 : 0];
      of.emplace_back(span.begin, 1);
      of.emplace_back(span.end, -1);
    }
  for (std::size_t k = 0; k < kNames.size(); ++k) {
    std::sort(steps[k].begin(), steps[k].end());
    counter(kNames[k], "tiles", 0, 0);
    int tiles = 0;
    for (std::size_t s = 0; s < steps[k].size(); ++s) {
      tiles += steps[k][s].second;
      if (s + 1 == steps[k].size() || steps[k][s + 1].first > steps[k][s].first)
        counter(kNames[k], "tiles", steps[k][s].first, tiles);
    }
  }
}

void Timeline::add_units(const FrameTimeline& frame) {
  for (std::size_t s = 0; s < timing::kStageCount; ++s) {
    const std::vector<double>& busy = frame.busy[s];
    if (std::all_of(busy.begin(), busy.end(), [](double part) { return part == 0; })) continue;
    const std::string name = fmt::format("busy: {}", hardware::name(static_cast<hardware::Stage>(s)));
    for (std::size_t w = 0; w < busy.size(); ++w)
      counter(name, "%", frame.window * static_cast<double>(w), 100 * busy[w]);
    counter(name, "%", frame.cycles, 0);
  }
}

void Timeline::slice(int track, std::string_view name, double begin, double end,
                     std::span<const TraceFile::Argument> arguments) {
  const double from = microseconds(start_ + begin), to = microseconds(start_ + end);
  if (to > from) file_->slice(track, name, from, to, arguments);
}

void Timeline::counter(std::string_view name, std::string_view unit, double at, double value) {
  file_->counter(name, unit, microseconds(start_ + at), value);
}

double Timeline::microseconds(double cycle) const { return std::floor(cycle / gpu_.clock_mhz * 1024) / 1024; }

}  // namespace tessera::gpu

#include "replay/timeline_member.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace tessera::replay {
namespace {

using gpu::Activity;
using gpu::FrameTimeline;
using gpu::TileTrack;

constexpr std::size_t kSpans = 8, kWindows = FrameTimeline::kWindows;

std::uint64_t rounded(double cycles) { return static_cast<std::uint64_t>(std::llround(std::max(0.0, cycles))); }

// Position among the spans: of visibility, shading and store, with their waits before them.
std::size_t place(Activity activity, std::size_t upto) {
  switch (activity) {
    case Activity::kWaitForData:
      return upto == 0 ? 0 : upto <= 3 ? 3 : 6;
    case Activity::kWaitForUnit:
      return upto <= 2 ? 2 : 5;
    case Activity::kShade:
      return 4;
    case Activity::kResolve:
    case Activity::kStore:
      return 7;
    default:
      return 1;
  }
}

std::array<std::uint64_t, kSpans> durations(const TileTrack& tile) {
  std::array<double, kSpans> ends{};
  std::size_t upto = 0;
  for (const TileTrack::Span& span : tile.spans) {
    upto = std::max(upto, place(span.activity, upto));
    ends[upto] = span.end;
  }
  std::array<std::uint64_t, kSpans> out{};
  std::uint64_t before = rounded(tile.begin);
  for (std::size_t k = 0; k < kSpans; ++k) {
    const std::uint64_t end = std::max(before, rounded(ends[k]));
    out[k] = end - before;
    before = end;
  }
  return out;
}

template <class Of>
std::string column(const FrameTimeline& timeline, const char* name, const Of& of) {
  std::vector<std::uint64_t> values;
  for (const TileTrack& tile : timeline.tiles) values.push_back(of(tile));
  return fmt::format("  \"{}\": [{}],\n", name, fmt::join(values, ","));
}

std::string windows(const std::vector<double>& amounts, double scale) {
  std::vector<std::uint64_t> values;
  for (const double amount : amounts) values.push_back(rounded(amount * scale));
  return fmt::format("[{}]", fmt::join(values, ","));
}

bool any(const std::vector<double>& amounts) {
  return std::any_of(amounts.begin(), amounts.end(), [](double amount) { return amount > 0; });
}

// The most that is live in each window.
std::vector<double> list_windows(const FrameTimeline& timeline) {
  std::vector<double> most(kWindows);
  double live = 0;
  std::size_t next = 0;
  for (std::size_t w = 0; w < kWindows; ++w) {
    most[w] = live;
    const double end = timeline.window * static_cast<double>(w + 1);
    for (; next < timeline.list_bytes.size() && timeline.list_bytes[next].first < end; ++next) {
      live = timeline.list_bytes[next].second;
      most[w] = std::max(most[w], live);
    }
  }
  return most;
}

}  // namespace

std::string timeline_member(const FrameTimeline& timeline) {
  std::string text = fmt::format(" \"timeline\": {{\"cycles\": {}, \"slots\": {}, \"windows\": {},\n  \"geometry\": [",
                                 rounded(std::ceil(timeline.cycles)), timeline.slots, kWindows);
  const char* between = "";
  for (const FrameTimeline::Geometry& round : timeline.geometry)
    text += fmt::format("{}[{},{},{},{}]", std::exchange(between, ","), rounded(round.bound_begin),
                        rounded(round.bound_end), rounded(round.bin_begin), rounded(round.bin_end));
  text += "],\n";
  text += column(timeline, "tile", [](const TileTrack& tile) { return tile.tile; });
  text += column(timeline, "core", [](const TileTrack& tile) { return tile.core; });
  text += column(timeline, "slot", [](const TileTrack& tile) { return tile.slot; });
  text += column(timeline, "begin", [](const TileTrack& tile) { return rounded(tile.begin); });
  std::vector<std::uint64_t> spans;
  for (const TileTrack& tile : timeline.tiles)
    for (const std::uint64_t cycles : durations(tile)) spans.push_back(cycles);
  text += fmt::format("  \"spans\": [{}],\n  \"bytes\": {{", fmt::join(spans, ","));
  between = "";
  for (std::size_t s = 0; s < gpu::kSourceCount; ++s)
    if (any(timeline.bytes[s]))
      text += fmt::format("{}\n   \"{}\": {}", std::exchange(between, ","), name(static_cast<gpu::Source>(s)),
                          windows(timeline.bytes[s], 1));
  text += "},\n  \"busy\": {";
  between = "";
  for (std::size_t s = 0; s < timing::kStageCount; ++s)
    if (any(timeline.busy[s]))
      text += fmt::format("{}\n   \"{}\": {}", std::exchange(between, ","),
                          hardware::name(static_cast<hardware::Stage>(s)), windows(timeline.busy[s], 100));
  return text + fmt::format("}},\n  \"list_bytes\": {}}},\n", windows(list_windows(timeline), 1));
}

}  // namespace tessera::replay

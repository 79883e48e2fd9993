#include "replay/frame_files.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/exr_file.h"
#include "base/image_codec.h"
#include "shaders_cpp/tone_map.h"

namespace tessera::replay {

const std::vector<std::string>& auxiliary_layers() {
  static const std::vector<std::string> kLayers = {"depth",    "normal", "patch",       "invocations", "rate",
                                                   "velocity", "edges",  "discrepancy", "origin",      "error"};
  return kLayers;
}

bool is_resolve_layer(const std::string& layer) {
  return std::find(auxiliary_layers().begin() + 4, auxiliary_layers().end(), layer) != auxiliary_layers().end();
}

std::string frame_name(int frame) { return fmt::format("frame_{:04d}", frame); }

FrameWriter::~FrameWriter() {
  try {
    writing_.wait();
  } catch (const std::exception&) {
    // A caller that does not call finish() is already leaving for another error.
  }
}

void FrameWriter::add(int frame, tilecore::FrameTargets targets, const std::string& view) {
  if (view.empty()) finish();
  const auto images = std::make_shared<const tilecore::FrameTargets>(std::move(targets));
  const std::string name = frame_name(frame) + (view.empty() ? "" : "." + view);
  writing_.run([this, images, name] { write_exr_of(*images, name); });
  writing_.run([this, images, name] {
    write_png(settings_.folder / (name + ".png"), shaders::to_display(images->color, settings_.exposure));
  });
}

void FrameWriter::finish() { writing_.wait(); }

void FrameWriter::write_exr_of(const tilecore::FrameTargets& targets, const std::string& name) const {
  const std::vector<std::string>& auxiliary = settings_.auxiliary;
  std::vector<ExrChannel> channels;
  for (std::size_t c = 0; c < 4; ++c)
    channels.push_back({std::string(1, "RGBA"[c]), ExrChannel::Type::kHalf, targets.color.values.data() + c, 4});
  const auto wants = [&](const char* layer) {
    return std::find(auxiliary.begin(), auxiliary.end(), layer) != auxiliary.end();
  };
  if (wants("depth")) channels.push_back({"depth.Z", ExrChannel::Type::kFloat, targets.depth.values.data(), 1});
  if (wants("normal"))
    for (std::size_t c = 0; c < 3; ++c)
      channels.push_back(
          {std::string("normal.") + "XYZ"[c], ExrChannel::Type::kHalf, targets.normal.values.data() + c, 3});
  if (wants("patch")) channels.push_back({"patch.id", ExrChannel::Type::kUint, targets.patch.values.data(), 1});
  if (wants("invocations"))
    channels.push_back({"invocations.count", ExrChannel::Type::kHalf, targets.invocations.values.data(), 1});
  if (wants("rate")) channels.push_back({"rate.samples", ExrChannel::Type::kHalf, targets.rate.values.data(), 1});
  if (wants("velocity"))
    for (std::size_t c = 0; c < 2; ++c)
      channels.push_back(
          {std::string("velocity.") + "XY"[c], ExrChannel::Type::kHalf, targets.velocity.values.data() + c, 2});
  if (wants("edges")) channels.push_back({"edges.bit", ExrChannel::Type::kHalf, targets.edges.values.data(), 1});
  if (wants("discrepancy"))
    channels.push_back({"discrepancy.frames", ExrChannel::Type::kHalf, targets.discrepancy.values.data(), 1});
  if (wants("origin")) channels.push_back({"origin.kind", ExrChannel::Type::kHalf, targets.origin.values.data(), 1});
  if (wants("error")) channels.push_back({"error.value", ExrChannel::Type::kFloat, targets.error.values.data(), 1});
  write_exr(settings_.folder / (name + ".exr"), targets.color.width, targets.color.height, channels);
}

std::string tile_maps_json(int frame, const gpu::TileMaps& maps, const std::string& members) {
  std::string text = fmt::format(
      "{{\"schema\": \"tessera.tiles/1\", \"frame\": {}, \"origin\": [{}, {}], \"tile\": [{}, {}], \"grid\": [{}, "
      "{}],\n"
      "{} \"maps\": {{\n",
      frame, maps.x0, maps.y0, maps.tile_width, maps.tile_height, maps.columns, maps.rows, members);
  for (const gpu::TileMapField& field : gpu::kTileMapFields) {
    text += fmt::format(" \"{}\": {{\"unit\": \"{}\", \"meaning\": \"{}\", \"values\": [", field.name, field.unit,
                        field.meaning);
    for (std::size_t t = 0; t < maps.tiles.size(); ++t)
      text += fmt::format("{}{}", t == 0 ? "" : ",", maps.tiles[t].*field.member);
    text += &field == &gpu::kTileMapFields.back() ? "]}\n" : "]},\n";
  }
  return text + "}}\n";
}

std::string tile_maps_name(int frame) { return fmt::format("tiles_{:04d}.json", frame); }

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
  values.reserve(amounts.size());
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
  text += column(timeline, "pass", [&](const TileTrack& tile) { return timeline.geometry[tile.round].pass; });
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

#include "gpu/render_stages.h"

#include <algorithm>
#include <optional>

namespace tessera::gpu {
namespace {

using memory::Purpose;

// The targets that a pass loads and stores.
struct PassTargets {
  bool load_color = false, load_depth = false, store_color = false, store_depth = false;
  bool reloads = false;  // only in rounds after the first: samples of partial renders
};

PassTargets targets_of(std::string_view pass, std::span<const PassResult> passes, std::string_view depth_pass) {
  const auto moved = [&](Purpose purpose) {
    memory::Traffic sum;
    for (const PassResult& of : passes) {
      if (of.name != pass) continue;
      for (std::size_t u = 0; u < memory::kUnitCount; ++u) {
        const memory::Traffic& traffic = of.counters.ledger.traffic(static_cast<memory::Unit>(u), purpose);
        sum.read_bytes += traffic.read_bytes;
        sum.written_bytes += traffic.written_bytes;
      }
    }
    return sum;
  };
  const memory::Traffic state = moved(Purpose::kTileState), frame = moved(Purpose::kFrameBuffer),
                        attachment = moved(Purpose::kAttachment);
  PassTargets out;
  const bool loads = frame.read_bytes + attachment.read_bytes > 0;
  out.load_color = loads || state.read_bytes > 0;
  out.load_depth = state.read_bytes > 0;
  out.reloads = out.load_color && !loads;
  out.store_color =
      frame.written_bytes + attachment.written_bytes + state.written_bytes + moved(Purpose::kSceneColor).written_bytes >
      0;
  out.store_depth = pass == depth_pass || moved(Purpose::kShadowMap).written_bytes > 0 || state.written_bytes > 0;
  return out;
}

// An interval that grows with each added interval.
struct Extent {
  std::optional<double> begin;
  double end = 0;
  std::uint32_t tiles = 0;

  void add(double from, double to) {
    begin = std::min(begin.value_or(from), from);
    end = std::max(end, to);
    ++tiles;
  }
};

struct PassExtents {
  Extent binning, load, reload, render, store;

  void add(const TileTrack& tile, bool again) {
    double rendered = tile.begin;
    const TileTrack::Span* first = nullptr;
    for (const TileTrack::Span& span : tile.spans) {
      const bool waits = span.activity == Activity::kWaitForUnit || span.activity == Activity::kWaitForData;
      if (!waits && first == nullptr) first = &span;
      if (span.activity == Activity::kStore)
        store.add(span.begin, span.end);
      else if (!waits)
        rendered = std::max(rendered, span.end);
    }
    if (rendered > tile.begin) render.add(tile.begin, rendered);
    if (first == nullptr) return;
    load.add(first->begin, first->end);
    if (again) reload.add(first->begin, first->end);
  }
};

}  // namespace

std::vector<StageSpan> render_stages(const FrameTimeline& frame, const timing::FrameWork& work,
                                     std::span<const PassResult> passes, std::string_view depth_pass) {
  std::vector<PassExtents> extents(work.passes.size());
  for (const FrameTimeline::Geometry& round : frame.geometry)
    if (const double begin = round.bounds > 0 ? round.bound_begin : round.bin_begin;
        std::max(round.bound_end, round.bin_end) > begin && round.bounds + round.entries > 0)
      extents[round.pass].binning.add(begin, std::max(round.bound_end, round.bin_end));
  for (const TileTrack& tile : frame.tiles) {
    const std::uint32_t pass = work.rounds[tile.round].pass;
    extents[pass].add(tile, tile.round > 0 && work.rounds[tile.round - 1].pass == pass);
  }
  std::vector<StageSpan> out;
  for (std::uint32_t pass = 0; pass < extents.size(); ++pass) {
    const PassTargets targets = targets_of(work.passes[pass], passes, depth_pass);
    const PassExtents& of = extents[pass];
    const auto add = [&](RenderStage stage, bool there, const Extent& extent) {
      if (there && extent.begin) out.push_back({stage, pass, extent.tiles, *extent.begin, extent.end});
    };
    add(RenderStage::kBinning, true, of.binning);
    add(RenderStage::kLoadColor, targets.load_color, targets.reloads ? of.reload : of.load);
    add(RenderStage::kLoadDepth, targets.load_depth, of.reload);
    add(RenderStage::kRender, true, of.render);
    add(RenderStage::kStoreColor, targets.store_color, of.store);
    add(RenderStage::kStoreDepth, targets.store_depth, of.store);
  }
  return out;
}

}  // namespace tessera::gpu

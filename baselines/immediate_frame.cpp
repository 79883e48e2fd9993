#include "baselines/immediate_frame.h"

#include <algorithm>
#include <limits>
#include <span>
#include <tuple>

#include "base/parallel.h"
#include "baselines/immediate.h"

namespace tessera::baselines {
namespace {

using scene::AlphaMode;

// A triangle on a line of samples.
struct LineTouch {
  std::uint32_t line;
  bool passes, blends;
};

// The touches of one base patch in one tile.
struct Drawn {
  std::uint32_t patch, tile;
  std::size_t begin, end;  // in the tile's touches
};

struct TileDrawing {
  std::vector<Drawn> drawn;
  std::vector<LineTouch> touches;
};

class CollectingSink final : public tilecore::HitSink {
 public:
  void take(std::span<const Hit> hits) override { all.insert(all.end(), hits.begin(), hits.end()); }
  std::vector<Hit> all;
};

// Depth test of one base patch's hits, triangle by triangle; appends the lines that each touches.
void draw_hits(const tilecore::TileJob& job, std::uint32_t patch, IntRect pixels, const baselines::SampleLayout& layout,
               std::span<tilecore::HitSink::Hit> hits, std::vector<float>& depth, std::vector<LineTouch>& touches) {
  const scene::Material& material = *job.frame->drawable_of(patch).material;
  const int spp = job.pattern->samples_per_pixel();
  std::sort(hits.begin(), hits.end(), [](const auto& a, const auto& b) {
    return std::tie(a.triangle, a.sample) < std::tie(b.triangle, b.sample);
  });
  std::uint32_t triangle = std::numeric_limits<std::uint32_t>::max();
  std::size_t first = touches.size();
  for (const auto& hit : hits) {
    if (hit.triangle != triangle) first = touches.size();
    triangle = hit.triangle;
    const int sample = static_cast<int>(hit.sample), pixel = sample / spp;
    const int x = pixels.x0 + pixel % pixels.width(), y = pixels.y0 + pixel / pixels.width();
    const std::uint32_t line = layout.line(x, y, sample % spp);
    bool passes = hit.z < depth[hit.sample];
    if (passes && material.alpha_mode == AlphaMode::kMask)
      passes = tilecore::point_alpha(*job.frame,
                                     {patch, hit.triangle, hit.b1, hit.b2,
                                      tilecore::time_seen(*job.frame, patch, job.pattern->t(x, y, sample % spp))}) >=
               material.alpha_cutoff;
    if (passes && material.alpha_mode != AlphaMode::kBlend) depth[hit.sample] = hit.z;
    const auto found = std::find_if(touches.begin() + static_cast<std::ptrdiff_t>(first), touches.end(),
                                    [&](const LineTouch& t) { return t.line == line; });
    if (found == touches.end())
      touches.push_back({line, passes, material.alpha_mode == AlphaMode::kBlend});
    else
      found->passes = found->passes || passes;
  }
}

TileDrawing draw_tile(const tilecore::TileJob& job, std::uint32_t tile, std::vector<binner::QueueEntry> entries,
                      const baselines::SampleLayout& layout, tilecore::TileCore& core) {
  std::sort(entries.begin(), entries.end(),
            [](const binner::QueueEntry& a, const binner::QueueEntry& b) { return a.base_patch < b.base_patch; });
  const IntRect pixels = job.grid->pixels(tile);
  std::vector<float> depth(
      static_cast<std::size_t>(pixels.width() * pixels.height() * job.pattern->samples_per_pixel()),
      std::numeric_limits<float>::infinity());
  TileDrawing drawing;
  CollectingSink sink;
  core.begin_tile(job, tile);
  for (std::size_t e = 0; e < entries.size();) {
    const std::uint32_t patch = entries[e].base_patch;
    sink.all.clear();
    for (; e < entries.size() && entries[e].base_patch == patch; ++e) core.find_hits(job, entries[e], sink);
    const std::size_t begin = drawing.touches.size();
    draw_hits(job, patch, pixels, layout, sink.all, depth, drawing.touches);
    if (drawing.touches.size() > begin) drawing.drawn.push_back({patch, tile, begin, drawing.touches.size()});
  }
  return drawing;
}

}  // namespace

ImmediateTraffic draw_immediately(const tilecore::TileJob& job, const gpu::MachineRecord& record,
                                  const gpu::GpuConfiguration& gpu) {
  const baselines::SampleLayout layout(job.grid->region(), job.pattern->samples_per_pixel(), job.burst_bytes);
  std::vector<TileDrawing> tiles(record.entries.size());
  PerThread<tilecore::TileCore> cores;
  parallel_for(tiles.size(), [&](std::size_t t) {
    tiles[t] = draw_tile(job, static_cast<std::uint32_t>(t), record.entries[t], layout, cores.local());
  });

  std::vector<Drawn> order;
  for (const TileDrawing& tile : tiles) order.insert(order.end(), tile.drawn.begin(), tile.drawn.end());
  std::sort(order.begin(), order.end(),
            [](const Drawn& a, const Drawn& b) { return std::tie(a.patch, a.tile) < std::tie(b.patch, b.tile); });
  baselines::ImmediateMemory cached(static_cast<std::uint64_t>(gpu.baselines.immediate_cache_bytes), job.burst_bytes,
                                    layout.line_count());
  baselines::ImmediateMemory uncached(0, job.burst_bytes, layout.line_count());
  for (const Drawn& drawn : order)
    for (std::size_t k = drawn.begin; k < drawn.end; ++k) {
      const LineTouch& touch = tiles[drawn.tile].touches[k];
      cached.draw(touch.line, touch.passes, touch.blends);
      uncached.draw(touch.line, touch.passes, touch.blends);
    }
  const bool resolve = job.pattern->samples_per_pixel() > 1;
  cached.finish(resolve);
  uncached.finish(resolve);
  return {cached.bytes_read(), cached.bytes_written(), uncached.bytes_read() + uncached.bytes_written()};
}

}  // namespace tessera::baselines

#include "baselines/immediate.h"

#include <algorithm>
#include <array>
#include <functional>
#include <memory>
#include <span>
#include <tuple>
#include <utility>

#include "base/parallel.h"
#include "baselines/compressed_color.h"
#include "baselines/scheme_work.h"
#include "baselines/tile_drawing.h"

namespace tessera::baselines {
namespace {

struct Worker {
  TileDrawer drawer;
  std::uint64_t invocations = 0;
};

// The order in which the machine draws: by patch, then by area of the screen.
std::vector<DrawnInTile> submission_order(const std::vector<TileDrawing>& tiles) {
  std::vector<DrawnInTile> order;
  for (const TileDrawing& tile : tiles) order.insert(order.end(), tile.drawn.begin(), tile.drawn.end());
  std::sort(order.begin(), order.end(), [](const DrawnInTile& a, const DrawnInTile& b) {
    return std::tie(a.patch, a.tile) < std::tie(b.patch, b.tile);
  });
  return order;
}

// Draws all into a memory and notes what it had moved behind each patch in each tile.
template <class Memory, class Draw>
std::vector<ImmediateTraffic> draw_all(const std::vector<TileDrawing>& tiles, const std::vector<DrawnInTile>& order,
                                       bool resolve, Memory& memory, const Draw& draw) {
  std::vector<ImmediateTraffic> moved;
  moved.reserve(order.size());
  for (const DrawnInTile& drawn : order) {
    const TileDrawing& tile = tiles[drawn.tile];
    for (std::size_t k = drawn.begin; k < drawn.end; ++k) draw(tile, tile.touches[k]);
    moved.push_back({memory.bytes_read(), memory.bytes_written(), 0});
  }
  memory.finish(resolve);
  return moved;
}

std::vector<ImmediateTraffic> draw_plain(const std::vector<TileDrawing>& tiles, const std::vector<DrawnInTile>& order,
                                         bool resolve, ImmediateMemory& memory) {
  return draw_all(tiles, order, resolve, memory, [&](const TileDrawing&, const LineTouch& touch) {
    memory.draw(touch.line, touch.passes, touch.blends);
  });
}

void move_lines(const std::vector<TileDrawing>& tiles, const tilecore::TileJob& job, const gpu::GpuConfiguration& gpu,
                const SampleLayout& layout, ImmediateFrame& out) {
  const auto cache_bytes = static_cast<std::uint64_t>(gpu.baselines.cache_bytes);
  const bool resolve = job.pattern->samples_per_pixel() > 1;
  ImmediateMemory cached(cache_bytes, job.burst_bytes(), layout.line_count());
  ImmediateMemory uncached(0, job.burst_bytes(), layout.line_count());
  CompressedColorMemory compressed(cache_bytes, job.burst_bytes(), layout);
  const bool compresses = gpu.baselines.immediate_color_compression;
  std::vector<ImmediateTraffic> of_compressed;
  const std::array<std::function<void()>, 3> machines = {
      [&] { out.moved = draw_plain(tiles, out.order, resolve, cached); },
      [&] { draw_plain(tiles, out.order, resolve, uncached); },
      [&] {
        if (!compresses) return;
        of_compressed =
            draw_all(tiles, out.order, resolve, compressed, [&](const TileDrawing& tile, const LineTouch& touch) {
              compressed.draw(touch, std::span(tile.writes).subspan(touch.first_write, touch.write_count), tile.colors);
            });
      }};
  parallel_for(machines.size(), [&](std::size_t machine) { machines[machine](); });
  out.traffic = {cached.bytes_read(), cached.bytes_written(), uncached.bytes_read() + uncached.bytes_written()};
  if (compresses &&
      compressed.bytes_read() + compressed.bytes_written() < out.traffic.bytes_read + out.traffic.bytes_written) {
    out.traffic.bytes_read = compressed.bytes_read();
    out.traffic.bytes_written = compressed.bytes_written();
    out.moved = std::move(of_compressed);
  }
}

}  // namespace

ImmediateFrame draw_immediately(const tilecore::TileJob& job, const gpu::ObservedWork& record,
                                const gpu::GpuConfiguration& gpu) {
  const SampleLayout layout(job.grid->region(), job.pattern->samples_per_pixel(), job.burst_bytes());
  std::vector<TileDrawing> tiles(record.entries.size());
  PerThread<Worker> workers;
  parallel_for(tiles.size(), [&](std::size_t t) {
    Worker& own = workers.local();
    tiles[t] = draw_tile(job, static_cast<std::uint32_t>(t), record.entries[t], layout,
                         gpu.baselines.immediate_color_compression, own.drawer, own.invocations);
  });
  ImmediateFrame out;
  workers.for_each([&](Worker& own) { out.pixel_shader_invocations += own.invocations; });
  for (TileDrawing& tile : tiles) {
    out.blocks_culled += tile.blocks_culled;
    out.visible.tiles.push_back(std::move(tile.visible));
  }
  out.order = submission_order(tiles);
  move_lines(tiles, job, gpu, layout, out);
  return out;
}

namespace {

// The same triangles in the same order, but no bins.
class ImmediateScheme final : public Scheme {
 public:
  void begin(const Pass& pass) override { samples_ = pass.job.pattern->samples_per_pixel(); }
  void add(const DrawnPatch&) override {}
  SchemeResult finish(const DrawnPass& drawn) override {
    const ImmediateFrame& frame = drawn.drawn;
    SchemeResult out;
    BaselineCounters& counters = out.counters;
    take_geometry(drawn.geometry.tiles, drawn.geometry.attribute_bytes, counters);
    counters.tile_overlaps = 0;
    counters.culled_occlusion = frame.blocks_culled;
    counters.pixel_shader_invocations = frame.pixel_shader_invocations;
    counters.domain_evaluations = counters.domain_evaluations_cached = drawn.geometry.vertices;
    const std::uint64_t finished = samples_ > 1 ? drawn.frame_bytes : 0;  // else the colour surface is the frame
    counters.frame_bytes_read = frame.traffic.bytes_read;
    counters.frame_bytes_written = frame.traffic.bytes_written + finished;
    counters.dram_bytes = frame.traffic.bytes_read + counters.frame_bytes_written + counters.patch_bytes_cached;
    counters.dram_bytes_uncached = frame.traffic.bytes_uncached + finished + counters.patch_bytes;
    if (drawn.work == nullptr) return out;
    out.work = drawn.work->immediate(counters);
    counters.texture_bytes = drawn.work->immediate_texture_bytes();
    return out;
  }

 private:
  int samples_ = 1;
};

}  // namespace

std::unique_ptr<Scheme> make_immediate() { return std::make_unique<ImmediateScheme>(); }

}  // namespace tessera::baselines

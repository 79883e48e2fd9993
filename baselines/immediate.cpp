#include "baselines/immediate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <span>
#include <tuple>
#include <utility>

#include "base/parallel.h"
#include "baselines/compressed_color.h"
#include "baselines/scheme_work.h"
#include "baselines/surfaces.h"
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

// Draws all triangles into a memory and records its traffic up to the end of each patch in each tile.
template <class Memory, class Draw>
std::vector<ImmediateTraffic> draw_all(const std::vector<TileDrawing>& tiles, const std::vector<DrawnInTile>& order,
                                       Memory& memory, const Draw& draw) {
  std::vector<ImmediateTraffic> moved;
  moved.reserve(order.size());
  for (const DrawnInTile& drawn : order) {
    const TileDrawing& tile = tiles[drawn.tile];
    for (std::size_t k = drawn.begin; k < drawn.end; ++k) draw(tile, tile.touches[k]);
    moved.push_back({memory.bytes_read(), memory.bytes_written(), 0});
  }
  return moved;
}

std::vector<ImmediateTraffic> draw_plain(const std::vector<TileDrawing>& tiles, const std::vector<DrawnInTile>& order,
                                         bool resolve, ImmediateMemory& memory) {
  std::vector<ImmediateTraffic> moved = draw_all(tiles, order, memory, [&](const TileDrawing&, const LineTouch& touch) {
    memory.draw(touch.line, touch.passes, touch.blends);
  });
  memory.finish(resolve);
  return moved;
}

bool compresses_color(const tilecore::TileJob& job, const gpu::GpuConfiguration& gpu) {
  return job.shades() && (gpu.baselines.immediate_color_compression || has_patches(*job.frame));
}

// The lines of which a prepass has left a depth.
std::vector<bool> known_lines(const tilecore::TileJob& job, const PrepassDepths& depths, const SampleLayout& layout) {
  std::vector<bool> lines(layout.line_count(), false);
  const int spp = job.pattern->samples_per_pixel();
  for (std::size_t t = 0; t < depths.tiles.size(); ++t) {
    const IntRect pixels = job.grid->pixels(static_cast<binner::TileIndex>(t));
    for (std::size_t s = 0; s < depths.tiles[t].size(); ++s) {
      if (std::isinf(depths.tiles[t][s])) continue;
      const int pixel = static_cast<int>(s) / spp, sample = static_cast<int>(s) % spp;
      lines[layout.line(pixels.x0 + pixel % pixels.width(), pixels.y0 + pixel / pixels.width(), sample)] = true;
    }
  }
  return lines;
}

void move_lines(const std::vector<TileDrawing>& tiles, const tilecore::TileJob& job, const gpu::GpuConfiguration& gpu,
                const SampleLayout& layout, const PrepassDepths* known, ImmediateFrame& out) {
  const auto cache_bytes = static_cast<std::uint64_t>(gpu.baselines.cache_bytes);
  const PassSurfaces surfaces = surfaces_of(job);
  const bool resolve = surfaces.reads_color, loads = surfaces.loads_color;
  const LineData data = line_data(job);
  ImmediateMemory cached(cache_bytes, job.burst_bytes(), layout.line_count(), data, loads);
  ImmediateMemory uncached(0, job.burst_bytes(), layout.line_count(), data, loads);
  CompressedColorMemory compressed(cache_bytes, job.burst_bytes(), layout, data, loads);
  if (known != nullptr) {
    const std::vector<bool> lines = known_lines(job, *known, layout);
    cached.know_depths(lines), uncached.know_depths(lines), compressed.know_depths(lines);
  }
  const bool untiled = has_patches(*job.frame), compresses = compresses_color(job, gpu);
  ImmediateRun plain, smaller;
  const std::array<std::function<void()>, 3> machines = {
      [&] { plain.moved = draw_plain(tiles, out.order, resolve, cached); },
      [&] { draw_plain(tiles, out.order, resolve, uncached); },
      [&] {
        if (!compresses) return;
        smaller.moved = draw_all(tiles, out.order, compressed, [&](const TileDrawing& tile, const LineTouch& touch) {
          compressed.draw(touch, std::span(tile.writes).subspan(touch.first_write, touch.write_count), tile.colors);
        });
        compressed.finish(resolve);
      }};
  parallel_for(machines.size(), [&](std::size_t machine) { machines[machine](); });
  const std::uint64_t bytes_uncached = uncached.bytes_read() + uncached.bytes_written();
  plain.traffic = {cached.bytes_read(), cached.bytes_written(), bytes_uncached};
  smaller.traffic = {compressed.bytes_read(), compressed.bytes_written(), bytes_uncached};
  if (!compresses || smaller.traffic.bytes_read + smaller.traffic.bytes_written >=
                         plain.traffic.bytes_read + plain.traffic.bytes_written)
    smaller = plain;
  if (untiled) out.untiled = smaller;
  out.immediate = std::move(gpu.baselines.immediate_color_compression ? smaller : plain);
}

}  // namespace

ImmediateFrame draw_immediately(const tilecore::TileJob& job, const gpu::ObservedWork& record,
                                const gpu::GpuConfiguration& gpu, const PrepassDepths* known) {
  const SampleLayout layout(job.grid->region(), job.pattern->samples_per_pixel(), job.burst_bytes(),
                            surfaces_of(job).depth_bytes);
  std::vector<TileDrawing> tiles(record.entries.size());
  PerThread<Worker> workers;
  parallel_for(tiles.size(), [&](std::size_t t) {
    Worker& own = workers.local();
    std::span<const float> depths;
    if (known != nullptr) depths = known->tiles[t];
    tiles[t] = draw_tile(job, static_cast<std::uint32_t>(t), record.entries[t], layout, depths,
                         compresses_color(job, gpu), own.drawer, own.invocations);
  });
  ImmediateFrame out;
  workers.for_each([&](Worker& own) { out.pixel_shader_invocations += own.invocations; });
  out.depths = DepthPyramid(job.grid->region());
  for (std::size_t t = 0; t < tiles.size(); ++t) {
    out.blocks_culled += tiles[t].blocks_culled;
    out.visible.tiles.push_back(std::move(tiles[t].visible));
    if (job.depths_alone) out.prepass.tiles.push_back(std::move(tiles[t].depths));
    out.depths.add(job.grid->pixels(static_cast<std::uint32_t>(t)), tiles[t].farthest);
  }
  out.depths.finish();
  out.order = submission_order(tiles);
  move_lines(tiles, job, gpu, layout, known, out);
  return out;
}

bool has_patches(const scene::FrameGeometry& frame) {
  return std::any_of(frame.drawables.begin(), frame.drawables.end(), [](const scene::PosedDrawable& drawable) {
    return drawable.visible && scene::has_grid(*drawable.drawable);
  });
}

namespace {

// Draws the same triangles in the same order without bins. `run` selects the machine's traffic.
class ImmediateScheme final : public Scheme {
 public:
  explicit ImmediateScheme(ImmediateRun ImmediateFrame::*run) : run_(run) {}
  void begin(const Pass&) override {}
  void add(const DrawnPatch&) override {}
  SchemeResult finish(const DrawnPass& drawn) override {
    const ImmediateFrame& frame = drawn.drawn;
    const ImmediateTraffic& traffic = (frame.*run_).traffic;
    SchemeResult out;
    BaselineCounters& counters = out.counters;
    take_geometry(drawn.geometry.tiles, drawn.geometry.attribute_bytes, counters);
    counters.tile_overlaps = 0;
    counters.culled_occlusion = frame.blocks_culled;
    counters.pixel_shader_invocations = frame.pixel_shader_invocations;
    counters.domain_evaluations = counters.domain_evaluations_cached = drawn.geometry.vertices;
    const std::uint64_t finished = drawn.resolved_bytes;  // with as many samples the drawn surface is the stored one
    counters.frame_bytes_read = traffic.bytes_read;
    counters.frame_bytes_written = traffic.bytes_written + finished;
    counters.dram_bytes = traffic.bytes_read + counters.frame_bytes_written + counters.patch_bytes_cached;
    counters.dram_bytes_uncached = traffic.bytes_uncached + finished + counters.patch_bytes;
    if (drawn.work == nullptr) return out;
    out.work = drawn.work->immediate(counters, (frame.*run_).moved);
    counters.texture_bytes = drawn.work->immediate_texture_bytes();
    return out;
  }

 private:
  ImmediateRun ImmediateFrame::*run_;
};

// Draws passes with tessellation without tiles [spec: Adreno's open driver, use_sysmem_rendering], and other passes
// as visibility-stream does.
class UntiledScheme final : public Scheme {
 public:
  void begin(const Pass& pass) override {
    if (has_patches(*pass.job.frame))
      of_pass_ = std::make_unique<ImmediateScheme>(&ImmediateFrame::untiled);
    else
      of_pass_ = make_visibility_stream();
    of_pass_->begin(pass);
  }
  void add(const DrawnPatch& patch) override { of_pass_->add(patch); }
  SchemeResult finish(const DrawnPass& drawn) override { return of_pass_->finish(drawn); }

 private:
  std::unique_ptr<Scheme> of_pass_;
};

}  // namespace

std::unique_ptr<Scheme> make_immediate() { return std::make_unique<ImmediateScheme>(&ImmediateFrame::immediate); }
std::unique_ptr<Scheme> make_untiled() { return std::make_unique<UntiledScheme>(); }

}  // namespace tessera::baselines

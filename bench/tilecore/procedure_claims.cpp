// Checks the claims of the published procedural architecture on a capture of procedures, against the conventional
// pipeline, in one run: tessera_procedure_claims CAPTURE WxH [SPP] [--plots DIR]. Prints a table in Markdown; with
// --plots also plots cost against the number of objects and of tiles. Times are of this host.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <string>

#include <fmt/format.h>

#include "base/image_metrics.h"
#include "base/parallel.h"
#include "baselines/baseline_set.h"
#include "bench/support/line_plot.h"
#include "binner/binner.h"
#include "gpu/device.h"
#include "scene/capture_reader.h"
#include "shaders_cpp/procedures/operation_count.h"
#include "shaders_cpp/procedures/procedures.h"
#include "shaders_cpp/tone_map.h"
#include "tests/support/procedures.h"
#include "tilecore/procedural/procedure_surface.h"

namespace tessera::bench {
namespace {

using gpu::FrameResult;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

using Procedures = tilecore::ProcedureSettings;

// A frame and, if it was observed, the schemes beside it.
struct Compared : FrameResult {
  baselines::BaselineSet schemes;
};

Compared render(const scene::Capture& capture, int width, int height, int spp, Procedures::Path path,
                Procedures::Mode mode, double edge, bool observed, int tile = 64,
                tilecore::ShadingRate rate = tilecore::ShadingRate::kPixel) {
  gpu::GpuConfiguration gpu;
  gpu.tile.width = gpu.tile.height = tile;  // the published tile buffer
  gpu::RunSettings settings;
  settings.sampling.samples_per_pixel = spp;
  settings.procedures.path = path;
  settings.procedures.mode = mode;
  settings.tessellation.target_edge_pixels = edge;
  settings.shading.rate = rate;
  gpu::Device device(capture, gpu, settings, {width, height, {0, 0, width, height}});
  baselines::BaselineObserver schemes;
  if (observed) device.set_observer(&schemes);
  FrameResult result = device.render(capture.settings.first_frame);
  return {std::move(result), schemes.last()};
}

Image display(const Image& linear, float exposure) {
  const Image8 shown = shaders::to_display(linear, exposure);
  Image out(shown.width, shown.height, 3);
  for (std::size_t i = 0; i < out.values.size(); ++i)
    out.values[i] = static_cast<float>(shown.values[i / 3 * static_cast<std::size_t>(shown.channels) + i % 3]) / 255.0f;
  return out;
}

// ---- Counts ---------------------------------------------------------------------------------------------------

// Mean operations of the stages over a frame's procedures, weighted by `share` of each drawable.
struct StageCosts {
  double position = 0, geometry = 0, surface = 0;
};

struct Posed {
  scene::Assembly assembly;
  std::unique_ptr<scene::FrameGeometry> frame;
  Posed(const scene::Capture& capture, int width, int height) : assembly(scene::assemble(capture)) {
    scene::FrameRequest request;
    request.width = width;
    request.height = height;
    request.sample_procedures = true;
    frame = scene::pose_frame(assembly, scene::choose_camera(capture, width, height), request);
  }
};

StageCosts mean_costs(const scene::FrameGeometry& frame, const std::vector<double>& share) {
  StageCosts out;
  double sum = 0;
  for (std::size_t d = 0; d < frame.drawables.size(); ++d) {
    const scene::PosedDrawable& drawable = frame.drawables[d];
    if (drawable.procedure == nullptr || share[d] == 0) continue;
    const auto& piece = drawable.procedure->pieces[0];
    shaders::SurfaceProgram surface = tilecore::surface_program(frame, drawable, piece);
    // The array cannot run the machine's own pixel shader: Phong's cost stands for it.
    if (surface.shading == shaders::ShadingId::kMaterial) surface.shading = shaders::ShadingId::kPhong;
    out.position +=
        share[d] * static_cast<double>(shaders::count_position(drawable.procedure->shape, piece.input).total());
    out.geometry +=
        share[d] * static_cast<double>(shaders::count_geometry(drawable.procedure->shape, piece.input).total());
    out.surface += share[d] * static_cast<double>(shaders::count_surface(surface).total());
    sum += share[d];
  }
  return {out.position / sum, out.geometry / sum, out.surface / sum};
}

// Numbers of the cells in each tile's list, in ascending order.
using CellsOfTiles = std::vector<std::vector<std::uint32_t>>;
CellsOfTiles cells_of_tiles(const scene::FrameGeometry& frame, const binner::TileGrid& grid,
                            const tilecore::ParameterMaps& maps) {
  binner::BinnerSpec spec;
  spec.parameter_buffer.full_policy = binner::FullPolicy::kSpill;
  binner::Binner binner(spec, grid);
  binner::Binner::Cursor cursor;
  (void)binner.run(frame, maps.sub_patches(), cursor);
  CellsOfTiles out(grid.tile_count());
  for (std::uint32_t t = 0; t < grid.tile_count(); ++t) {
    memory::Ledger ledger;
    std::uint64_t bytes = 0;
    for (const binner::ListEntry& entry : binner.read_tile(frame, t, ledger, bytes))
      out[t].push_back(tilecore::ParameterMaps::cell_of(entry.range));
  }
  return out;
}

// Samples that a tile would evaluate if it kept for each piece only the ranges of u and v that its cells span.
std::uint64_t min_max_samples(const tilecore::ParameterMaps& maps, const CellsOfTiles& of_tiles) {
  std::uint64_t samples = 0;
  std::vector<std::vector<std::uint32_t>> of_piece;  // all cells of the piece that cell c belongs to
  std::vector<std::uint32_t> piece_of(maps.cells().size());
  for (std::uint32_t c = 0; c < maps.cells().size(); ++c) {
    const bool fresh = c == 0 || maps.cells()[c].drawable != maps.cells()[c - 1].drawable ||
                       maps.cells()[c].piece != maps.cells()[c - 1].piece;
    if (fresh) of_piece.emplace_back();
    piece_of[c] = static_cast<std::uint32_t>(of_piece.size() - 1);
    of_piece.back().push_back(c);
  }
  for (const std::vector<std::uint32_t>& cells : of_tiles) {
    for (std::size_t begin = 0, end = 0; begin < cells.size(); begin = end) {
      float u0 = 1, u1 = 0, v0 = 1, v1 = 0;
      for (; end < cells.size() && piece_of[cells[end]] == piece_of[cells[begin]]; ++end) {
        const tilecore::ParameterCell& cell = maps.cells()[cells[end]];
        u0 = std::min(u0, cell.u0), u1 = std::max(u1, cell.u1), v0 = std::min(v0, cell.v0), v1 = std::max(v1, cell.v1);
      }
      for (const std::uint32_t c : of_piece[piece_of[cells[begin]]]) {
        const tilecore::ParameterCell& cell = maps.cells()[c];
        if (cell.u0 < u1 && cell.u1 > u0 && cell.v0 < v1 && cell.v1 > v0) samples += cell.steps.count();
      }
    }
  }
  return samples;
}

// Number of (tile, object) pairs that `maps` miss: dense sampling of every piece finds the tiles that an object needs.
std::uint64_t missed_tiles(const scene::FrameGeometry& frame, const binner::TileGrid& grid,
                           const tilecore::ParameterMaps& maps) {
  std::uint64_t missed = 0;
  const CellsOfTiles of_tiles = cells_of_tiles(frame, grid, maps);
  for (std::uint32_t d = 0; d < frame.drawables.size(); ++d) {
    const scene::PosedDrawable& drawable = frame.drawables[d];
    if (drawable.procedure == nullptr) continue;
    std::vector<bool> needed(grid.tile_count(), false), tagged(grid.tile_count(), false);
    for (std::uint32_t t = 0; t < grid.tile_count(); ++t)
      for (const std::uint32_t c : of_tiles[t]) tagged[t] = tagged[t] || maps.cells()[c].drawable == d;
    constexpr int kSide = 512;
    for (const auto& piece : drawable.procedure->pieces)
      for (int k = 0; k < kSide * kSide; ++k) {
        const float u = (static_cast<float>(k % kSide) + 0.5f) / kSide,
                    v = (static_cast<float>(k / kSide) + 0.5f) / kSide;
        shaders::ShapePoint<float> p;
        shaders::with_shape(drawable.procedure->shape,
                            [&](auto shape) { p = shaders::shape_tangents<decltype(shape)>(piece.input, u, v); });
        const auto raster = [&](const Vector3<float>& a, float w) {
          return drawable.to_raster[0] * Vec4(a.x, a.y, a.z, w);
        };
        const Vec4 r = raster(p.position, 1), ru = raster(p.by_u, 0), rv = raster(p.by_v, 0);
        if (!(r.z > static_cast<float>(frame.projection.near))) continue;
        const float x = r.x / r.w, y = r.y / r.w;
        const float area = (ru.x - x * ru.w) * (rv.y - y * rv.w) - (ru.y - y * ru.w) * (rv.x - x * rv.w);
        if (!drawable.material->double_sided && (drawable.mirrored ? area <= 0 : area >= 0)) continue;
        if (x < 0 || y < 0 || x >= static_cast<float>(frame.request.width) ||
            y >= static_cast<float>(frame.request.height))
          continue;
        needed[grid.index(static_cast<int>(x) / grid.tile_width(), static_cast<int>(y) / grid.tile_height())] = true;
      }
    for (std::uint32_t t = 0; t < grid.tile_count(); ++t) missed += needed[t] && !tagged[t] ? 1 : 0;
  }
  return missed;
}

void print_claims(const scene::Capture& capture, int width, int height, int spp) {
  const Posed posed(capture, width, height);
  const binner::TileGrid grid(width, height, 64, 64);
  const Compared sampled =
      render(capture, width, height, spp, Procedures::Path::kSampled, Procedures::Mode::kInterval, 1.0, true);
  const FrameResult published =
      render(capture, width, height, spp, Procedures::Path::kSampled, Procedures::Mode::kPublished, 1.0, false);
  const FrameResult tessellated =
      render(capture, width, height, spp, Procedures::Path::kTessellated, Procedures::Mode::kInterval, 1.0, false);
  const Compared coarse =
      render(capture, width, height, spp, Procedures::Path::kTessellated, Procedures::Mode::kInterval, 3.0, true);
  const auto& s = sampled.counters.sampling;
  const auto& post = sampled.schemes[baselines::SchemeId::kPostTessellation];
  const auto& post3 = coarse.schemes[baselines::SchemeId::kPostTessellation];
  const auto& immediate = sampled.schemes[baselines::SchemeId::kImmediate];
  const double frame_bytes = static_cast<double>(
      sampled.counters.ledger.traffic(memory::Unit::kResolve, memory::Purpose::kFrameBuffer).written_bytes);
  const double own =
      static_cast<double>(sampled.counters.ledger.total().read_bytes + sampled.counters.ledger.total().written_bytes) -
      frame_bytes;
  // Vertex buffers: position, normal, texture coordinates; two new triangles of three 32-bit indices per vertex of a
  // grid.
  const auto conventional = [&](const baselines::BaselineCounters& b) {
    return static_cast<double>(b.dram_bytes) - frame_bytes + static_cast<double>(b.domain_evaluations) * (32 + 24);
  };
  std::vector<double> share(posed.frame->drawables.size(), 0);
  const tilecore::ParameterMaps maps(*posed.frame, grid.region(), {}, tilecore::SamplingController::sub_pixels(spp),
                                     64);
  for (const auto& cell : maps.cells()) share[cell.drawable] += static_cast<double>(cell.steps.count());
  const StageCosts cost = mean_costs(*posed.frame, share);
  const double view = static_cast<double>(shaders::count_view().total());
  const double samples = static_cast<double>(s.samples),
               shaded = static_cast<double>(sampled.counters.shading.pixel_shader_invocations);
  const double vertices = static_cast<double>(post3.domain_evaluations), kInterpolation = 30;
  const double pipeline_operations =
      vertices * (cost.geometry + view) +
      static_cast<double>(coarse.counters.shading.pixel_shader_invocations) * (cost.surface + kInterpolation);
  const double in_tile = samples - static_cast<double>(s.samples_outside_tile),
               wasted = static_cast<double>(s.samples_outside_tile);
  const double min_max = static_cast<double>(min_max_samples(maps, cells_of_tiles(*posed.frame, grid, maps)));
  const auto time_share = [](const FrameResult& r) {
    return r.stage_seconds.at("sparse") / (r.stage_seconds.at("sparse") + r.stage_seconds.at("tiles"));
  };
  const auto& ps = published.counters.sampling;
  tilecore::ProcedureSettings published_settings;
  published_settings.mode = tilecore::ProcedureSettings::Mode::kPublished;
  published_settings.padding = 0;
  const tilecore::ParameterMaps bare(*posed.frame, grid.region(), published_settings,
                                     tilecore::SamplingController::sub_pixels(spp), 64);
  published_settings.sparse_spacing = 64;
  const tilecore::ParameterMaps sparse(*posed.frame, grid.region(), published_settings,
                                       tilecore::SamplingController::sub_pixels(spp), 64);

  fmt::print("| {} {}x{}, {} samples a pixel, tiles of 64x64 | published | measured |\n|---|---:|---:|\n",
             capture.file.filename().string(), width, height, spp);
  fmt::print(
      "| external bytes, finished frame apart, over post-tessellation with vertex buffers, sides of 1 pixel | about "
      "1/10 | 1/{:.0f} ({:.2f} of {:.1f} MB) |\n",
      conventional(post) / own, own / 1e6, conventional(post) / 1e6);
  fmt::print("| the same, sides of 3 pixels | | 1/{:.1f} (of {:.2f} MB) |\n", conventional(post3) / own,
             conventional(post3) / 1e6);
  fmt::print("| the same with the frame ({:.1f} MB), sides of 1 pixel | | 1/{:.1f} |\n", frame_bytes / 1e6,
             (conventional(post) + frame_bytes) / (own + frame_bytes));
  fmt::print("| with the frame, over drawing immediately with caches of 256 KiB | | 1/{:.1f} |\n",
             (static_cast<double>(immediate.dram_bytes) + static_cast<double>(immediate.domain_evaluations) * 56) /
                 (own + frame_bytes));
  fmt::print("| geometry evaluations over vertices (sides of 3 pixels) | | {:.0f} |\n", samples / vertices);
  fmt::print("| operations, all stages per sample, over the pipeline | 10 to 100 | {:.1f} |\n",
             samples * (cost.geometry + view + cost.surface) / pipeline_operations);
  fmt::print("| operations as built, visible surfaces shaded | | {:.1f} |\n",
             (samples * (cost.geometry + view) + shaded * cost.surface) / pipeline_operations);
  fmt::print("| sparse pass, share of samples: published maps / interval cells | 25 % | {:.1f} % / {:.2f} % |\n",
             100.0 * static_cast<double>(ps.sparse_evaluations) / static_cast<double>(ps.samples),
             100.0 * static_cast<double>(s.interval_evaluations) / samples);
  fmt::print("| sparse pass, share of time: published maps / interval cells | 14 % | {:.1f} % / {:.1f} % |\n",
             100 * time_share(published), 100 * time_share(sampled));
  fmt::print("| wasted samples, min-max range over parameter map | 2.5 | {:.1f} |\n", (min_max - in_tile) / wasted);
  fmt::print("| samples that fell outside their tile: interval / published | | {:.1f} % / {:.1f} % |\n",
             100 * wasted / samples,
             100.0 * static_cast<double>(ps.samples_outside_tile) / static_cast<double>(ps.samples));
  fmt::print(
      "| missed tiles: interval / published, no padding / published, no padding, tuples 64 sub-pixels apart | 0 wanted "
      "| {} / {} / {} |\n",
      missed_tiles(*posed.frame, grid, maps), missed_tiles(*posed.frame, grid, bare),
      missed_tiles(*posed.frame, grid, sparse));
  const float exposure = capture.settings.exposure;
  fmt::print("| image against the tessellated path, sides of 1 pixel | | {:.1f} dB |\n",
             psnr(display(sampled.targets.color, exposure), display(tessellated.targets.color, exposure)));
  fmt::print("| samples not finite, rates clamped | | {}, {} |\n\n", s.samples_not_finite, s.rates_clamped);
}

// ---- Speed ----------------------------------------------------------------------------------------------------

// Samples per second of the whole array on all threads: geometry, view and shading of a sphere.
double array_rate(bool shaded) {
  shaders::ShapeInput in;
  in.p[0] = 1;
  shaders::SurfaceProgram surface;
  surface.texture_numbers = {0.8f, 0.5f, 0.3f};
  surface.shading_numbers = {0.3f, 0.6f, 0.4f, 32};
  surface.lights.eye = {0, 0, 5};
  tilecore::ArrayProgram program;
  program.input = &in;
  program.to_raster[0] = Mat4(100, 0, 0, 0, 0, -100, 0, 0, -50, -50, -1, -1, 250, 250, 5, 5);
  if (shaded) program.surface = &surface;
  constexpr std::size_t kTasks = 64, kBatches = 400;
  double best = 0;
  for (int repeat = 0; repeat < 5; ++repeat) {
    const auto start = Clock::now();
    parallel_for(kTasks, [&](std::size_t task) {
      const auto registers = std::make_unique<tilecore::SampleRegisters>();
      for (std::size_t k = 0; k < tilecore::kArraySamples; ++k) {
        registers->u[k] = static_cast<float>(k) / tilecore::kArraySamples;
        registers->v[k] = (static_cast<float>(task) + 0.5f) / kTasks;
      }
      for (std::size_t b = 0; b < kBatches; ++b) tilecore::run_procedure(program, tilecore::kArraySamples, *registers);
    });
    best = std::max(best, static_cast<double>(kTasks * kBatches * tilecore::kArraySamples) / seconds_since(start));
  }
  return best;
}

// n x n spheres that together cover the same part of the image.
scene::Capture spheres(int n) {
  scene::Capture capture;
  test::add_camera(capture, DVec3(0, 0, 6), {});
  shaders::ShapeInput in;
  in.p[0] = 1.8f / static_cast<float>(n);
  for (int k = 0; k < n * n; ++k)
    test::add_procedure(capture, shaders::ShapeId::kSphere, in,
                        DVec3((k % n + 0.5) * 4 / n - 2, (k / n + 0.5) * 4 / n - 2, 0));
  return capture;
}

void print_costs(const std::string& folder) {
  Series objects{"all objects together cover the same", {}, {}}, sparse{"its sparse pass", {}, {}},
      tiles{"16 spheres", {}, {}}, tile_samples{"samples", {}, {}};
  fmt::print("| objects | samples | sparse pass ms | whole ms |\n|---:|---:|---:|---:|\n");
  for (const int n : {1, 2, 4, 8, 16, 32}) {
    const scene::Capture capture = spheres(n);
    FrameResult best = render(capture, 512, 512, 16, Procedures::Path::kSampled, Procedures::Mode::kInterval, 3, false);
    for (int repeat = 0; repeat < 2; ++repeat)
      if (FrameResult again =
              render(capture, 512, 512, 16, Procedures::Path::kSampled, Procedures::Mode::kInterval, 3, false);
          again.seconds < best.seconds)
        best = std::move(again);
    objects.x.push_back(n * n), objects.y.push_back(best.seconds * 1e3);
    sparse.x.push_back(n * n), sparse.y.push_back(best.stage_seconds.at("sparse") * 1e3);
    fmt::print("| {} | {} | {:.1f} | {:.1f} |\n", n * n, best.counters.sampling.samples,
               best.stage_seconds.at("sparse") * 1e3, best.seconds * 1e3);
  }
  fmt::print("\n| tiles (side) | samples | outside their tile | whole ms |\n|---:|---:|---:|---:|\n");
  const scene::Capture capture = spheres(4);
  for (const int tile : {128, 64, 32, 16, 8}) {
    FrameResult best =
        render(capture, 512, 512, 16, Procedures::Path::kSampled, Procedures::Mode::kInterval, 3, false, tile);
    for (int repeat = 0; repeat < 2; ++repeat)
      if (FrameResult again =
              render(capture, 512, 512, 16, Procedures::Path::kSampled, Procedures::Mode::kInterval, 3, false, tile);
          again.seconds < best.seconds)
        best = std::move(again);
    const auto& s = best.counters.sampling;
    tiles.x.push_back(512.0 / tile * 512 / tile), tiles.y.push_back(best.seconds * 1e3);
    tile_samples.x.push_back(tiles.x.back()), tile_samples.y.push_back(static_cast<double>(s.samples) * 1e-6);
    fmt::print("| {} ({}) | {} | {:.1f} % | {:.1f} |\n", 512 / tile * (512 / tile), tile, s.samples,
               100.0 * static_cast<double>(s.samples_outside_tile) / static_cast<double>(s.samples),
               best.seconds * 1e3);
  }
  write_line_plot(folder + "/objects.svg",
                  {"Cost against the number of objects, 512x512, 16 samples", "objects", "ms", false, true},
                  {objects, sparse});
  write_line_plot(folder + "/tiles.svg",
                  {"Samples against the number of tiles, 512x512, 16 samples", "tiles", "million samples", false, true},
                  {tile_samples});
}

int run(int argc, char** argv) {
  int width = 0, height = 0, spp = 16;
  if (argc < 3 || std::sscanf(argv[2], "%dx%d", &width, &height) != 2) {
    std::fprintf(stderr, "usage: tessera_procedure_claims CAPTURE WxH [SPP] [--plots DIR]\n");
    return 2;
  }
  if (argc > 3 && argv[3][0] != '-') spp = std::atoi(argv[3]);
  print_claims(scene::read_capture(argv[1]), width, height, spp);
  std::fflush(stdout);
  fmt::print(
      "SIMD array, sphere: {:.0f} million samples a second of geometry, view and shading; {:.0f} of geometry and view "
      "alone\n\n",
      array_rate(true) * 1e-6, array_rate(false) * 1e-6);
  for (int a = 3; a + 1 < argc; ++a)
    if (std::strcmp(argv[a], "--plots") == 0) print_costs(argv[a + 1]);
  return 0;
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) {
  try {
    return tessera::bench::run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tessera_procedure_claims: %s\n", error.what());
    return 1;
  }
}

// Measures visibility of one 64x64 tile full of quads: raster path, and ray path by blur length, quad size and SIMD target.
#include <benchmark/benchmark.h>

#include <cmath>
#include <set>

#include "base/simd_targets.h"
#include "tilecore/visibility/sample_tests.h"
#include "tilecore/visibility/tile_frustum.h"

namespace tessera::tilecore {
namespace {

constexpr int kSide = 64;

// A wavy sheet of quads of `size` pixels that moves by `blur` pixels.
MicroMesh make_sheet(float size, float blur, bool moving) {
  MicroMesh mesh;
  const int n = static_cast<int>(std::ceil((kSide + 2 * blur) / size)) + 2, columns = n + 1;
  mesh.resize_vertices(static_cast<std::size_t>(columns * columns) + 64, true);
  const auto grid = [](float v) { return std::round(v * 256.0f) / 256.0f; };
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) {
      const auto v = static_cast<std::size_t>(j * columns + i);
      mesh.x0[v] = grid(-blur - size + size * static_cast<float>(i) + 0.3f * size * std::sin(static_cast<float>(j)));
      mesh.y0[v] = grid(-blur - size + size * static_cast<float>(j) + 0.3f * size * std::cos(static_cast<float>(i)));
      mesh.z0[v] = mesh.z1[v] = 3.0f + 0.1f * std::sin(static_cast<float>(i + j));
      mesh.x1[v] = grid(mesh.x0[v] + blur * 0.8f);
      mesh.y1[v] = grid(mesh.y0[v] + blur * 0.6f);
      mesh.projected[v] = 1;
    }
  for (int lj = 0; lj < n; lj += 4)
    for (int li = 0; li < n; li += 4) {
      mesh.begin_leaf({lj * columns + li, columns, std::min(4, n - li)});
      for (int j = lj; j < std::min(lj + 4, n); ++j)
        for (int i = li; i < std::min(li + 4, n); ++i) {
          const std::int32_t a = j * columns + i;
          mesh.add_cell({a, a + 1, a + 1 + columns, a + columns}, static_cast<std::uint32_t>(2 * (j * n + i)));
        }
    }
  build_cells(mesh, {moving, false, false, 0, 0});
  return mesh;
}

class CountingSink final : public HitSink {
 public:
  std::uint64_t hits = 0;
  std::set<std::uint32_t> samples;
  bool keep = false;
  void take(std::span<const Hit> block) override {
    hits += block.size();
    if (keep)
      for (const Hit& h : block) samples.insert(h.sample);
  }
};

void trace_tile(const MicroMesh& mesh, const TileSamples& samples, HitSink& sink, VisibilityWork& work) {
  for (std::size_t l = 0; l < mesh.leaves.size(); ++l) {
    const TimeRange times = touching_times(mesh.leaves[l], samples.pixels, true, 0);
    if (!times.empty()) trace_leaf(mesh, l, samples, times, {true, false}, {}, sink, work);
  }
  sink.flush();
}

void finish(benchmark::State& state, const TileSamples& samples, const VisibilityWork& work) {
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(samples.count));
  state.counters["box/sample"] = static_cast<double>(work.box_tests) / static_cast<double>(samples.count);
  state.counters["tri/hit"] = static_cast<double>(work.triangle_tests) / static_cast<double>(work.sample_hits);
}

void RayPath(benchmark::State& state, const std::string& target) {
  force_simd_target(target);
  const float size = static_cast<float>(state.range(0)), blur = static_cast<float>(state.range(1));
  const MicroMesh mesh = make_sheet(size, blur, true);
  const SamplePattern pattern({4, 0, 0});
  TileSamples samples;
  samples.fill(pattern, {0, 0, kSide, kSide}, 0, false);
  CountingSink sink;
  sink.keep = true;
  VisibilityWork work;
  trace_tile(mesh, samples, sink, work);
  if (sink.samples.size() != samples.count) state.SkipWithError("the sheet has a hole");
  sink.keep = false;
  for (auto _ : state) {
    VisibilityWork ignored;
    trace_tile(mesh, samples, sink, ignored);
  }
  benchmark::DoNotOptimize(sink.hits);
  finish(state, samples, work);
  force_simd_target("");
}

void RasterPath(benchmark::State& state, const std::string& target) {
  force_simd_target(target);
  const MicroMesh mesh = make_sheet(static_cast<float>(state.range(0)), 0, false);
  const SamplePattern pattern({4, 0, 0});
  TileSamples samples;
  samples.fill(pattern, {0, 0, kSide, kSide}, 0, false);
  CountingSink sink;
  sink.keep = true;
  VisibilityWork work;
  raster_mesh(mesh, samples, {}, sink, work);
  sink.flush();
  if (sink.samples.size() != samples.count) state.SkipWithError("the sheet has a hole");
  sink.keep = false;
  for (auto _ : state) {
    VisibilityWork ignored;
    raster_mesh(mesh, samples, {}, sink, ignored);
    sink.flush();
  }
  finish(state, samples, work);
  force_simd_target("");
}

const bool kRegistered = [] {
  for (const std::string& target : simd_target_names()) {
    auto* ray = benchmark::RegisterBenchmark(("RayPath/" + target).c_str(),
                                             [target](benchmark::State& s) { RayPath(s, target); });
    auto* raster = benchmark::RegisterBenchmark(("RasterPath/" + target).c_str(),
                                                [target](benchmark::State& s) { RasterPath(s, target); });
    ray->ArgNames({"quad", "blur"});
    raster->ArgNames({"quad"});
    const bool reference = target == simd_target_names().back();
    for (const int quad : {1, 4}) {
      raster->Arg(quad);
      for (const int blur : {0, 8, 32, 128})
        if (!reference || blur == 8) ray->Args({quad, blur});
    }
  }
  return true;
}();

}  // namespace
}  // namespace tessera::tilecore

// Measures the time of finding the tiles of one sub-patch, method by method.
#include <benchmark/benchmark.h>

#include <memory>

#include "binner/tile_coverage.h"
#include "frontend/front_end.h"
#include "gpu/configuration.h"
#include "scene/capture_reader.h"

namespace tessera::binner {
namespace {

struct Scene {
  scene::Capture capture = scene::read_capture(TESSERA_SOURCE_DIR "/captures/flyby.glb");
  scene::Assembly assembly = scene::assemble(capture);
  std::vector<MovingBody> sub_patches;
  Scene() {
    scene::FrameRequest request;
    request.open_time = capture.settings.first_frame / capture.settings.frame_rate;
    request.close_time = request.open_time + 1 / capture.settings.frame_rate;
    const auto frame =
        scene::pose_frame(assembly, scene::choose_camera(capture, request.width, request.height), request);
    for (const frontend::BoundedSubPatch& s :
         frontend::run_front_end(*frame, frontend::PyramidLibrary(assembly), {}).sub_patches)
      sub_patches.push_back({s.bounds, s.corners(*frame)});
  }
};

const Scene& scene() {
  static const Scene kScene;
  return kScene;
}

void CoverSubPatch(benchmark::State& state, CoverageMethod coverage, bool intervals, int segments) {
  gpu::GpuConfiguration gpu;
  gpu.binner.coverage = coverage;
  gpu.binner.time_intervals = intervals;
  gpu.binner.time_segments = segments;
  const TileGrid grid(1280, 720, 32, 32);
  TileCoverageUnit unit(gpu.binner);
  const auto& work = scene().sub_patches;
  // Verify: covered and dropped tiles add up to the rectangle's.
  for (const MovingBody& s : work) {
    const TileCoverage& c = unit.cover(s, true, grid);
    if (c.covered + c.dropped_exact + c.dropped_time != c.times.size()) state.SkipWithError("tiles were lost");
  }
  std::size_t next = 0;
  for (auto _ : state) benchmark::DoNotOptimize(unit.cover(work[next++ % work.size()], true, grid).covered);
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK_CAPTURE(CoverSubPatch, Rectangle, CoverageMethod::kRectangle, false, 1);
BENCHMARK_CAPTURE(CoverSubPatch, Exact, CoverageMethod::kExact, false, 1);
BENCHMARK_CAPTURE(CoverSubPatch, Intervals, CoverageMethod::kRectangle, true, 1);
BENCHMARK_CAPTURE(CoverSubPatch, Segments4, CoverageMethod::kRectangle, false, 4);
BENCHMARK_CAPTURE(CoverSubPatch, Segments16, CoverageMethod::kRectangle, false, 16);
BENCHMARK_CAPTURE(CoverSubPatch, All, CoverageMethod::kExact, true, 16);

}  // namespace
}  // namespace tessera::binner

// Cost of bounding one sub-patch (OBB) and of one min-max query.
#include <benchmark/benchmark.h>

#include <memory>

#include "frontend/bounds/screen_bounds.h"
#include "frontend/capture_reader.h"
#include "frontend/front_end.h"

namespace tessera::frontend {
namespace {

struct Scene {
  Capture capture = read_capture(TESSERA_SOURCE_DIR "/captures/eggs.glb");
  Assembly assembly = assemble(capture);
  PyramidLibrary pyramids{assembly};
  std::unique_ptr<FrameGeometry> frame;
  Scene() {
    FrameRequest request;
    request.open_time = 0.5;
    request.close_time = 0.52;
    frame = pose_frame(assembly, choose_camera(capture, 0.5, request.width, request.height), request);
  }
};

const Scene& scene() {
  static const Scene kScene;
  return kScene;
}

void BoundSubPatch(benchmark::State& state) {
  const Scene& s = scene();
  // Verify: a bound holds the corner control points of its patch where they are drawn.
  const SubPatchBody first = sub_patch_body(*s.frame, s.pyramids, 320, cut_patch(*s.frame, 320, 16).front());
  if (!screen_bounds(first.corners, s.frame->projection, first.margin)) state.SkipWithError("an egg in sight has no bound");
  std::vector<std::pair<std::uint32_t, CellRange>> work;
  for (std::uint32_t patch = 0; patch < s.assembly.patch_count(); ++patch)
    for (const CellRange& range : cut_patch(*s.frame, patch, 16)) work.emplace_back(patch, range);
  std::size_t next = 0;
  for (auto _ : state) {
    const auto& [patch, range] = work[next++ % work.size()];
    const SubPatchBody body = sub_patch_body(*s.frame, s.pyramids, patch, range);
    benchmark::DoNotOptimize(screen_bounds(body.corners, s.frame->projection, body.margin));
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(BoundSubPatch);

void MinMaxQuery(benchmark::State& state) {
  std::vector<float> heights(256 * 256);
  for (std::size_t i = 0; i < heights.size(); ++i) heights[i] = static_cast<float>(i * 37 % 1000);
  const MinMaxPyramid pyramid(shaders::ScalarTexture(256, 256, heights));
  if (pyramid.whole().high < 999.0f) state.SkipWithError("the pyramid misses the highest texel");
  float u = 0;
  for (auto _ : state) {
    u += 0.013f;
    benchmark::DoNotOptimize(pyramid.query({}, {u, 0.2f}, {u + 0.05f, 0.27f}, 1.5f));
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(MinMaxQuery);

}  // namespace
}  // namespace tessera::frontend

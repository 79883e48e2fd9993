// Measures the time of bounding one sub-patch by each method, and of one min-max query.
#include <benchmark/benchmark.h>

#include <array>
#include <memory>
#include <span>
#include <string>

#include "base/simd_targets.h"
#include "frontend/bounds/screen_bounds.h"
#include "frontend/front_end.h"
#include "gpu/configuration.h"
#include "scene/capture_reader.h"

namespace tessera::frontend {
namespace {

struct Scene {
  scene::Capture capture = scene::read_capture(TESSERA_SOURCE_DIR "/captures/eggs.glb");
  scene::Assembly assembly = assemble(capture);
  PyramidLibrary pyramids{assembly};
  std::unique_ptr<scene::FrameGeometry> frame;
  Scene() {
    scene::FrameRequest request;
    request.open_time = 0.5;
    request.close_time = 0.52;
    frame = pose_frame(assembly, choose_camera(capture, request.width, request.height), request);
  }
};

const Scene& scene() {
  static const Scene kScene;
  return kScene;
}

// Sub-patches as the front end splits them, in its order.
struct Work {
  std::uint32_t patch;
  std::vector<scene::CellRange> ranges;
};
std::vector<Work> split_work(const Scene& s) {
  gpu::GpuConfiguration gpu;
  gpu.frontend.split_pixels = 32;  // many sub-patches a base patch, so that their common work does not hide their own
  const FrontEndResult split = run_front_end(*s.frame, s.pyramids, gpu.front_end_spec());
  std::vector<Work> work;
  for (const BoundedSubPatch& p : split.sub_patches) {
    if (s.frame->drawable_of(p.base_patch).drawable->kind != scene::Primitive::Kind::kBezierPatches) continue;
    if (work.empty() || work.back().patch != p.base_patch) work.push_back({p.base_patch, {}});
    work.back().ranges.push_back(p.range);
  }
  return work;
}

// Argument 0: the method; 1: the timed work (0 the box, 1 with its bounds on screen).
void BoundSubPatch(benchmark::State& state) {
  const Scene& s = scene();
  const auto method = static_cast<BoundMethod>(state.range(0));
  const bool on_screen = state.range(1) != 0;
  state.SetLabel(std::string(word(method)) + (on_screen ? ", on screen" : "") + ", " + simd_target_name());
  SubPatchBounder bounder(*s.frame, s.pyramids, method);
  const std::vector<Work> work = split_work(s);
  // Verify: sub-patches that the front end kept are visible with this method too.
  std::size_t bounds = 0;
  for (const Work& w : work) {
    bounder.begin(w.patch);
    for (const scene::CellRange& range : w.ranges) {
      const SubPatchBody body = bounder.body(range);
      if (!screen_bounds(body.corners, s.frame->projection, body.margin))
        state.SkipWithError("a sub-patch in sight has no bound");
      ++bounds;
    }
  }
  for (auto _ : state)
    for (const Work& w : work) {
      bounder.begin(w.patch);
      for (const scene::CellRange& range : w.ranges) {
        if (on_screen) {
          const SubPatchBody body = bounder.body(range);
          benchmark::DoNotOptimize(screen_bounds(body.corners, s.frame->projection, body.margin));
        } else {
          benchmark::DoNotOptimize(bounder.box(range));
        }
      }
    }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(bounds));
  state.counters["ns_per_bound"] = benchmark::Counter(
      static_cast<double>(bounds) * 1e-9, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(BoundSubPatch)->ArgsProduct({{0, 1, 2, 3, 4}, {0, 1}})->Unit(benchmark::kMillisecond);

// The same sub-patches, four of a base patch at once, including their bounds on screen as in body().
void BoundSiblings(benchmark::State& state) {
  const Scene& s = scene();
  const auto method = static_cast<BoundMethod>(state.range(0));
  const bool on_screen = state.range(1) != 0;
  state.SetLabel(std::string(word(method)) + (on_screen ? ", on screen" : "") + ", " + simd_target_name());
  SubPatchBounder bounder(*s.frame, s.pyramids, method);
  std::vector<Work> work = split_work(s);
  std::size_t bounds = 0;
  for (Work& w : work) {
    w.ranges.resize(w.ranges.size() / kSiblings * kSiblings);
    bounds += w.ranges.size();
  }
  std::array<SiblingBound, kSiblings> siblings;
  const auto each_four = [&](const Work& w, const auto& visit) {
    bounder.begin(w.patch);
    for (std::size_t k = 0; k < w.ranges.size(); k += kSiblings) {
      bounder.bound(std::span(w.ranges).subspan(k, kSiblings), siblings);
      for (const SiblingBound& sibling : siblings) visit(sibling);
    }
  };
  // Verify: the results are the same as one by one.
  SubPatchBounder single(*s.frame, s.pyramids, method);
  for (const Work& w : work) {
    single.begin(w.patch);
    each_four(w, [&](const SiblingBound& sibling) {
      if (bounder.use(sibling).corners != single.body(sibling.cells).corners)
        state.SkipWithError("a sub-patch has another body among siblings");
    });
  }
  for (auto _ : state)
    for (const Work& w : work)
      each_four(w, [&](const SiblingBound& sibling) {
        if (on_screen) {
          const SubPatchBody body = bounder.use(sibling);
          benchmark::DoNotOptimize(screen_bounds(body.corners, s.frame->projection, body.margin));
        } else {
          benchmark::DoNotOptimize(sibling.box);
        }
      });
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(bounds));
  state.counters["ns_per_bound"] = benchmark::Counter(
      static_cast<double>(bounds) * 1e-9, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(BoundSiblings)->ArgsProduct({{0, 1, 2, 3}, {0, 1}})->Unit(benchmark::kMillisecond);

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

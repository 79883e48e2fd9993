// Measures loading, posing and rendering of the shipped captures at 640x360; model:0 is without texture caches, cycles and energy.
#include <benchmark/benchmark.h>

#include "gpu/device.h"
#include "scene/capture_reader.h"

namespace tessera::gpu {
namespace {

std::string capture_file(const std::string& name) { return TESSERA_SOURCE_DIR "/captures/" + name + ".glb"; }

void Load(benchmark::State& state, const std::string& name) {
  std::uint64_t bytes = 0;
  for (auto _ : state) bytes += scene::read_capture(capture_file(name)).file_bytes;
  state.SetBytesProcessed(static_cast<std::int64_t>(bytes));
}

void Frame(benchmark::State& state, const std::string& name) {
  const scene::Capture capture = scene::read_capture(capture_file(name));
  RunSettings settings;
  settings.sampling.samples_per_pixel = state.range(0);
  settings.output.machine_model = state.range(1) != 0;
  Device renderer(capture, {}, settings, {640, 360, {0, 0, 640, 360}, false});
  const FrameResult first = renderer.render(capture.settings.first_frame);
  if (first.counters.shading.samples_visible == 0) state.SkipWithError("the frame is empty");
  for (auto _ : state) benchmark::DoNotOptimize(renderer.render(capture.settings.first_frame).seconds);
  state.SetItemsProcessed(state.iterations() * 640 * 360 * state.range(0));
}

const bool kRegistered = [] {
  for (const char* name : {"eggs", "vases", "serpent", "flyby"}) {
    benchmark::RegisterBenchmark((std::string("Load/") + name).c_str(), [name](benchmark::State& s) {
      Load(s, name);
    })->Unit(benchmark::kMillisecond);
    benchmark::RegisterBenchmark((std::string("Frame/") + name).c_str(),
                                 [name](benchmark::State& s) { Frame(s, name); })
        ->Unit(benchmark::kMillisecond)
        ->ArgNames({"spp", "model"})
        ->Args({1, 1})
        ->Args({4, 1})
        ->Args({4, 0})
        ->UseRealTime();
  }
  return true;
}();

}  // namespace
}  // namespace tessera::gpu

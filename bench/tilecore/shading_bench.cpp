// Pixel-shader invocations of the shipped captures: in warps on SIMD lanes, and one alone (the scalar twin), without
// texture caches. Eggs: displaced patches with three textures; stroll: meshes with images.
#include <benchmark/benchmark.h>

#include <memory>
#include <string>

#include "base/simd_targets.h"
#include "bench/support/invocations.h"
#include "scene/capture_reader.h"

namespace tessera::bench {
namespace {

void Warps(benchmark::State& state, const std::string& name, const std::string& target) {
  const CaptureInvocations of(TESSERA_SOURCE_DIR "/captures/" + name + ".glb", 1 << 14);
  std::vector<tilecore::ShadedPoint> points(of.invocations.size());
  force_simd_target(target);
  tilecore::PixelShader shader;
  for (auto _ : state) shader.shade(*of.frame, of.lighting, of.invocations, points);
  force_simd_target("");
  for (std::size_t i = 0; i < points.size(); i += 97)
    if (points[i].color != tilecore::shade_point(*of.frame, of.lighting, of.invocations[i]).color)
      state.SkipWithError("lanes shade differently");
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(points.size()));
}

void Alone(benchmark::State& state, const std::string& name) {
  const CaptureInvocations of(TESSERA_SOURCE_DIR "/captures/" + name + ".glb", 1 << 12);
  for (auto _ : state)
    for (const tilecore::Invocation& v : of.invocations)
      benchmark::DoNotOptimize(tilecore::shade_point(*of.frame, of.lighting, v));
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(of.invocations.size()));
}

const bool kRegistered = [] {
  for (const char* name : {"eggs", "stroll"}) {
    for (const std::string& target : simd_target_names())
      benchmark::RegisterBenchmark(("Shade/" + std::string(name) + "/" + target).c_str(),
                                   [name, target](benchmark::State& s) { Warps(s, name, target); });
    benchmark::RegisterBenchmark(("Shade/" + std::string(name) + "/alone").c_str(),
                                 [name](benchmark::State& s) { Alone(s, name); });
  }
  return true;
}();

}  // namespace
}  // namespace tessera::bench

// Measures pixel-shader invocations of the shipped captures: in warps on SIMD lanes, and one alone (the scalar twin),
// without texture caches. Eggs: displaced patches with three textures; stroll: meshes with images.
//
// Roofline: the least time of the shader's vector instructions on this machine, in sequence: arithmetic at the peak
// of multiply-adds or of mixed sums and products, divisions and roots at their peaks, gathers of texels from the
// first-level cache at theirs. Rates and shader take turns; processor time of one thread, the best of fifty rounds.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "base/simd_targets.h"
#include "base/thread_clock.h"
#include "bench/support/invocations.h"
#include "bench/support/shader_trace.h"
#include "bench/support/vector_rates.h"
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

// Nanoseconds of an invocation and of its parts at the machine's peak rates.
struct Roofline {
  double shader = 0, arithmetic = 0, divisions = 0, texel_gathers = 0, other_gathers = 0;
  double least() const { return arithmetic + divisions + texel_gathers; }
};

Roofline measure_roofline(const CaptureInvocations& of, const ShaderWork& work) {
  tilecore::PixelShader shader;
  std::vector<tilecore::ShadedPoint> points(of.invocations.size());
  std::vector<double> time, arithmetic, divisions, texels, others;
  for (int round = 0; round < 50; ++round) {
    const VectorTimes peak = measure_vector_times();
    const double start = thread_seconds();
    for (int again = 0; again < 3; ++again) shader.shade(*of.frame, of.lighting, of.invocations, points);
    time.push_back(1e9 * (thread_seconds() - start) / static_cast<double>(3 * points.size()));
    const double lane_ns = 1e9 / static_cast<double>(peak.lanes);
    arithmetic.push_back(lane_ns * work.arithmetic * peak.arithmetic);
    divisions.push_back(lane_ns * (work.divisions * peak.division + work.roots * peak.root));
    texels.push_back(lane_ns * work.texel_gathers * peak.gather);
    others.push_back(lane_ns * work.other_gathers * peak.gather);
  }
  // The best of the rounds: disturbances only make a round slower.
  const auto best = [](const std::vector<double>& v) { return *std::min_element(v.begin(), v.end()); };
  return {best(time), best(arithmetic), best(divisions), best(texels), best(others)};
}

// Reports an error if invocations take more than `limit` times the roofline: a ratio within one run, with room for noise.
void OverRoofline(benchmark::State& state, const std::string& name, const std::string& target, double limit) {
  const CaptureInvocations of(TESSERA_SOURCE_DIR "/captures/" + name + ".glb", 1 << 15);
  force_simd_target(target);
  const ShaderWork work = trace_shader(of, measure_vector_times().lanes, 19);
  Roofline roofline;
  for (auto _ : state) roofline = measure_roofline(of, work);
  force_simd_target("");
  const auto show = [&](const char* what, double value) { state.counters[what] = benchmark::Counter(value); };
  show("ns", roofline.shader), show("roofline_ns", roofline.least());
  show("arithmetic_ns", roofline.arithmetic), show("divisions_ns", roofline.divisions);
  show("texels_ns", roofline.texel_gathers), show("other_gathers_ns", roofline.other_gathers);
  show("arithmetic", work.arithmetic), show("divisions", work.divisions), show("roots", work.roots);
  show("texels", work.texel_gathers), show("other_gathers", work.other_gathers);
  const double ratio = roofline.shader / roofline.least();
  show("over_roofline", ratio);
  if (ratio > limit) state.SkipWithError(("takes " + std::to_string(ratio) + " times the roofline").c_str());
}

struct Workload {
  const char* capture;
  double avx3_limit, avx2_limit;
};

const bool kRegistered = [] {
  // [measured] AVX2 takes 3.25 and 4.34 times its roofline on a processor with AVX-512, whose own target takes 2.3 and 3.3. On an AMD
  // EPYC without AVX-512 it takes 4.1 to 4.7 and 5.9 to 6.0 times: the roofline is higher there, as the shader takes 0.17 and 0.19 of
  // the time of scalar code on both.
  for (const Workload& workload : {Workload{"eggs", 3.0, 5.5}, Workload{"stroll", 3.6, 7.0}}) {
    const std::string name = workload.capture;
    for (const std::string& target : simd_target_names())
      benchmark::RegisterBenchmark(("Shade/" + name + "/" + target).c_str(),
                                   [name, target](benchmark::State& s) { Warps(s, name, target); });
    for (const std::string& target : simd_target_names())
      if (const double limit = target == "AVX3" ? workload.avx3_limit : workload.avx2_limit;
          target == "AVX3" || target == "AVX2")
        benchmark::RegisterBenchmark(("OverRoofline/" + name + "/" + target).c_str(), [=](benchmark::State& s) {
          OverRoofline(s, name, target, limit);
        })->Iterations(1);
    benchmark::RegisterBenchmark(("Shade/" + name + "/alone").c_str(), [name](benchmark::State& s) { Alone(s, name); });
  }
  return true;
}();

}  // namespace
}  // namespace tessera::bench

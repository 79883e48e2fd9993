// Measures the roofline of box and triangle tests (bench/support/roofline.h), per SIMD target.
//
// Rates are per second of a thread's processor time, so that other programs do not lower them. threads:2 gives the
// rate of each of two threads that run at once; the machine's roofline is twice that.
#include <benchmark/benchmark.h>

#include <string>

#include "base/simd_targets.h"
#include "bench/support/roofline.h"

namespace tessera::bench {
namespace {

void Ceiling(benchmark::State& state, RooflineTest test, Arrangement arrangement, const std::string& target) {
  // Threads of one benchmark have the same target.
  if (state.thread_index() == 0) force_simd_target(target);
  const RooflineInput in = make_roofline_input();
  const std::size_t tests = tests_in_pass(test);
  Masks masks(tests);
  if (state.thread_index() == 0) {
    test_all(test, in, arrangement, masks);
    if (!is_verified(test, in, arrangement, masks)) state.SkipWithError("a mask differs from the scalar test");
  }
  for (auto _ : state) {
    test_all(test, in, arrangement, masks);
    benchmark::DoNotOptimize(masks.data());
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(tests));
  state.SetLabel(target);
}

const bool kRegistered = [] {
  constexpr const char* kTests[] = {"Boxes", "LinearTriangles", "PerspectiveTriangles"};
  constexpr const char* kArrangements[] = {"OnePrimitive", "OneSample"};
  for (const std::string& target : simd_target_names())
    for (const RooflineTest test :
         {RooflineTest::kBoxes, RooflineTest::kLinearTriangles, RooflineTest::kPerspectiveTriangles})
      for (const Arrangement arrangement : {Arrangement::kOnePrimitive, Arrangement::kOneSample}) {
        const std::string name = std::string("Ceiling") + kTests[static_cast<int>(test)] + "/" +
                                 kArrangements[static_cast<int>(arrangement)] + "/" + target;
        auto* b = benchmark::RegisterBenchmark(name.c_str(),
                                               [=](benchmark::State& s) { Ceiling(s, test, arrangement, target); });
        b->Threads(1);
        if (target == simd_target_names().front()) b->Threads(2);
      }
  return true;
}();

}  // namespace
}  // namespace tessera::bench

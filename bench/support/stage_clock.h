#pragma once

#include <array>
#include <cstdint>

#include <hwy/base.h>

#if HWY_ARCH_X86
#include <x86intrin.h>
#else
#include <chrono>
#endif

#include "tilecore/visibility/sample_tests.h"

namespace tessera::bench {

// Ticks of a clock with a constant rate, in program order only as far as the processor keeps it.
inline std::uint64_t ticks() {
#if HWY_ARCH_X86
  return __rdtsc();
#else
  return static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count());
#endif
}

struct StageTotals {
  std::uint64_t ticks = 0, enters = 0, tests = 0;
};

// Time of the stages of the ray path on one thread.
struct StageClock {
  using Totals = std::array<StageTotals, tilecore::kRayStages>;
  static Totals take() {
    const Totals taken = totals;
    totals = {};
    return taken;
  }

  static void enter(tilecore::RayStage next) {
    const std::uint64_t now = bench::ticks();
    totals[static_cast<std::size_t>(stage)].ticks += now - since;
    ++totals[static_cast<std::size_t>(next)].enters;
    stage = next;
    since = now;
  }
  static void count(tilecore::RayStage of, std::uint64_t tests) { totals[static_cast<std::size_t>(of)].tests += tests; }

 private:
  static inline Totals totals;
  static inline tilecore::RayStage stage = tilecore::RayStage::kRest;
  static inline std::uint64_t since = 0;
};

}  // namespace tessera::bench

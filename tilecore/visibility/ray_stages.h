#pragma once

#include <cstdint>

namespace tessera::tilecore {

// What a kernel of the ray path is at: samples of the pattern against the box of a leaf; those that are left against the
// boxes of its cells; the pairs that are left against both triangles, corners fetched; what a hit is made of and given to
// the sink. kRest: none of them.
enum class RayStage { kClasses, kBoxes, kTriangles, kHits, kRest };
inline constexpr int kRayStages = 5;

// Kernels tell it where they are. A benchmark compiles them with a clock that looks.
struct NoStageClock {
  static void enter(RayStage) {}
  static void count(RayStage, std::uint64_t) {}  // tests
};

}  // namespace tessera::tilecore

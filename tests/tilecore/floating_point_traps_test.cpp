// Units whose headers promise to raise neither the invalid nor the divide-by-zero flag, on the scenes that are hardest for them, with
// traps for both: a broken promise ends the test program. Compiled for every instruction set that this machine has.
#include <gtest/gtest.h>

#include <csignal>

#include "base/parallel.h"
#include "base/simd_targets.h"
#include "binner/tile_coverage.h"
#include "frontend/front_end.h"
#include "shaders_cpp/bicubic.h"
#include "tests/frontend/bound_scenes.h"
#include "tests/support/floating_point_traps.h"
#include "tilecore/bundle_frustum.h"
#include "tilecore/cell_test.h"
#include "tilecore/micro_mesh.h"
#include "tilecore/tessellator.h"
#include "tilecore/tile_frustum.h"

namespace tessera::tilecore {
namespace {

using frontend::Hard;
using test::FloatingPointTraps;
using test::Random;

#define SKIP_UNLESS_FLAGS_ARE_KEPT \
  if (!FloatingPointTraps::kTheCompilerKeepsFlags) GTEST_SKIP() << "this compiler does not keep floating-point flags"

class Traps : public testing::TestWithParam<int> {
 protected:
  void SetUp() override { SKIP_UNLESS_FLAGS_ARE_KEPT; }
  Hard kind = static_cast<Hard>(GetParam());
  Random random{static_cast<std::uint32_t>(GetParam()) + 1};
  ThreadLimit one{1};  // flags belong to a thread
};

TEST_P(Traps, BoundsOfEveryMethodRaiseNothing) {
  for (int trial = 0; trial < 4; ++trial) {
    const frontend::Scene scene(kind, random);
    for (std::size_t method = 0; method < frontend::kBoundMethodNames.size(); ++method) {
      const FloatingPointTraps traps;
      frontend::SubPatchBounder bounder(*scene.frame, *scene.pyramids, static_cast<frontend::BoundMethod>(method));
      for (std::uint32_t patch = 0; patch < scene.frame->assembly->patch_count(); ++patch) {
        bounder.begin(patch);
        const frontend::TessellationPattern& pattern = scene.frame->patterns[patch];
        for (const frontend::CellRange& cells : {frontend::CellRange{0, 0, pattern.nu, pattern.nv}, frontend::CellRange{0, 0, 1, 1}}) {
          const frontend::SubPatchBody body = bounder.body(cells);
          screen_bounds(body.corners, scene.frame->projection, body.margin);
        }
      }
    }
  }
}

TEST_P(Traps, TheFrontEndAndTheCoverageOfTilesRaiseNothing) {
  for (int trial = 0; trial < 4; ++trial) {
    const frontend::Scene scene(kind, random);
    for (const int segments : {1, 4}) {
      hardware::GpuConfiguration gpu;
      gpu.binner_time_segments = segments;
      gpu.tile_width = gpu.tile_height = 16;
      const binner::TileGrid grid(320, 240, {0, 0, 320, 240}, 16, 16);
      const FloatingPointTraps traps;
      const frontend::FrontEndResult result = run_front_end(*scene.frame, *scene.pyramids, gpu);
      binner::TileCoverageUnit unit(gpu);
      for (const frontend::BoundedSubPatch& sub_patch : result.sub_patches) unit.cover(sub_patch, true, grid);
    }
  }
}

// Tessellation, boxes of cells and leaves, and the times at which leaves touch tiles.
TEST_P(Traps, TessellationAndTheFrustumOfATileRaiseNothing) {
  const frontend::Scene scene(kind, random);
  for (const std::string& target : simd_target_names()) {
    force_simd_target(target);
    {
      const FloatingPointTraps traps;
      Tessellator tessellator;
      MicroMesh mesh;
      for (std::uint32_t patch = 0; patch < scene.frame->assembly->patch_count(); ++patch) {
        const frontend::TessellationPattern& pattern = scene.frame->patterns[patch];
        tessellator.tessellate(*scene.frame, patch, {0, 0, std::min<std::uint8_t>(pattern.nu, 16), std::min<std::uint8_t>(pattern.nv, 16)}, {true, true}, mesh);
        std::vector<TimeRange> times(mesh.leaves.size());
        for (const IntRect& pixels : {IntRect{0, 0, 16, 16}, IntRect{152, 112, 160, 120}})
          for (const float lens : {0.0f, 1.0f}) touching_times(mesh.leaves, pixels, true, lens, times);
      }
    }
    force_simd_target("");
  }
}

INSTANTIATE_TEST_SUITE_P(HardCase, Traps, testing::Range(0, static_cast<int>(Hard::kCount)), [](const auto& instance) { return std::string(frontend::kHardNames[instance.param]); });

TEST(Traps, TheBundleFrustumRaisesNothingForRandomStillAndSlowBoxes) {
  SKIP_UNLESS_FLAGS_ARE_KEPT;
  Random random(3);
  const FloatingPointTraps traps;
  for (int trial = 0; trial < 20000; ++trial) {
    RaySpace space;
    space.moving = true;
    space.lens_radius = trial % 2 == 0 ? 0 : 3;
    space.inverse_focus = trial % 4 == 1 ? 0.25 : 0;
    BundleFrustum frustum(space, {0, 0, 8, 8}, 0.1f, trial % 3 == 0 ? std::numeric_limits<float>::infinity() : 100.0f);
    MotionBox box;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float a = random.uniform(-20, 20), size = trial % 5 == 0 ? 0.0f : random.uniform(0, 5);
      // At rest, slow, fast.
      const float b = trial % 7 == 0 ? a : trial % 7 == 1 ? std::nextafter(a, 100.0f) : random.uniform(-20, 20);
      box.low[0][axis] = a, box.high[0][axis] = a + size;
      box.low[1][axis] = b, box.high[1][axis] = b + size;
    }
    frustum.drop_depth_planes(box);
    frustum.outside(box);
    frustum.times(box);
  }
}

TEST(Traps, TheInsideTestRaisesNothingForDegenerateTriangles) {
  SKIP_UNLESS_FLAGS_ARE_KEPT;
  Random random(4);
  const FloatingPointTraps traps;
  int hits = 0;
  for (int trial = 0; trial < 100000; ++trial) {
    const auto corner = [&] { return Corner{static_cast<float>(random.integer(-2, 2)), static_cast<float>(random.integer(-2, 2)), random.uniform(0.1f, 1), random.uniform(1, 9)}; };
    const Corner a = corner();
    const Corner b = trial % 3 == 0 ? a : corner();
    const Corner c = trial % 5 == 0 ? b : corner();
    TriangleHit hit;
    hits += exact_triangle_test(a, b, c, trial % 2 == 0, hit) ? 1 : 0;
  }
  EXPECT_GT(hits, 1000);
}

TEST(Traps, NormalsOfPolesAndPointsRaiseNothing) {
  SKIP_UNLESS_FLAGS_ARE_KEPT;
  Random random(5);
  const FloatingPointTraps traps;
  for (const Hard kind : {Hard::kPole, Hard::kPoint, Hard::kFolded, Hard::kParallel, Hard::kHuge, Hard::kTiny})
    for (int trial = 0; trial < 200; ++trial) {
      const std::vector<Vec3> net = frontend::hard_net(kind, random);
      shaders::ControlPoints<float> c;
      for (std::size_t i = 0; i < 16; ++i) c[i] = {net[i].x, net[i].y, net[i].z};
      const float u = static_cast<float>(trial % 5) / 4.0f, v = trial < 100 ? 1.0f : random.uniform(0, 1);
      shaders::bicubic_normal(c, u, v, shaders::bicubic_point<float>(shaders::bicubic_row(c, v), u));
    }
}

// The failing twins: what has no promise raises, and the trap sees it.
TEST(TrapsDeathTest, ADivisionByZeroAndAnInvalidOperationAreCaught) {
  volatile double zero = 0;
  const auto divide = [&] {
    const FloatingPointTraps traps;
    volatile double out = 1 / zero;
    (void)out;
  };
  const auto subtract = [&] {
    volatile double infinite = std::numeric_limits<double>::infinity();
    const FloatingPointTraps traps;
    volatile double out = infinite - infinite;
    (void)out;
  };
  EXPECT_EXIT(divide(), testing::KilledBySignal(SIGFPE), "");
  EXPECT_EXIT(subtract(), testing::KilledBySignal(SIGFPE), "");
}

}  // namespace
}  // namespace tessera::tilecore

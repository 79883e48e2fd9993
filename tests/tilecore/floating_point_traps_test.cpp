// Units whose headers promise to raise neither the invalid nor the divide-by-zero flag, on the scenes that are hardest
// for them, with traps for both: a broken promise ends the test program. Vector kernels promise nothing: they compute
// every lane and choose afterwards.
#include <csignal>

#include "base/parallel.h"
#include "binner/tile_coverage.h"
#include "frontend/front_end.h"
#include "gpu/configuration.h"
#include "shaders_cpp/bicubic.h"
#include "tests/frontend/bound_scenes.h"
#include "tests/support/floating_point_traps.h"
#include "tests/support/tests.h"
#include "tilecore/visibility/bundle_frustum.h"
#include "tilecore/visibility/cell_test.h"

namespace tessera::tilecore::floating_point_traps_test {
namespace {

using frontend::Hard;
using test::FloatingPointTraps;

#define SKIP_UNLESS_FLAGS_ARE_KEPT \
  if (!FloatingPointTraps::kTheCompilerKeepsFlags) GTEST_SKIP() << "this compiler does not keep floating-point flags"

class Traps : public testing::TestWithParam<int> {
 protected:
  void SetUp() override { SKIP_UNLESS_FLAGS_ARE_KEPT; }
  Hard kind = static_cast<Hard>(GetParam());
  Random random{static_cast<std::uint32_t>(GetParam()) + 1};
  ThreadLimit one{1};  // flags belong to a thread
};

TEST_P(Traps, BoundsRaiseNothing) {
  for (int trial = 0; trial < 4; ++trial) {
    const frontend::Scene scene(kind, random);
    for (const auto method : {frontend::BoundMethod::kAabb, frontend::BoundMethod::kObb, frontend::BoundMethod::kTpatch,
                              frontend::BoundMethod::kNpatch}) {
      const FloatingPointTraps traps;
      frontend::SubPatchBounder bounder(*scene.frame, *scene.pyramids, method);
      for (std::uint32_t patch = 0; patch < scene.frame->assembly->patch_count(); ++patch) {
        bounder.begin(patch);
        const scene::TessellationPattern& pattern = scene.frame->pattern_of(patch);
        for (const scene::CellRange& cells :
             {scene::CellRange{0, 0, pattern.nu, pattern.nv}, scene::CellRange{0, 0, 1, 1}}) {
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
      gpu::GpuConfiguration gpu;
      gpu.binner.time_segments = segments;
      gpu.tile.width = gpu.tile.height = 16;
      const binner::TileGrid grid(320, 240, 16, 16);
      const FloatingPointTraps traps;
      const frontend::FrontEndResult result = run_front_end(*scene.frame, *scene.pyramids, gpu.front_end_spec());
      binner::TileCoverageUnit unit(gpu.binner);
      for (const frontend::BoundedSubPatch& sub_patch : result.sub_patches)
        unit.cover({sub_patch.bounds, sub_patch.corners(*scene.frame)}, true, grid);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(HardCase, Traps, testing::Range(0, static_cast<int>(Hard::kCount)),
                         [](const auto& instance) { return std::string(frontend::kHardNames[instance.param]); });

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
    const auto corner = [&] {
      return Corner{static_cast<float>(random.integer(-2, 2)), static_cast<float>(random.integer(-2, 2)),
                    random.uniform(0.1f, 1), random.uniform(1, 9)};
    };
    const Corner a = corner();
    const Corner b = trial % 3 == 0 ? a : corner();
    const Corner c = trial % 5 == 0 ? b : corner();
    TriangleHit hit;
    hits += exact_triangle_test(a, b, c, trial % 2 == 0, hit) ? 1 : 0;
  }
  EXPECT_GT(hits, 1000);
}

// The failing twins: units without such a promise raise the flag, and the trap sees it. The normal of a patch that is
// a point is 0/0, found out afterwards, in every lane alike.
TEST(TrapsDeathTest, ADivisionByZeroAndAnInvalidOperationAreCaught) {
  SKIP_UNLESS_FLAGS_ARE_KEPT;
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
  const auto normal_of_a_point = [] {
    volatile float place = 0.5f;  // so that nothing is computed before the traps are armed, or not at all
    const float at = place;
    shaders::ControlPoints<float> c;
    for (auto& p : c) p = {at, at, at};
    const FloatingPointTraps traps;
    volatile float out =
        shaders::bicubic_normal(c, at, at, shaders::bicubic_point<float>(shaders::bicubic_row(c, at), at)).z;
    (void)out;
  };
  EXPECT_EXIT(divide(), testing::KilledBySignal(SIGFPE), "");
  EXPECT_EXIT(normal_of_a_point(), testing::KilledBySignal(SIGFPE), "");
  EXPECT_EXIT(subtract(), testing::KilledBySignal(SIGFPE), "");
}

}  // namespace
}  // namespace tessera::tilecore::floating_point_traps_test

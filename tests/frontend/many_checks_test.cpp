// Invariant 3 and culling at length: a hundred million points lie inside the bounds of their sub-patches, and the
// front end drops nothing that is in sight. All threads work from fixed seeds, and the checks are the same for any
// number of threads.
#include "base/parallel.h"
#include "tests/frontend/bound_checks.h"
#include "tests/frontend/round_scenes.h"
#include "tests/support/tests.h"

namespace tessera::frontend::many_checks_test {
namespace {

#ifdef TESSERA_SANITIZED
constexpr std::int64_t kPoints = 1'000'000, kSights = 100'000;
#else
constexpr std::int64_t kPoints = 100'000'000, kSights = 10'000'000;
#endif

constexpr std::size_t kKinds = static_cast<std::size_t>(Hard::kCount), kMethods = kEnumWords<BoundMethod>.size();

// Rounds of one scene of each hard case by each method, until there are enough checks.
BoundOutcome check_points(std::int64_t least, BoundTwin twin) {
  BoundOutcome total;
  for (std::uint32_t round = 0; total.points < least; ++round) {
    std::array<BoundOutcome, kKinds * kMethods> part{};
    parallel_for(part.size(), [&](std::size_t k) {
      Random random(1'000'000 + round * static_cast<std::uint32_t>(part.size()) + static_cast<std::uint32_t>(k));
      const Scene scene(static_cast<Hard>(k / kMethods), random);
      part[k] = check_scene(scene, random, static_cast<BoundMethod>(k % kMethods), twin, 48);
    });
    for (const BoundOutcome& p : part) total.points += p.points, total.violations += p.violations;
  }
  return total;
}

// ---- Sight ------------------------------------------------------------------------------------------------------

struct SightOutcome {
  std::int64_t cells = 0, culled_view = 0, culled_back = 0, checks = 0, violations = 0;
};

// Whether a point of a triangle is seen in the frame at a time through a lens point, the triangle facing the camera.
bool in_sight(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable,
              const std::array<const RasterVertex*, 3>& corner, Random& random) {
  const double t = static_cast<double>(random.uniform(0, 1)), angle = static_cast<double>(random.uniform(0, 6.2831f)),
               radius = std::sqrt(static_cast<double>(random.uniform(0, 1)));
  const glm::dvec2 lens = glm::dvec2(std::cos(angle), std::sin(angle)) * radius;
  double a = static_cast<double>(random.uniform(0, 1)), b = static_cast<double>(random.uniform(0, 1));
  if (a + b > 1) a = 1 - a, b = 1 - b;
  const std::array<double, 3> weight = {1 - a - b, a, b};
  DVec4 r(0.0);
  bool in_front = true;
  for (std::size_t k = 0; k < 3; ++k) {
    r += (corner[k]->raster[0] * (1 - t) + corner[k]->raster[1] * t) * weight[k];
    for (const double depth : corner[k]->depth) in_front &= depth >= frame.projection.near;
  }
  const SampledPoint point = see(r, frame.projection, lens.x, lens.y);
  if (!point.drawn || point.x < 0 || point.y < 0 || point.x >= frame.request.width || point.y >= frame.request.height)
    return false;
  // A triangle across the near plane counts as in sight, whichever way it faces.
  return drawable.material->double_sided || !in_front ||
         facing_area(frame, drawable.mirrored, *corner[0], *corner[1], *corner[2], t, lens) < -1e-9;
}

// Looks at every cell that the front end drops.
SightOutcome check_sight(const RoundScene& scene, Random& random, bool drop_everything) {
  SightOutcome out;
  const scene::FrameGeometry& frame = *scene.frame;
  PatchSplitter splitter(frame, *scene.pyramids, FrontEndSpec{});
  for (std::uint32_t patch = 0; patch < frame.assembly->patch_count(); ++patch) {
    std::vector<BoundedSubPatch> kept;
    FrontendCounters counters;
    splitter.split(patch, kept, counters);
    out.cells += static_cast<std::int64_t>(counters.cells);
    out.culled_view += static_cast<std::int64_t>(counters.cells_culled_frustum);
    out.culled_back += static_cast<std::int64_t>(counters.cells_culled_backface);
    const scene::CellRange whole = patch_cells(frame, patch);
    std::vector<char> covered(static_cast<std::size_t>(whole.i1) * whole.j1);
    const auto at = [&](int x, int y) -> char& { return covered[static_cast<std::size_t>(y * whole.i1 + x)]; };
    if (drop_everything) kept.clear();
    for (const BoundedSubPatch& piece : kept)
      for (int y = piece.range.j0; y < piece.range.j1; ++y)
        for (int x = piece.range.i0; x < piece.range.i1; ++x) at(x, y) = 1;
    for (int y = 0; y < whole.j1; ++y)
      for (int x = 0; x < whole.i1; ++x) {
        if (at(x, y) != 0) continue;
        const std::array<RasterVertex, 4> corner = cell_corners(frame, patch, x, y);
        for (int k = 0; k < 16; ++k) {
          const std::size_t second = k % 2 == 0 ? 1 : 2;
          ++out.checks;
          out.violations +=
              in_sight(frame, frame.drawable_of(patch), {&corner[0], &corner[second], &corner[second + 1]}, random);
        }
      }
  }
  return out;
}

RoundScene::Options sight_options(std::size_t k) {
  RoundScene::Options options;
  options.mesh = k % 2 != 0;
  options.sheet = k % 8 == 6;
  options.moving = k % 3 != 0;
  options.deforming = k % 5 == 4;
  options.mirrored = k % 7 == 3;
  options.orthographic = k % 11 == 5;
  options.aperture = k % 4 >= 2 ? 0.08f : 0.0f;
  options.displacement = options.mesh ? 0.0f : 0.02f * static_cast<float>(k % 3);
  options.offset = k % 2 == 0 ? 0.5f : 2.5f;
  return options;
}

SightOutcome check_sights(std::int64_t least, bool drop_everything) {
  SightOutcome total;
  constexpr std::size_t kScenes = 64;
  for (std::uint32_t round = 0; total.checks < least; ++round) {
    std::array<SightOutcome, kScenes> part{};
    parallel_for(kScenes, [&](std::size_t k) {
      Random random(2'000'000 + round * static_cast<std::uint32_t>(kScenes) + static_cast<std::uint32_t>(k));
      part[k] = check_sight(RoundScene(sight_options(k), random), random, drop_everything);
    });
    for (const SightOutcome& p : part) {
      total.cells += p.cells, total.culled_view += p.culled_view, total.culled_back += p.culled_back;
      total.checks += p.checks, total.violations += p.violations;
    }
  }
  return total;
}

TEST(HundredMillionChecks, FindNoPointOutsideItsBound) {
  const BoundOutcome out = check_points(kPoints, BoundTwin::kHonest);
  std::printf("%lld points of displaced, moving, defocused sub-patches checked against their bounds: %lld outside\n",
              static_cast<long long>(out.points), static_cast<long long>(out.violations));
  EXPECT_GE(out.points, kPoints);
  EXPECT_EQ(out.violations, 0);
}

TEST(HundredMillionChecks, FindNoCulledCellInSight) {
  const SightOutcome out = check_sights(kSights, false);
  std::printf(
      "%lld cells, %lld culled as out of view and %lld as back faces; %lld points of theirs looked at: %lld in sight\n",
      static_cast<long long>(out.cells), static_cast<long long>(out.culled_view),
      static_cast<long long>(out.culled_back), static_cast<long long>(out.checks),
      static_cast<long long>(out.violations));
  EXPECT_EQ(out.violations, 0);
  EXPECT_GT(out.culled_view, out.cells / 50);
  EXPECT_GT(out.culled_back, out.cells / 20);
}

TEST(ManyChecksTwin, BoundsAFiftiethTooSmallAreCaught) {
  EXPECT_GT(check_points(100'000, BoundTwin::kShrunk).violations, 0);
}

TEST(ManyChecksTwin, CullingVisibleCellsIsCaught) { EXPECT_GT(check_sights(10'000, true).violations, 0); }

}  // namespace
}  // namespace tessera::frontend::many_checks_test

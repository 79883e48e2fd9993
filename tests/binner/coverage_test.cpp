// Invariant 3 for the binner: no tile and no time at which a moving, defocused box is seen is ever left out, and
// other tiles and times are.
#include "binner/coverage.h"
#include "binner/tile_coverage.h"
#include "binner/time_segments.h"
#include "gpu/configuration.h"
#include "tests/support/tests.h"

namespace tessera::binner::coverage_test {
namespace {

using frontend::MovingCorners;
using scene::Projection;

constexpr int kWidth = 320, kHeight = 240;

Projection projection(bool orthographic, double lens) {
  Projection p;
  p.orthographic = orthographic;
  p.center_x = kWidth / 2.0;
  p.center_y = kHeight / 2.0;
  p.scale = orthographic ? 60 : 250;
  p.near = 0.1;
  p.lens_scale = p.scale * lens;
  p.inverse_focus = 0.5;
  return p;
}

double draw(Random& random, double low, double high) {
  return low + (high - low) * static_cast<double>(random.uniform(0, 1));
}

// A box as the front end makes them: one frame for both motion keys, extents and camera of each key its own.
MovingCorners random_corners(Random& random, const Projection& p) {
  const auto turn = [&](double angle) {
    return glm::mat3_cast(glm::angleAxis(angle, glm::normalize(DVec3(random.in_box(1)) + DVec3(1e-3))));
  };
  const DMat3 frame = turn(draw(random, 0, 3));
  const bool deforming = random.coin();
  const double reach = random.coin() ? 0.3 : 1.5;
  DVec3 half(draw(random, 0.01, 1), draw(random, 0.01, 0.4), draw(random, 0.001, 0.1)), center(random.in_box(1.5));
  DVec3 away(0, 0, -draw(random, 0.5, 6));
  MovingCorners corners;
  for (std::size_t key = 0; key < 2; ++key) {
    const DMat3 camera = random.coin() ? turn(draw(random, 0, 0.6)) : DMat3(1.0);
    for (std::size_t i = 0; i < 8; ++i)
      corners[8 * key + i] =
          p.matrix() *
          DVec4(camera * (frame * (half * DVec3((i & 1) ? 1 : -1, (i & 2) ? 1 : -1, (i & 4) ? 1 : -1)) + center) + away,
                1);
    away += DVec3(random.in_box(1)) * reach;
    if (deforming) half *= draw(random, 0.3, 3), center += DVec3(random.in_box(0.5f));
  }
  return corners;
}

// Point of the box at a key; faces, edges and corners as likely as the inside.
DVec4 random_point(Random& random, const MovingCorners& corners, std::size_t key) {
  const auto place = [&] { return random.coin() ? (random.coin() ? 1.0 : 0.0) : draw(random, 0, 1); };
  const double a = place(), b = place(), c = place();
  DVec4 sum(0);
  for (std::size_t i = 0; i < 8; ++i)
    sum += corners[8 * key + i] * ((i & 1 ? a : 1 - a) * (i & 2 ? b : 1 - b) * (i & 4 ? c : 1 - c));
  return sum;
}

// Times that a method gives the tiles of one sub-patch.
using TimesOfTile = std::function<TimeInterval(int column, int row)>;
using Method = std::function<TimesOfTile(const MovingBody&, const TileGrid&)>;

struct Missed {
  int tiles = 0, times = 0;
};

// Samples random boxes, motions and lenses densely in double precision and counts the seen samples that the method
// leaves out.
Missed missed_by(const Method& method, std::uint32_t seed) {
  Random random(seed);
  Missed missed;
  for (int trial = 0; trial < 2500; ++trial) {
    const Projection p = projection(random.integer(0, 3) == 0, random.coin() ? 0.0 : 0.05);
    const TileGrid grid(kWidth, kHeight, 16, 8 << random.integer(0, 2));
    const MovingCorners corners = random_corners(random, p);
    const auto bounds = frontend::screen_bounds(corners, p, {0, 0, 0, 1.0 / 256});
    if (!bounds) continue;
    const TimesOfTile times_of = method({*bounds, corners}, grid);
    for (int k = 0; k < 60; ++k) {
      // Any point at one key may go to any point at the other.
      const double t = random.coin() ? draw(random, 0, 1) : random.integer(0, 255) / 256.0;
      const DVec4 r = random_point(random, corners, 0) * (1 - t) + random_point(random, corners, 1) * t;
      if (!(r.z >= p.near)) continue;
      const double coc = p.lens_scale * (p.orthographic ? 1 - r.z * p.inverse_focus : 1 / r.w - p.inverse_focus),
                   angle = draw(random, 0, 6.3);
      const double x = r.x / r.w + std::cos(angle) * coc, y = r.y / r.w + std::sin(angle) * coc;
      if (x < 0 || y < 0 || x >= kWidth || y >= kHeight) continue;
      const TimeInterval times =
          times_of(static_cast<int>(x / grid.tile_width()), static_cast<int>(y / grid.tile_height()));
      const int code = std::min(255, static_cast<int>(t * 256));
      missed.tiles += times.empty() ? 1 : 0;
      missed.times += times.empty() || (code >= times.first && code <= times.last) ? 0 : 1;
    }
  }
  return missed;
}

gpu::GpuConfiguration methods(CoverageMethod coverage, bool intervals, int segments) {
  gpu::GpuConfiguration gpu;
  gpu.binner.coverage = coverage;
  gpu.binner.time_intervals = intervals;
  gpu.binner.time_segments = segments;
  return gpu;
}

using Change = std::function<void(MovingBody&)>;

// The binner's own coverage of a sub-patch that `change` has tampered with.
Method binners(
    const gpu::GpuConfiguration& gpu, const Change& change = [](MovingBody&) {}) {
  return [=](const MovingBody& sub_patch, const TileGrid& grid) {
    MovingBody changed = sub_patch;
    change(changed);
    TileCoverageUnit unit(gpu.binner);
    return [coverage = unit.cover(changed, true, grid)](int column, int row) {
      return coverage.tiles.contains(column, row) ? coverage.at(column, row) : kNoTime;
    };
  };
}

// ---- Nothing that is seen is left out ---------------------------------------------------------------------------

TEST(ExactCoverage, NeverDropsATileThatTheMovingBoxTouches) {
  EXPECT_EQ(missed_by(binners(methods(CoverageMethod::kExact, false, 1)), 1).tiles, 0);
}

TEST(TimeIntervals, HoldEveryTimeAtWhichTheMovingBoxTouchesTheTile) {
  const Missed missed = missed_by(binners(methods(CoverageMethod::kRectangle, true, 1)), 2);
  EXPECT_EQ(missed.tiles, 0);
  EXPECT_EQ(missed.times, 0);
}

TEST(TimeSegments, HoldEveryTimeAtWhichTheMovingBoxTouchesTheTile) {
  for (const int count : {2, 3, 16, 0}) {
    const Missed missed = missed_by(binners(methods(CoverageMethod::kRectangle, false, count)), 3);
    EXPECT_EQ(missed.tiles, 0) << count;
    EXPECT_EQ(missed.times, 0) << count;
  }
}

TEST(TileCoverage, AllMethodsTogetherLeaveOutNothingThatIsSeen) {  // M3
  const Missed missed = missed_by(binners(methods(CoverageMethod::kExact, true, 7)), 4);
  EXPECT_EQ(missed.tiles, 0);
  EXPECT_EQ(missed.times, 0);
}

// ---- Broken twins that the same sampling catches ----------------------------------------------------------------

void forget_grow(MovingBody& s) { s.bounds.grow = 0; }
void forget_motion(MovingBody& s) { std::copy_n(s.corners.begin(), 8, s.corners.begin() + 8); }
// Projected boxes interpolated linearly: screen-space motion is not linear.
void project_first(MovingBody& s) {
  if (s.bounds.crosses_near) return;
  for (DVec4& c : s.corners) c = {c.x / c.w, c.y / c.w, c.z, 1};
}

TEST(ExactCoverageTwin, WithoutTheLensOrTheMotionItDropsTilesAndIsCaught) {
  const gpu::GpuConfiguration exact = methods(CoverageMethod::kExact, false, 1);
  EXPECT_GT(missed_by(binners(exact, forget_grow), 1).tiles, 0);
  EXPECT_GT(missed_by(binners(exact, forget_motion), 1).tiles, 0);
}

TEST(TimeIntervalsTwin, LinearMotionOnScreenNoLensOrNoMotionIsCaught) {
  const gpu::GpuConfiguration intervals = methods(CoverageMethod::kRectangle, true, 1);
  EXPECT_GT(missed_by(binners(intervals, project_first), 2).times, 0);
  EXPECT_GT(missed_by(binners(intervals, forget_grow), 2).times, 0);
  EXPECT_GT(missed_by(binners(intervals, forget_motion), 2).tiles, 0);
}

TEST(TimeSegmentsTwin, LinearMotionOnScreenNoLensOrNoMotionIsCaught) {
  const gpu::GpuConfiguration segments = methods(CoverageMethod::kRectangle, false, 16);
  EXPECT_GT(missed_by(binners(segments, project_first), 3).times, 0);
  EXPECT_GT(missed_by(binners(segments, forget_grow), 3).times, 0);
  EXPECT_GT(missed_by(binners(segments, forget_motion), 3).tiles, 0);
}

// Each corner on its own line from key to key: right for a rigid box only.
TimesOfTile corner_by_corner(const MovingBody& sub_patch, const TileGrid& grid) {
  return [sub_patch, &grid](int column, int row) {
    if (sub_patch.bounds.crosses_near) return TimeInterval{};
    const double grow = static_cast<double>(sub_patch.bounds.grow);
    TimeInterval times = kNoTime;
    for (int code = 0; code < 256; ++code) {
      frontend::ScreenBounds box{1e9f, 1e9f, -1e9f, -1e9f, 0, 1, 2, false};
      for (const double t : {code / 256.0, (code + 1) / 256.0})
        for (std::size_t i = 0; i < 8; ++i) {
          const DVec4 r = sub_patch.corners[i] * (1 - t) + sub_patch.corners[8 + i] * t;
          box.x0 = std::min(box.x0, static_cast<float>(r.x / r.w - grow - 0.01));
          box.y0 = std::min(box.y0, static_cast<float>(r.y / r.w - grow - 0.01));
          box.x1 = std::max(box.x1, static_cast<float>(r.x / r.w + grow + 0.01));
          box.y1 = std::max(box.y1, static_cast<float>(r.y / r.w + grow + 0.01));
        }
      if (grid.covered(box).contains(column, row)) times = times.hull({code, code});
    }
    return times;
  };
}

TEST(TimeIntervalsTwin, CornersThatMoveOnTheirOwnLinesMissADeformingBoxThatTurns) {
  const Missed missed = missed_by(corner_by_corner, 2);
  EXPECT_GT(missed.tiles + missed.times, 0);
}

// ---- Tiles that are left out -------------------------------------------------------------------------------------

// An orthographic box (w = 1) between two points of the screen at each key, without thickness.
MovingBody segment_between(const std::array<std::array<double, 2>, 4>& ends) {
  MovingBody s{{1e9f, 1e9f, -1e9f, -1e9f, 0, 1, 2, false}, {}};
  for (std::size_t i = 0; i < 16; ++i) {
    const auto& end = ends[2 * (i / 8) + i % 2];
    s.corners[i] = {end[0], end[1], 1, 1};
    s.bounds.x0 = std::min(s.bounds.x0, static_cast<float>(end[0]));
    s.bounds.y0 = std::min(s.bounds.y0, static_cast<float>(end[1]));
    s.bounds.x1 = std::max(s.bounds.x1, static_cast<float>(end[0]));
    s.bounds.y1 = std::max(s.bounds.y1, static_cast<float>(end[1]));
  }
  return s;
}

TileCoverage cover(const MovingBody& sub_patch, const gpu::GpuConfiguration& gpu, bool moving = true) {
  TileCoverageUnit unit(gpu.binner);
  return unit.cover(sub_patch, moving, TileGrid(128, 128, 32, 32));
}

TEST(ExactCoverage, ADiagonalKeepsTheTilesAlongItOnly) {  // COV2
  const TileCoverage c =
      cover(segment_between({{{1, 2}, {126, 127}, {1, 2}, {126, 127}}}), methods(CoverageMethod::kExact, false, 1));
  // The way crosses the four tiles of the diagonal, and those below them where it is a pixel below the diagonal.
  EXPECT_EQ(c.covered, 7u);
  EXPECT_EQ(c.dropped_exact, 9u);
  EXPECT_TRUE(c.at(3, 0).empty());
  EXPECT_FALSE(c.at(1, 2).empty());
}

TEST(ExactCoverage, ATileTouchedInItsCornerOnlyIsCoveredAndOneAHairAwayIsNot) {  // COV1
  for (const auto& [shift, covered] : {std::pair{0.0, 4u}, {1.0 / 64, 3u}}) {
    const TileCoverage c =
        cover(segment_between({{{48 + shift, 16}, {16 + shift, 48}, {48 + shift, 16}, {16 + shift, 48}}}),
              methods(CoverageMethod::kExact, false, 1));
    EXPECT_EQ(c.covered, covered);
    EXPECT_EQ(c.at(0, 0).empty(), shift > 0);
  }
}

TEST(ExactCoverage, BoundsThatEndOnATilesEdgeBelongToBothTiles) {
  const TileCoverage c =
      cover(segment_between({{{32, 8}, {40, 20}, {32, 20}, {36, 9}}}), methods(CoverageMethod::kExact, true, 4));
  EXPECT_EQ(c.tiles, (IntRect{0, 0, 2, 1}));
  EXPECT_EQ(c.covered, 2u);
}

TEST(ExactCoverage, BodiesThatCrossTheNearPlaneAndNaNKeepTheRectangleAndAllTimes) {  // COV3
  MovingBody crossing = segment_between({{{1, 2}, {126, 127}, {1, 2}, {126, 127}}});
  crossing.bounds.crosses_near = true;
  MovingBody odd = crossing;
  odd.bounds.crosses_near = false;
  odd.corners[3].w = std::numeric_limits<double>::quiet_NaN();
  MovingBody behind = odd;
  behind.corners[3].w = 0;
  for (const MovingBody& s : {crossing, odd, behind}) {
    const TileCoverage c = cover(s, methods(CoverageMethod::kExact, true, 5));
    EXPECT_EQ(c.covered, 16u);
    for (const TimeInterval& times : c.times) EXPECT_EQ(times, TimeInterval{});
  }
}

TEST(TimeIntervals, AreTightForMotionAlongOneAxis) {
  // A dot that crosses the four tiles of a row at constant speed: each for a quarter of the shutter.
  const MovingBody dot = segment_between({{{0, 10}, {0, 10}, {128, 10}, {128, 10}}});
  const TileCoverage intervals = cover(dot, methods(CoverageMethod::kRectangle, true, 1)),
                     segments = cover(dot, methods(CoverageMethod::kRectangle, false, 8));
  for (int column = 0; column < 4; ++column) {
    EXPECT_NEAR(intervals.at(column, 0).first, 64 * column, 2);
    EXPECT_NEAR(intervals.at(column, 0).last, 64 * column + 64, 2);
    // Segments of 32 codes; the ends of those before and behind lie on the tile's edges.
    EXPECT_EQ(segments.at(column, 0), (TimeInterval{std::max(0, 64 * column - 32), std::min(255, 64 * column + 95)}));
  }
}

TEST(TimeIntervals, ATileThatIsTouchedAtNoTimeIsDropped) {
  // A wide, flat box shoots down and to the right: its rectangle over the shutter covers the upper right and lower
  // left.
  const MovingBody s = segment_between({{{2, 2}, {20, 3}, {106, 120}, {124, 121}}});
  for (const auto& gpu :
       {methods(CoverageMethod::kRectangle, true, 1), methods(CoverageMethod::kRectangle, false, 16)}) {
    const TileCoverage c = cover(s, gpu);
    EXPECT_TRUE(c.at(3, 0).empty());
    EXPECT_TRUE(c.at(0, 3).empty());
    EXPECT_EQ(c.covered + c.dropped_time, 16u);
    EXPECT_GE(c.dropped_time, 6u);
  }
}

TEST(TimeIntervals, StillBoxesHaveAllTimes) {
  const MovingBody still = segment_between({{{1, 2}, {126, 127}, {1, 2}, {126, 127}}});
  for (const bool moving : {false, true})
    for (const TimeInterval& times : cover(still, methods(CoverageMethod::kRectangle, true, 16), moving).times)
      EXPECT_EQ(times, TimeInterval{});
}

TEST(TimeSegments, AsManyAsTheCentreTravelsItsOwnSideButAtLeastATile) {
  const TileGrid grid(128, 128, 32, 32);
  // Blur 100 pixels; a dot counts as a tile of 32, a line of 60 as itself.
  EXPECT_EQ(TimeSegments::chosen_count(segment_between({{{0, 0}, {0, 0}, {100, 0}, {100, 0}}}), grid), 4);
  EXPECT_EQ(TimeSegments::chosen_count(segment_between({{{0, 0}, {0, 60}, {100, 0}, {100, 60}}}), grid), 2);
  EXPECT_EQ(TimeSegments::chosen_count(segment_between({{{0, 0}, {0, 60}, {0, 0}, {0, 60}}}), grid), 1);
  EXPECT_EQ(TimeSegments::chosen_count(segment_between({{{0, 0}, {0, 0}, {1e5, 0}, {1e5, 0}}}), grid), 16);
}

TEST(TimeSegments, TheBoxAtATimeHoldsEveryPairOfCornersAndNoMore) {
  Random random(5);
  for (int trial = 0; trial < 500; ++trial) {
    MovingCorners corners;
    for (DVec4& c : corners) c = {draw(random, -900, 900), draw(random, -900, 900), 1, draw(random, 0.2, 9)};
    const double t = trial % 5 / 4.0;
    ScreenBox expected{1e9, 1e9, -1e9, -1e9};
    for (std::size_t i = 0; i < 8; ++i)
      for (std::size_t j = 8; j < 16; ++j) {
        const DVec4 r = corners[i] * (1 - t) + corners[j] * t;
        expected = {std::min(expected.x0, r.x / r.w), std::min(expected.y0, r.y / r.w),
                    std::max(expected.x1, r.x / r.w), std::max(expected.y1, r.y / r.w)};
      }
    const ScreenBox box = screen_box_at(corners, t);
    EXPECT_NEAR(box.x0, expected.x0, 1e-8);
    EXPECT_NEAR(box.y0, expected.y0, 1e-8);
    EXPECT_NEAR(box.x1, expected.x1, 1e-8);
    EXPECT_NEAR(box.y1, expected.y1, 1e-8);
  }
}

}  // namespace
}  // namespace tessera::binner::coverage_test

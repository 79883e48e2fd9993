// The motion BVH of a sub-patch: frusta of rectangles, branch nodes, rays.
#include "tilecore/visibility/motion_bvh.h"
#include "tests/support/tests.h"
#include "tests/tilecore/visibility/method_mesh.h"

namespace tessera::tilecore::motion_bvh_test {
namespace {

// ---- Frustum against moving boxes -------------------------------------------------------------------------------

struct FrustumCase {
  RaySpace space;
  IntRect pixels;
  MotionBox box;
};

// A box near a rectangle of pixels, moving; slowly now and then, which is where solving for the crossing is hard.
FrustumCase random_case(Random& random, bool lens, bool orthographic) {
  FrustumCase c;
  c.space = {16,
             16,
             orthographic,
             true,
             lens ? static_cast<double>(random.uniform(0, 1)) : 0.0,
             lens ? static_cast<double>(random.uniform(0.5f, 10)) : 0.0};
  c.pixels.x0 = random.integer(0, 28);
  c.pixels.y0 = random.integer(0, 28);
  c.pixels.x1 = c.pixels.x0 + 4;
  c.pixels.y1 = c.pixels.y0 + 4;
  const float z = random.uniform(0.8f, 4), speed = std::pow(2.0f, random.uniform(-20, 5));
  const float scale = orthographic ? 1.0f : z;
  c.box.low[0] = {scale * (static_cast<float>(c.pixels.x0) - 16 + random.uniform(-10, 10)),
                  scale * (static_cast<float>(c.pixels.y0) - 16 + random.uniform(-10, 10)), z};
  c.box.high[0] = {c.box.low[0][0] + random.uniform(0, 4) * scale, c.box.low[0][1] + random.uniform(0, 4) * scale,
                   z + random.uniform(0, 0.5f)};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float way = axis == 2 ? random.uniform(-0.3f, 0.3f) : scale * random.uniform(-speed, speed),
                growth = random.coin() ? 0.0f : 0.1f * std::abs(way);
    c.box.low[1][axis] = c.box.low[0][axis] + way - growth;
    c.box.high[1][axis] = c.box.high[0][axis] + way + growth;
  }
  return c;
}

// Times at which rays of the rectangle meet the box, found by drawing points of the box and looking back from them.
std::vector<double> touching_times_by_sampling(Random& random, const FrustumCase& c, int draws) {
  std::vector<double> times;
  for (int k = 0; k < draws; ++k) {
    const double t = static_cast<double>(random.integer(0, 256)) / 256;
    std::array<double, 3> p;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto at = [&](const auto& bound) {
        return (1 - t) * static_cast<double>(bound[0][axis]) + t * static_cast<double>(bound[1][axis]);
      };
      // Faces matter most.
      const double along =
          random.coin() ? static_cast<double>(random.integer(0, 1)) : static_cast<double>(random.uniform(0, 1));
      p[axis] = at(c.box.low) + along * (at(c.box.high) - at(c.box.low));
    }
    std::array<double, 2> lens = {0, 0};
    if (c.space.lens_radius > 0) {
      const double angle = static_cast<double>(random.uniform(0, 6.2831853f)),
                   radius = c.space.lens_radius * (random.coin() ? 1.0 : static_cast<double>(random.uniform(0, 1)));
      lens = {radius * std::cos(angle), radius * std::sin(angle)};
    }
    // The sample from which the point is seen through that lens point.
    const auto sample = [&](std::size_t axis, double center) {
      const double w = c.space.orthographic ? 1.0 : p[2];
      return center + (p[axis] - lens[axis] * (1 - p[2] * c.space.inverse_focus)) / w;
    };
    const double x = sample(0, c.space.center_x), y = sample(1, c.space.center_y);
    if (x >= c.pixels.x0 && x <= c.pixels.x1 && y >= c.pixels.y0 && y <= c.pixels.y1) times.push_back(t);
  }
  return times;
}

struct FrustumResult {
  int touching = 0, wrongly_outside = 0, missed = 0;
  double tightness = 0;
  int measured = 0;
};

FrustumResult run_frusta(std::uint32_t seed, bool forget_lens) {
  Random random(seed);
  FrustumResult result;
  for (int trial = 0; trial < 4000; ++trial)
    for (const bool lens : {false, true})
      for (const bool orthographic : {false, true}) {
        const FrustumCase c = random_case(random, lens, orthographic);
        RaySpace space = c.space;
        if (forget_lens) space.lens_radius = 0;
        const BundleFrustum frustum(space, c.pixels, 0.1f, 100);
        const std::vector<double> seen = touching_times_by_sampling(random, c, 60);
        if (seen.empty()) continue;
        ++result.touching;
        result.wrongly_outside += frustum.outside(c.box) ? 1 : 0;
        const BundleFrustum::Times times = frustum.times(c.box);
        for (const double t : seen)
          result.missed += t < static_cast<double>(times.low) || t > static_cast<double>(times.high) ? 1 : 0;
        const auto [low, high] = std::minmax_element(seen.begin(), seen.end());
        if (lens || times.empty() || times.high == times.low) continue;
        const double tightness = (*high - *low) / static_cast<double>(times.high - times.low);
        EXPECT_LE(tightness, 1.0);
        result.tightness += tightness;
        ++result.measured;
      }
  return result;
}

TEST(BundleFrustum, NeverDropsABoxNorATimeAtWhichARayMeetsIt) {
  const FrustumResult result = run_frusta(1, false);
  EXPECT_GT(result.touching, 3000);
  EXPECT_EQ(result.wrongly_outside, 0);  // BF1
  EXPECT_EQ(result.missed, 0);           // BF2
}

TEST(BundleFrustum, ReportsLittleMoreTimeThanTheBoxTouches) {
  const FrustumResult result = run_frusta(2, false);
  // Even the sampled part of the exact interval, which is shorter than the whole.
  EXPECT_GT(result.tightness / result.measured, 0.7);
}

TEST(BundleFrustum, OnePlanePerSideThroughTheMiddleOfTheLensIsCaught) {
  const FrustumResult result = run_frusta(1, true);
  EXPECT_GT(result.wrongly_outside, 100);
  EXPECT_GT(result.missed, 100);
}

TEST(BundleFrustum, ANaiveSolveInSinglePrecisionIsCaught) {
  Random random(3);
  int naive_missed = 0, missed = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    FrustumCase c = random_case(random, false, false);
    // A slow box whose right side starts a little left of the rectangle.
    const float z = c.box.low[0][2], slope = static_cast<float>(c.pixels.x0) - 16,
                way = std::pow(2.0f, random.uniform(-20, -3));
    c.box.high[0] = {slope * z - random.uniform(0, 1) * way, c.box.low[0][1] + 50, z};
    c.box.high[1] = {c.box.high[0][0] + way, c.box.high[0][1], z};
    c.box.low[0] = {c.box.high[0][0] - 1, c.box.low[0][1] - 50, z};
    c.box.low[1] = {c.box.high[1][0] - 1, c.box.low[0][1], z};
    // Exactly: the side is at slope z.
    const double d0 = static_cast<double>(slope) * static_cast<double>(z) - static_cast<double>(c.box.high[0][0]),
                 d1 = static_cast<double>(slope) * static_cast<double>(z) - static_cast<double>(c.box.high[1][0]);
    if (!(d0 > 0 && d1 < 0)) continue;
    const double exact = d0 / (d0 - d1);
    const BundleFrustum::Times times = BundleFrustum(c.space, c.pixels, 0.1f, 100).times(c.box);
    missed += times.empty() || static_cast<double>(times.low) > exact ? 1 : 0;
    const float n0 = slope * z - c.box.high[0][0], n1 = slope * z - c.box.high[1][0];
    naive_missed += n0 > 0 && n1 < 0 && static_cast<double>(n0 / (n0 - n1)) > exact ? 1 : 0;
  }
  EXPECT_EQ(missed, 0);
  EXPECT_GT(naive_missed, 1000);
}

TEST(BundleFrustum, DropsTheDepthPlanesOnlyWhenNothingCrossesThem) {
  const RaySpace space{16, 16, false, true, 0, 0};
  MotionBox box;
  box.low = {{{-1, -1, 1}, {-1, -1, 5}}};
  box.high = {{{1, 1, 2}, {1, 1, 6}}};
  BundleFrustum frustum(space, {0, 0, 32, 32}, 0.5f, 3);
  frustum.drop_depth_planes(box);
  // Leaves the far plane at 3 at t = 1/2.
  EXPECT_NEAR(static_cast<double>(frustum.times(box).high), 0.5, 1e-5);
  box.low[1][2] = box.low[0][2] = 4;
  box.high[1][2] = box.high[0][2] = 5;
  EXPECT_TRUE(frustum.outside(box));
  // A box that starts right at the plane may still tie with a surface that is seen there.
  box.low[1][2] = box.low[0][2] = 3;
  EXPECT_FALSE(frustum.outside(box));
}

// ---- Tree -------------------------------------------------------------------------------------------------------

struct Tree {
  MethodMesh mesh;
  RaySpace space;
  MotionBvh bvh;

  explicit Tree(MethodMesh m) : mesh(std::move(m)) {
    const IntRect& tile = mesh.samples.pixels;
    space = {0.5 * (tile.x0 + tile.x1),
             0.5 * (tile.y0 + tile.y1),
             mesh.settings.orthographic,
             mesh.effects.motion,
             static_cast<double>(mesh.settings.inverse_focus),
             mesh.effects.lens ? static_cast<double>(mesh.lens_radius) : 0.0};
    bvh.build(mesh.mesh, mesh.leaf_columns, mesh.effects, space);
  }
};

bool holds(const MotionBox& outer, const MotionBox& inner) {
  if (inner.is_empty()) return true;
  for (std::size_t key = 0; key < 2; ++key)
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (inner.low[key][axis] < outer.low[key][axis] || inner.high[key][axis] > outer.high[key][axis]) return false;
  return true;
}

bool is_under(std::uint32_t node, std::uint32_t ancestor) {
  while (node > ancestor) node /= 2;
  return node == ancestor;
}

TEST(MotionBvh, EveryNodeHoldsItsChildrenAndEveryCellIsInTheTreeOnce) {
  Random random(4);
  for (int trial = 0; trial < 20; ++trial) {
    const Tree tree(random_mesh(random, {{true, trial % 3 == 0}, trial % 4 == 0, trial % 2 == 0}));
    std::multiset<std::uint32_t> cells, expected;
    for (std::uint32_t n = 1; n < 2 * tree.bvh.leaf_count(); ++n) {
      if (n < tree.bvh.leaf_count()) {
        EXPECT_TRUE(holds(tree.bvh.node(n), tree.bvh.node(2 * n)) &&
                    holds(tree.bvh.node(n), tree.bvh.node(2 * n + 1)));  // BVH1
      } else if (!tree.bvh.node(n).is_empty()) {
        cells.insert(tree.bvh.cell_of(n));
      }
    }
    tree.mesh.for_each_cell([&](std::size_t cell) { expected.insert(static_cast<std::uint32_t>(cell)); });
    EXPECT_EQ(cells, expected);
  }
}

TEST(MotionBvh, NeighboursInAGridAreNeighboursInTheTree) {
  // 8x8 cells of one pixel: each node above two leaves is 1x2 or 2x1 cells, the next 2x2, up to 8x8.
  MethodMesh m;
  m.effects = {true, false};
  m.resize(81);
  for (std::size_t v = 0; v < 81; ++v) m.place(v, static_cast<float>(v % 9), static_cast<float>(v / 9), 1);
  m.add_grid_cells(8);
  m.finish({0, 0, 16, 16}, 1);
  const Tree tree(std::move(m));
  ASSERT_EQ(tree.bvh.leaf_count(), 64u);
  for (std::uint32_t n = 1; n < 128; ++n) {
    const MotionBox& box = tree.bvh.node(n);
    const int below = 7 - static_cast<int>(std::bit_width(n));  // levels under this one
    EXPECT_NEAR(box.high[0][0] - box.low[0][0], std::pow(2.0, (below + 1) / 2), 1e-3) << n;
    EXPECT_NEAR(box.high[0][1] - box.low[0][1], std::pow(2.0, below / 2), 1e-3) << n;
  }
}

TEST(MotionBvh, NoLeafThatARayHitsIsOutsideTheBranchNode) {
  Random random(5);
  int hits = 0, below = 0;
  for (int trial = 0; trial < 40; ++trial) {
    Tree tree(random_mesh(random, {{true, trial % 2 == 0}, trial % 4 > 1, trial % 5 == 0}));
    const MethodMesh& m = tree.mesh;
    for (int y = 0; y < 16; y += 4)
      for (int x = 0; x < 24; x += 4) {
        const IntRect pixels{x, y, x + 4, y + 4};
        const BundleFrustum frustum(tree.space, pixels, m.settings.limits.near, std::numeric_limits<float>::infinity());
        const MotionBvh::Overlap fork = tree.bvh.traverse(frustum, MotionBvh::kRoot, BranchNode::kBothChildren);
        const MotionBvh::Overlap mask = tree.bvh.traverse(frustum, MotionBvh::kRoot, BranchNode::kLeafMask);
        const MotionBvh::Overlap root = tree.bvh.traverse(frustum, MotionBvh::kRoot, BranchNode::kRoot);
        EXPECT_EQ(root.branch, MotionBvh::kRoot);
        EXPECT_EQ(root.any, mask.any);
        if (mask.any) {
          EXPECT_TRUE(is_under(mask.branch, fork.branch));  // BVH3
          below += mask.branch > fork.branch ? 1 : 0;
        }
        std::vector<std::uint32_t> samples;
        all_samples(m.samples, pixels, samples);
        for (std::uint32_t leaf = tree.bvh.first_leaf(); leaf < 2 * tree.bvh.leaf_count(); ++leaf) {
          if (tree.bvh.node(leaf).is_empty()) continue;
          HitSet sink;
          VisibilityWork work;
          test_cell_samples(m.mesh, tree.bvh.cell_of(leaf), samples, m.samples, m.effects, m.settings, sink, work);
          sink.flush();
          for (const HitSet::Key& hit : sink.hits) {
            ++hits;
            ASSERT_TRUE(mask.any);
            EXPECT_TRUE(is_under(leaf, mask.branch)) << leaf << " " << mask.branch;  // BVH2
            EXPECT_TRUE(is_under(leaf, fork.branch));
            const int s = m.samples.stencil(std::get<0>(hit));
            EXPECT_TRUE(s >= mask.stencils.first && s <= mask.stencils.last);
            tree.bvh.traverse(frustum, MotionBvh::kRoot, BranchNode::kLeafMask);
            const MotionBvh::Overlap part = tree.bvh.within({s & ~31, s | 31});
            EXPECT_TRUE(part.any && is_under(leaf, part.branch) && is_under(part.branch, mask.branch));  // BVH4
            EXPECT_TRUE(s >= part.stencils.first && s <= part.stencils.last);
          }
        }
      }
  }
  EXPECT_GT(hits, 5000);
  EXPECT_GT(below, 10);
}

TEST(MotionBvh, RaysSideBySideVisitTheNodesThatEachVisitsAlone) {
  Random random(6);
  Tree tree(random_mesh(random, {{true, true}}));
  std::vector<MotionBvh::Ray> rays;
  for (std::uint32_t s = 0; s < tree.mesh.samples.count; s += 3)
    rays.push_back(tree.bvh.ray(tree.mesh.samples, s, 1e30f));
  std::set<std::pair<std::uint32_t, std::uint32_t>> together, alone;
  const auto collect = [](auto& pairs) {
    return [&](const MotionBvh::CellRays& leaf) {
      for (const std::uint32_t s : leaf.samples) pairs.emplace(leaf.cell, s);
    };
  };
  tree.bvh.take_counters();
  tree.bvh.trace(rays, MotionBvh::kRoot, collect(together));
  const std::uint64_t visits = tree.bvh.take_counters().node_visits;
  for (const MotionBvh::Ray& ray : rays) tree.bvh.trace(std::span(&ray, 1), MotionBvh::kRoot, collect(alone));
  EXPECT_EQ(together, alone);
  EXPECT_EQ(tree.bvh.take_counters().node_visits, visits);
  EXPECT_GT(together.size(), 100u);
}

// Samples that the inside test finds and rays do not reach the cell of.
int unreached(std::uint32_t seed, bool freeze) {
  Random random(seed);
  int lost = 0;
  for (int trial = 0; trial < 30; ++trial) {
    Tree tree(random_mesh(random, {{true, trial % 2 == 0}, trial % 4 > 1}));
    const MethodMesh& m = tree.mesh;
    std::vector<MotionBvh::Ray> rays;
    for (std::uint32_t s = 0; s < m.samples.count; ++s) {
      rays.push_back(tree.bvh.ray(m.samples, s, 1e30f));
      if (freeze)
        rays.back().a = {rays.back().a[0] + rays.back().b[0], rays.back().a[1] + rays.back().b[1]},
        rays.back().b = {0, 0};
    }
    std::set<std::pair<std::uint32_t, std::uint32_t>> reached;
    tree.bvh.trace(rays, MotionBvh::kRoot, [&](const MotionBvh::CellRays& leaf) {
      for (const std::uint32_t s : leaf.samples) reached.emplace(leaf.cell, s);
    });
    std::vector<std::uint32_t> samples;
    all_samples(m.samples, m.samples.pixels, samples);
    m.for_each_cell([&](std::size_t cell) {
      HitSet sink;
      VisibilityWork work;
      test_cell_samples(m.mesh, cell, samples, m.samples, m.effects, m.settings, sink, work);
      sink.flush();
      for (const HitSet::Key& hit : sink.hits)
        lost += reached.contains({static_cast<std::uint32_t>(cell), std::get<0>(hit)}) ? 0 : 1;
    });
  }
  return lost;
}

TEST(MotionBvh, ARayReachesEveryCellThatTheInsideTestFinds) { EXPECT_EQ(unreached(7, false), 0); }  // BVH2

TEST(MotionBvh, RaysThroughBoxesOfShutterOpenOnlyAreCaught) { EXPECT_GT(unreached(7, true), 100); }

TEST(MotionBvh, RaysParallelToASlabMeetTheBoxesThatTheyAreInside) {
  // The sample in the middle of the tile: both directions are zero.
  for (const bool orthographic : {false, true}) {
    MethodMesh m;
    m.effects = {true, false};
    m.settings.orthographic = orthographic;
    m.resize(4);
    m.place(0, 2, 2, 2);
    m.place(1, 6, 2, 2);
    m.place(2, 6, 6, 2);
    m.place(3, 2, 6, 2);
    for (std::size_t v = 0; v < 4; ++v) m.move(v, 0.5f, 0, 3);
    m.mesh.begin_leaf();
    m.mesh.add_cell({0, 1, 2, 3}, 0);
    m.finish({0, 0, 8, 8}, 1);
    m.samples.x[0] = m.samples.y[0] = 4.0f;
    m.samples.x[1] = 1.0f;  // parallel to one slab, outside the other
    m.samples.y[1] = 4.0f;
    Tree tree(std::move(m));
    const std::vector<MotionBvh::Ray> rays = {tree.bvh.ray(tree.mesh.samples, 0, 1e30f),
                                              tree.bvh.ray(tree.mesh.samples, 1, 1e30f)};
    std::vector<std::uint32_t> met;
    tree.bvh.trace(rays, MotionBvh::kRoot, [&](const MotionBvh::CellRays& leaf) {
      met.insert(met.end(), leaf.samples.begin(), leaf.samples.end());
    });
    EXPECT_EQ(met, std::vector<std::uint32_t>{0});
    for (const double v : {rays[0].a[0], rays[0].b[0], rays[0].c[0]}) EXPECT_TRUE(std::isfinite(v));
  }
}

}  // namespace
}  // namespace tessera::tilecore::motion_bvh_test

#include "scene/tessellation_pattern.h"
#include "tests/support/tests.h"

namespace tessera::scene::tessellation_pattern_test {
namespace {

TEST(TessellationPattern, EdgeVerticesAreMonotoneAndReachEveryVertexOfTheCoarserEdge) {
  for (int n = 1; n <= 64; ++n)
    for (int factor = 1; factor <= n; ++factor) {
      std::set<int> reached;
      int last = -1;
      for (int i = 0; i <= n; ++i) {
        const int k = TessellationPattern::edge_vertex(i, n, factor);
        EXPECT_GE(k, last);
        EXPECT_LE(k - last, 1) << "a coarse vertex is skipped";
        last = k;
        reached.insert(k);
      }
      EXPECT_EQ(reached.size(), static_cast<std::size_t>(factor) + 1);
      EXPECT_EQ(TessellationPattern::edge_vertex(0, n, factor), 0);
      EXPECT_EQ(last, factor);
    }
}

TessellationPattern random_pattern(Random& random) {
  TessellationPattern p;
  p.nu = static_cast<std::uint8_t>(random.integer(1, 64));
  p.nv = static_cast<std::uint8_t>(random.integer(1, 64));
  for (std::size_t e = 0; e < 4; ++e) p.edge[e] = static_cast<std::uint8_t>(random.integer(1, e < 2 ? p.nu : p.nv));
  return p;
}

TEST(TessellationPattern, TwoGridsThatShareAnEdgeFactorHaveTheSameEdgeParameters) {
  Random random(1);
  for (int trial = 0; trial < 300; ++trial) {
    TessellationPattern a = random_pattern(random), b = random_pattern(random);
    const int factor = random.integer(1, std::min(a.nu, b.nu));
    a.edge[0] = b.edge[1] = static_cast<std::uint8_t>(factor);
    std::set<float> on_a, on_b;
    for (int i = 0; i <= a.nu; ++i) on_a.insert(a.u(i, 0));
    for (int i = 0; i <= b.nu; ++i) on_b.insert(b.u(i, b.nv));
    EXPECT_EQ(on_a, on_b);
  }
}

TEST(TessellationPattern, EveryPlaceIsOnTheTriangleThatIsFoundForIt) {
  Random random(7);
  for (int trial = 0; trial < 20000; ++trial) {
    const TessellationPattern p = random_pattern(random);
    // Corners, edges and places at grid lines among them.
    const auto parameter = [&](int n) {
      const int kind = random.integer(0, 3);
      return kind == 0 ? static_cast<float>(random.integer(0, n)) / static_cast<float>(n) : random.uniform(0.0f, 1.0f);
    };
    const float u = parameter(p.nu), v = parameter(p.nv);
    const GridPoint at = triangle_at(p, u, v);
    ASSERT_LT(at.triangle, 2u * p.nu * p.nv);
    ASSERT_TRUE(at.b1 >= 0 && at.b2 >= 0 && at.b1 + at.b2 <= 1) << at.b1 << " " << at.b2;
    const int cell = static_cast<int>(at.triangle / 2), i = cell % p.nu, j = cell / p.nu;
    const bool first = at.triangle % 2 == 0;
    const auto mix = [&](auto of) {
      const float a = of(i, j), b = first ? of(i + 1, j) : of(i + 1, j + 1),
                  c = first ? of(i + 1, j + 1) : of(i, j + 1);
      return a + at.b1 * (b - a) + at.b2 * (c - a);
    };
    ASSERT_NEAR(mix([&](int a, int b) { return p.u(a, b); }), u, 2e-6f) << int{p.nu} << "x" << int{p.nv};
    ASSERT_NEAR(mix([&](int a, int b) { return p.v(a, b); }), v, 2e-6f);
  }
}

TEST(TessellationPattern, ParameterRangeHoldsEveryVertexOfTheRange) {
  Random random(2);
  for (int trial = 0; trial < 2000; ++trial) {
    const TessellationPattern p = random_pattern(random);
    CellRange r;
    r.i0 = static_cast<std::uint8_t>(random.integer(0, p.nu - 1));
    r.i1 = static_cast<std::uint8_t>(random.integer(r.i0 + 1, p.nu));
    r.j0 = static_cast<std::uint8_t>(random.integer(0, p.nv - 1));
    r.j1 = static_cast<std::uint8_t>(random.integer(r.j0 + 1, p.nv));
    const ParameterRange range = parameter_range(p, r);
    for (int j = r.j0; j <= r.j1; ++j)
      for (int i = r.i0; i <= r.i1; ++i) {
        ASSERT_TRUE(p.u(i, j) >= range.u0 && p.u(i, j) <= range.u1) << i << " " << j;
        ASSERT_TRUE(p.v(i, j) >= range.v0 && p.v(i, j) <= range.v1) << i << " " << j;
      }
  }
}

TEST(TessellationPattern, TheRangeWithoutMovedEdgeVerticesWouldMissSome) {
  // The failing twin: cells [i0/n, i1/n] alone do not hold a stitched edge's vertices.
  TessellationPattern p;
  p.nu = p.nv = 8;
  p.edge = {3, 8, 8, 8};
  const float naive = 1.0f / 8.0f;
  EXPECT_LT(parameter_range(p, {1, 0, 2, 1}).u0, naive);
}

std::array<std::array<Vec4, 4>, 2> random_curve(Random& random) {
  std::array<std::array<Vec4, 4>, 2> curve;
  for (auto& key : curve)
    for (auto& p : key) {
      const float w = random.uniform(0.1f, 4);
      p = Vec4(random.uniform(-500, 500) * w, random.uniform(-500, 500) * w, w, w);
    }
  return curve;
}

TEST(CurveFactor, IsTheSameForTheReversedCurve) {
  Random random(3);
  for (int trial = 0; trial < 2000; ++trial) {
    auto curve = random_curve(random), reversed = curve;
    for (auto& key : reversed) std::reverse(key.begin(), key.end());
    EXPECT_EQ(curve_factor(curve, 0.1f, {}, 64), curve_factor(reversed, 0.1f, {}, 64));
  }
}

TEST(CurveFactor, IsTheLengthOverTheTargetWithinItsLimits) {
  std::array<std::array<Vec4, 4>, 2> curve;
  for (auto& key : curve)
    for (std::size_t i = 0; i < 4; ++i) key[i] = Vec4(20.0f * static_cast<float>(i), 0, 1, 1);
  EXPECT_EQ(curve_factor(curve, 0.1f, {3.0}, 64), 20);
  EXPECT_EQ(curve_factor(curve, 0.1f, {0.25}, 64), 64);
  EXPECT_EQ(curve_factor(curve, 0.1f, {60.0}, 64), 1);
  for (auto& p : curve[1]) p.x *= 2;  // the longer key counts
  EXPECT_EQ(curve_factor(curve, 0.1f, {3.0}, 64), 40);
  curve[0][2].x = std::nanf("");
  EXPECT_GE(curve_factor(curve, 0.1f, {3.0}, 64), 1);
}

TEST(CurveFactor, PointsBehindTheCameraDoNotBreakIt) {
  Random random(4);
  for (int trial = 0; trial < 500; ++trial) {
    auto curve = random_curve(random);
    curve[0][1].w = -1;
    curve[1][3].w = 0;
    const int factor = curve_factor(curve, 0.1f, {}, 64);
    EXPECT_TRUE(factor >= 1 && factor <= 64);
  }
}

}  // namespace
}  // namespace tessera::scene::tessellation_pattern_test

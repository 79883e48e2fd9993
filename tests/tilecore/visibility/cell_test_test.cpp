#include "tilecore/visibility/cell_test.h"
#include "tests/support/tests.h"

namespace tessera::tilecore::cell_test_test {
namespace {

struct Point {
  float x, y;
};

Corner corner(Point p, Point sample) { return {p.x - sample.x, p.y - sample.y, 1.0f, 1.0f}; }

bool hits(Point a, Point b, Point c, Point sample, TriangleHit* out = nullptr) {
  TriangleHit hit;
  const bool inside = exact_triangle_test(corner(a, sample), corner(b, sample), corner(c, sample), false, hit);
  if (out != nullptr) *out = hit;
  return inside;
}

// Points of the sub-pixel grid, as projected vertices and samples are.
Point grid_point(Random& random, int reach) {
  return {static_cast<float>(random.integer(-reach, reach)) / 256.0f,
          static_cast<float>(random.integer(-reach, reach)) / 256.0f};
}

// Sign of the edge function in integers, with the same tie rule.
int integer_sign(Point a, Point b, Point s) {
  const auto f = [](float v) { return static_cast<std::int64_t>(v * 256.0f); };
  const std::int64_t ax = f(a.x) - f(s.x), ay = f(a.y) - f(s.y), bx = f(b.x) - f(s.x), by = f(b.y) - f(s.y);
  const std::int64_t e = ax * by - ay * bx;
  if (e != 0) return e > 0 ? 1 : -1;
  if (ay != by) return ay > by ? 1 : -1;
  return bx > ax ? 1 : bx < ax ? -1 : 0;
}

TEST(EdgeSign, EqualsExactFixedPointArithmetic) {
  Random random(1);
  for (int trial = 0; trial < 200000; ++trial) {
    const int reach = trial % 2 == 0 ? 40 : 1 << 21;  // many ties; up to 8192 pixels
    const Point a = grid_point(random, reach), b = grid_point(random, reach), s = grid_point(random, reach);
    ASSERT_EQ(exact_edge_sign(a.x - s.x, a.y - s.y, b.x - s.x, b.y - s.y), integer_sign(a, b, s));
  }
}

TEST(EdgeSign, IsOppositeForTheReversedEdge) {
  Random random(2);
  for (int trial = 0; trial < 100000; ++trial) {
    const float ax = random.uniform(-1, 1), ay = random.uniform(-1, 1);
    const float bx = random.coin() ? ax * 3 : random.uniform(-1, 1),
                by = random.coin() ? ay * 3 : random.uniform(-1, 1);
    ASSERT_EQ(exact_edge_sign(ax, ay, bx, by), -exact_edge_sign(bx, by, ax, ay));
  }
}

// How many triangles of a fan around a centre (a closed disc) hold a sample.
template <class Inside>
int fan_hits(const std::vector<Point>& rim, Point centre, Point sample, const Inside& inside) {
  int count = 0;
  for (std::size_t i = 0; i < rim.size(); ++i)
    count += inside(centre, rim[i], rim[(i + 1) % rim.size()], sample) ? 1 : 0;
  return count;
}

std::vector<Point> random_rim(Random& random, int corners) {
  std::vector<Point> rim;
  for (int i = 0; i < corners; ++i) {
    const double angle = 6.283185307 * i / corners;
    const double radius = static_cast<double>(random.uniform(1.0f, 2.0f));
    rim.push_back({std::round(static_cast<float>(radius * std::cos(angle)) * 256.0f) / 256.0f,
                   std::round(static_cast<float>(radius * std::sin(angle)) * 256.0f) / 256.0f});
  }
  return rim;
}

TEST(TriangleTest, EverySampleInsideAFanIsInExactlyOneOfItsTrianglesAlsoOnEdgesAndVertices) {
  Random random(3);
  for (int trial = 0; trial < 300; ++trial) {
    const std::vector<Point> rim = random_rim(random, random.integer(5, 12));
    const Point centre = grid_point(random, 60);
    const auto test = [](Point a, Point b, Point c, Point s) { return hits(a, b, c, s); };
    EXPECT_EQ(fan_hits(rim, centre, centre, test), 1);  // on the common vertex
    for (std::size_t i = 0; i < rim.size(); ++i) {
      // On an edge: a point that is exactly between two grid points.
      const Point on{(centre.x + rim[i].x) * 0.5f, (centre.y + rim[i].y) * 0.5f};
      EXPECT_EQ(fan_hits(rim, centre, on, test), 1);
    }
    for (int k = 0; k < 50; ++k) EXPECT_EQ(fan_hits(rim, centre, grid_point(random, 110), test), 1);
  }
}

TEST(TriangleTest, ANaiveClosedTestCountsSharedEdgesTwiceAndIsCaught) {
  Random random(4);
  int doubled = 0;
  for (int trial = 0; trial < 100; ++trial) {
    const std::vector<Point> rim = random_rim(random, 8);
    const Point centre = grid_point(random, 60);
    const auto naive = [](Point a, Point b, Point c, Point s) {
      const auto e = [&](Point p, Point q) { return (p.x - s.x) * (q.y - s.y) - (p.y - s.y) * (q.x - s.x); };
      return e(a, b) >= 0 && e(b, c) >= 0 && e(c, a) >= 0;
    };
    doubled += fan_hits(rim, centre, centre, naive) > 1 ? 1 : 0;
  }
  EXPECT_GT(doubled, 0);
}

TEST(TriangleTest, DegenerateTrianglesHoldNothing) {
  Random random(5);
  for (int trial = 0; trial < 20000; ++trial) {
    const Point a = grid_point(random, 300), b = grid_point(random, 300);
    const float s = static_cast<float>(random.integer(-2, 3));
    const Point c{a.x + (b.x - a.x) * s, a.y + (b.y - a.y) * s};  // on the line
    const Point on{a.x + (b.x - a.x) * 0.5f, a.y + (b.y - a.y) * 0.5f};
    EXPECT_FALSE(hits(a, b, c, on));
    EXPECT_FALSE(hits(a, b, c, grid_point(random, 300)));
    EXPECT_FALSE(hits(a, a, b, on));
  }
}

TEST(TriangleTest, WeightsReproduceThePointAndFacingIsTheSignOfTheArea) {
  Random random(6);
  int tested = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const Point a = grid_point(random, 900), b = grid_point(random, 900), c = grid_point(random, 900),
                s = grid_point(random, 500);
    TriangleHit hit;
    if (!hits(a, b, c, s, &hit)) continue;
    ++tested;
    const float b0 = 1 - hit.b1 - hit.b2;
    EXPECT_NEAR(a.x * b0 + b.x * hit.b1 + c.x * hit.b2, s.x, 1e-4f);
    EXPECT_NEAR(a.y * b0 + b.y * hit.b1 + c.y * hit.b2, s.y, 1e-4f);
    const float area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    EXPECT_EQ(hit.positive, area > 0);
  }
  EXPECT_GT(tested, 1000);
}

TEST(TriangleTest, DepthIsPerspectiveCorrect) {
  // A plane z = 2 + x seen in perspective: 1/z is linear on screen.
  const auto vertex = [](float x, float y) {
    const float z = 2 + x;
    return Corner{x / z, y / z, 1 / z, z};
  };
  Corner a = vertex(-1, -1), b = vertex(3, -1), c = vertex(0, 2);
  const float sx = 0.1f, sy = 0.05f;
  for (Corner* k : {&a, &b, &c}) k->x -= sx, k->y -= sy;
  TriangleHit hit;
  ASSERT_TRUE(exact_triangle_test(a, b, c, false, hit));
  // x/z = sx and z = 2 + x give z = 2 / (1 - sx).
  EXPECT_NEAR(hit.z, 2 / (1 - sx), 1e-5f);
  ASSERT_TRUE(exact_triangle_test(a, b, c, true, hit));
  EXPECT_NEAR(hit.z, 2 / (1 - sx), 1e-5f);
}

}  // namespace
}  // namespace tessera::tilecore::cell_test_test

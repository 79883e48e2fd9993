// Procedures: shapes against independent formulas, tangents against differences, closure bit by bit.
#include "shaders_cpp/procedures/procedures.h"
#include "shaders_cpp/procedures/operation_count.h"
#include "tests/support/procedures.h"
#include "tests/support/tests.h"

namespace tessera::shaders::procedures_test {
namespace {

constexpr double kTurn = 6.283185307179586;

bool same_bits(const Vector3<float>& a, const Vector3<float>& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

TEST(Turns, SeriesAgreesWithTheLibrary) {
  for (int k = -4000; k <= 4000; ++k) {
    const float turns = static_cast<float>(k) / 997.0f;
    float s, c;
    real_sincos_turns(turns, s, c);
    EXPECT_NEAR(static_cast<double>(s), std::sin(kTurn * static_cast<double>(turns)), 0x1p-22);
    EXPECT_NEAR(static_cast<double>(c), std::cos(kTurn * static_cast<double>(turns)), 0x1p-22);
  }
}

TEST(Turns, QuartersAreExact) {
  for (int k = -8; k <= 8; ++k) {
    float s, c;
    real_sincos_turns(static_cast<float>(k) * 0.25f, s, c);
    EXPECT_EQ(s, std::round(std::sin(kTurn * k / 4)));
    EXPECT_EQ(c, std::round(std::cos(kTurn * k / 4)));
  }
}

TEST(Powers, SeriesAgreesWithTheLibrary) {
  for (int k = -3000; k <= 3000; ++k) {
    const float x = static_cast<float>(k) / 31.0f;
    EXPECT_NEAR(static_cast<double>(exp2_by_series(x)) / std::exp2(static_cast<double>(x)), 1.0, 0x1p-20);
  }
}

TEST(Shapes, TangentsFollowTheSurface) {
  Random random(1);
  for (int trial = 0; trial < 5000; ++trial) {
    const auto id = static_cast<ShapeId>(trial % test::kShapeCount);
    const ShapeInput in = test::random_shape(random, id);
    // Inside one cell of the geometry image and of every octave's lattice, nearly always.
    const double u = static_cast<double>(random.uniform(0.02f, 0.98f)),
                 v = static_cast<double>(random.uniform(0.02f, 0.98f)), h = 1e-6;
    with_shape(id, [&](auto shape) {
      using Shape = decltype(shape);
      const ShapePoint<double> p = shape_tangents<Shape>(in, u, v);
      const auto along = [&](double du, double dv) {
        return (Shape::point(in, u + du, v + dv) - Shape::point(in, u - du, v - dv)) * (0.5 / h);
      };
      const Vector3<double> by_u = along(h, 0), by_v = along(0, h), eu = by_u - p.by_u, ev = by_v - p.by_v;
      const double size = 1 + std::sqrt(dot(p.by_u, p.by_u)) + std::sqrt(dot(p.by_v, p.by_v));
      if (id == ShapeId::kSweptCubic && size > 100) return;  // near a cusp of the path
      if (id == ShapeId::kGeometryImageMesh) {
        const double fu = u * 8 - std::floor(u * 8), fv = v * 8 - std::floor(v * 8);
        if (fu < 1e-4 || fu > 1 - 1e-4 || fv < 1e-4 || fv > 1 - 1e-4) return;  // a kink
      }
      EXPECT_LT(std::sqrt(dot(eu, eu)) + std::sqrt(dot(ev, ev)), 2e-4 * size) << Shape::kName;
    });
  }
}

// The derivative in the form of the published architecture, whose weights put control point 0 at u = 1:
// 3 (x0 - 3 x1 + 3 x2 - x3) u^2 + 6 (x1 - 2 x2 + x3) u + 3 (x2 - x3).
TEST(SweptCubic, SlopeIsThePublishedPolynomialWithItsSignsPutRight) {
  Random random(2);
  for (int trial = 0; trial < 1000; ++trial) {
    float c[8];
    for (float& x : c) x = random.uniform(-2, 2);
    const double u = static_cast<double>(random.uniform(0, 1));
    const auto published = [&](std::size_t k) {
      // Control points in the other order: x0 is where u = 1.
      const auto x0 = static_cast<double>(c[6 + k]), x1 = static_cast<double>(c[4 + k]),
                 x2 = static_cast<double>(c[2 + k]), x3 = static_cast<double>(c[k]);
      return 3 * (x0 - 3 * x1 + 3 * x2 - x3) * u * u + 6 * (x1 - 2 * x2 + x3) * u + 3 * (x2 - x3);
    };
    const PlanePoint<double> slope = plane_cubic_slope(c, u);
    EXPECT_NEAR(slope.a, published(0), 1e-5);
    EXPECT_NEAR(slope.b, published(1), 1e-5);
  }
}

TEST(SweptCubic, KeepsTheProfilesDistanceFromItsPath) {
  // A circular profile of radius r about a curved path: every point lies r from the path, seen in the plane of the
  // profile.
  constexpr float kArc = 0.5522847498f, kRadius = 0.2f;
  ShapeInput in;
  in.p = {0, 0, 1, 0, 2, 1, 2, 2, kRadius, 0, kRadius, kRadius * kArc, kRadius * kArc, kRadius, 0, kRadius};
  for (int i = 0; i <= 20; ++i)
    for (int j = 0; j <= 20; ++j) {
      const double u = i / 20.0, v = j / 20.0;
      const PlanePoint<double> path = plane_cubic(in.p.data(), u), slope = plane_cubic_slope(in.p.data(), u);
      const Vector3<double> p = SweptCubic::point(in, u, v);
      const double dx = p.x - path.a, dz = p.z - path.b;
      EXPECT_NEAR(dx * slope.a + dz * slope.b, 0, 1e-6);  // across the path
      EXPECT_NEAR(std::sqrt(dx * dx + dz * dz + p.y * p.y), static_cast<double>(kRadius), 1e-4);
    }
}

TEST(Shapes, NormalsOfClosedShapesPointOutwards) {
  ShapeInput sphere, torus, tube, spring;
  sphere.p[0] = 1.3f;
  torus.p = {1.0f, 0.3f};
  spring.p = {1.0f, 0.2f, 3.0f, 2.0f};
  constexpr float kArc = 0.5522847498f;
  tube.p = {0, 0, 1, 0, 2, 0, 3, 0, 1, 0, 1, kArc, kArc, 1, 0, 1};  // a quarter, counter-clockwise
  for (int k = 0; k < 100; ++k) {
    const float u = 0.005f + 0.01f * static_cast<float>(k % 10) * 9.9f / 10,
                v = 0.05f + 0.09f * static_cast<float>(k / 10);
    const auto normal = [&](ShapeId id, const ShapeInput& in, Vector3<float>& position) {
      return with_shape(id, [&](auto shape) {
        const ShapePoint<float> p = shape_tangents<decltype(shape)>(in, u, v);
        float margin;
        position = p.position;
        return unit_normal(p.by_u, p.by_v, margin);
      });
    };
    Vector3<float> p;
    Vector3<float> n = normal(ShapeId::kSphere, sphere, p);
    EXPECT_GT(dot(n, p), 1.29f);
    n = normal(ShapeId::kTorus, torus, p);
    const float r = std::sqrt(p.x * p.x + p.z * p.z);
    EXPECT_GT(dot(n, p - Vector3<float>{p.x / r, 0, p.z / r}), 0.299f);
    n = normal(ShapeId::kSweptCubic, tube, p);
    EXPECT_GT(n.y * p.y + n.z * p.z, 0.99f);
  }
}

TEST(Shapes, ClosedParametersMeetBitForBit) {
  Random random(3);
  for (int trial = 0; trial < 3000; ++trial) {
    const ShapeId closed_u[] = {ShapeId::kSphere, ShapeId::kCylinder, ShapeId::kTorus, ShapeId::kRevolution};
    const ShapeId id = closed_u[trial % 4];
    const ShapeInput in = test::random_shape(random, id);
    const float t = random.uniform(0, 1);
    EXPECT_TRUE(same_bits(shape_point(id, in, 0.0f, t), shape_point(id, in, 1.0f, t)));
    if (id == ShapeId::kTorus) {
      EXPECT_TRUE(same_bits(shape_point(id, in, t, 0.0f), shape_point(id, in, t, 1.0f)));
    }
    if (id == ShapeId::kSphere) {
      EXPECT_TRUE(same_bits(shape_point(id, in, t, 1.0f), shape_point(id, in, 0.0f, 1.0f)));  // a pole is one point
    }
  }
}

TEST(Shapes, PiecesOfAChainMeetBitForBit) {
  Random random(4);
  for (int trial = 0; trial < 1000; ++trial) {
    ShapeInput first = test::random_shape(random, ShapeId::kRevolution),
               second = test::random_shape(random, ShapeId::kRevolution);
    second.p[0] = first.p[6], second.p[1] = first.p[7];
    const float u = random.uniform(0, 1);
    EXPECT_TRUE(same_bits(shape_point(ShapeId::kRevolution, first, u, 1.0f),
                          shape_point(ShapeId::kRevolution, second, u, 0.0f)));
  }
}

TEST(Normals, APoleHasNoneOfItsOwnAndBorrowsItsNeighbours) {
  ShapeInput in;
  in.p[0] = 2;
  float margin;
  const ShapePoint<float> pole = shape_tangents<Sphere>(in, 0.3f, 1.0f);
  unit_normal(pole.by_u, pole.by_v, margin);
  EXPECT_LE(margin, 0);
  const ShapePoint<float> beside = shape_tangents<Sphere>(in, towards_middle(0.3f), towards_middle(1.0f));
  const Vector3<float> n = unit_normal(beside.by_u, beside.by_v, margin);
  EXPECT_GT(margin, 0);
  EXPECT_GT(n.y, 0.99999f);
}

TEST(OperationCount, CountsTheOperationsOfAPlane) {
  ShapeInput in;
  // Per coordinate of the bilinear patch: 6 products, 3 sums; and 1 - u, 1 - v once.
  const OperationCount count = count_position(ShapeId::kBilinearPatch, in);
  EXPECT_EQ(count.multiplies, 18u);
  EXPECT_EQ(count.adds, 11u);
  EXPECT_EQ(count.divides + count.square_roots, 0u);
  EXPECT_GT(count_geometry(ShapeId::kBilinearPatch, in).total(), count.total());
}

TEST(Declarations, EveryStageHasItsOwnNameAndFitsTheBlock) {
  for (const auto stages : {shape_declarations(), texture_declarations(), shading_declarations()})
    for (std::size_t a = 0; a < stages.size(); ++a) {
      int numbers = 0;
      for (const ParameterDeclaration& p : stages[a].parameters) numbers += p.size;
      EXPECT_LE(numbers, static_cast<int>(kBlockNumbers));
      for (std::size_t b = 0; b < a; ++b) EXPECT_NE(stages[a].name, stages[b].name);
    }
  EXPECT_EQ(shape_declarations().size(), static_cast<std::size_t>(test::kShapeCount));
}

TEST(Textures, StayInsideTheirColours) {
  Random random(5);
  std::array<float, 12> p = {0.9f, 0.8f, 0.7f, 0.1f, 0.2f, 0.3f, 5, 1.5f, 4};
  for (int trial = 0; trial < 2000; ++trial) {
    PointRecord<float> at;
    at.u = random.uniform(0, 1), at.v = random.uniform(0, 1);
    at.object = {random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-2, 2)};
    at.pixel = random.uniform(0, 0.1f);
    for (const TextureId id : {TextureId::kMarble, TextureId::kChecker}) {
      if (id == TextureId::kChecker)
        p[8] = 0.05f;
      else
        p[8] = 4;
      const Vector3<float> c = texture_color(id, p.data(), at);
      EXPECT_TRUE(c.x >= 0.0999f && c.x <= 0.9001f && c.y >= 0.1999f && c.y <= 0.8001f && c.z >= 0.2999f &&
                  c.z <= 0.7001f);
    }
  }
}

}  // namespace
}  // namespace tessera::shaders::procedures_test

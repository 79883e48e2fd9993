#include "shaders_cpp/bicubic.h"
#include "tests/support/tests.h"

namespace tessera::shaders::bicubic_test {
namespace {

using Real3 = Vector3<double>;

ControlPoints<float> random_net(Random& random, float size = 1.0f) {
  ControlPoints<float> c;
  for (auto& p : c) p = {random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size)};
  return c;
}

ControlPoints<double> widen_net(const ControlPoints<float>& c) {
  ControlPoints<double> out;
  for (std::size_t i = 0; i < 16; ++i)
    out[i] = {static_cast<double>(c[i].x), static_cast<double>(c[i].y), static_cast<double>(c[i].z)};
  return out;
}

// Independent oracle: de Casteljau in double precision.
Real3 casteljau(const ControlPoints<double>& c, double u, double v) {
  const auto mix = [](const Real3& a, const Real3& b, double t) { return a * (1 - t) + b * t; };
  const auto curve = [&](Real3 a, Real3 b, Real3 d, Real3 e, double t) {
    const Real3 ab = mix(a, b, t), bd = mix(b, d, t), de = mix(d, e, t);
    return mix(mix(ab, bd, t), mix(bd, de, t), t);
  };
  std::array<Real3, 4> row;
  for (std::size_t j = 0; j < 4; ++j) row[j] = curve(c[4 * j], c[4 * j + 1], c[4 * j + 2], c[4 * j + 3], u);
  return curve(row[0], row[1], row[2], row[3], v);
}

double distance(const Real3& a, const Real3& b) {
  const Real3 d = a - b;
  return std::sqrt(dot(d, d));
}

TEST(Bicubic, AgreesWithDeCasteljauInDoublePrecision) {
  Random random(1);
  for (int trial = 0; trial < 2000; ++trial) {
    const auto c = random_net(random);
    const float u = random.uniform(0, 1), v = random.uniform(0, 1);
    const SurfacePoint<float> p = bicubic_point<float>(bicubic_row(c, v), u);
    const Real3 expected = casteljau(widen_net(c), static_cast<double>(u), static_cast<double>(v));
    EXPECT_NEAR(static_cast<double>(p.position.x), expected.x, 1e-6);
    EXPECT_NEAR(static_cast<double>(p.position.y), expected.y, 1e-6);
    EXPECT_NEAR(static_cast<double>(p.position.z), expected.z, 1e-6);
  }
}

TEST(Bicubic, DerivativesFollowTheSurface) {
  Random random(2);
  for (int trial = 0; trial < 200; ++trial) {
    const auto c = widen_net(random_net(random));
    const double u = static_cast<double>(random.uniform(0.1f, 0.9f)),
                 v = static_cast<double>(random.uniform(0.1f, 0.9f)), h = 1e-5;
    const SurfacePoint<double> p = bicubic_point<double>(bicubic_row(c, v), u);
    EXPECT_LT(distance(p.derivative_u, (casteljau(c, u + h, v) - casteljau(c, u - h, v)) * (0.5 / h)), 1e-8);
    EXPECT_LT(distance(p.derivative_v, (casteljau(c, u, v + h) - casteljau(c, u, v - h)) * (0.5 / h)), 1e-8);
    const SecondDerivatives<double> s = bicubic_second_derivatives(c, u, v);
    const auto at = [&](double du, double dv) { return casteljau(c, u + du, v + dv); };
    const double k = 1e-3;  // second differences of cubics are exact but for rounding
    EXPECT_LT(distance(s.uu, (at(k, 0) - at(0, 0) * 2.0 + at(-k, 0)) * (1 / (k * k))), 1e-5);
    EXPECT_LT(distance(s.vv, (at(0, k) - at(0, 0) * 2.0 + at(0, -k)) * (1 / (k * k))), 1e-5);
    EXPECT_LT(distance(s.uv, (at(k, k) - at(k, -k) - at(-k, k) + at(-k, -k)) * (1 / (4 * k * k))), 1e-4);
  }
}

TEST(Bicubic, NormalsAreRightFromTinyToHugePatches) {
  for (const float size : {1e-12f, 1e-6f, 1.0f, 1e6f, 1e15f}) {
    const auto points = test::flat_patch({0, 0, 0}, {size, 0, 0}, {0, size, 0});
    ControlPoints<float> c;
    for (std::size_t i = 0; i < 16; ++i) c[i] = {points[i].x, points[i].y, points[i].z};
    const auto n = bicubic_normal(c, 0.3f, 0.6f, bicubic_point<float>(bicubic_row(c, 0.6f), 0.3f));
    EXPECT_NEAR(n.z, 1.0f, 1e-6f) << size;
  }
}

// A quarter of a hemisphere-like cap: the whole edge v = 1 is the pole.
ControlPoints<float> pole_patch() {
  ControlPoints<float> c;
  for (std::size_t i = 0; i < 4; ++i) {
    const float angle = static_cast<float>(i) / 3.0f * 1.5f;
    const float x = std::cos(angle), y = std::sin(angle);
    c[i] = {x, y, 0.0f};
    c[4 + i] = {x, y, 0.55f};
    c[8 + i] = {x * 0.55f, y * 0.55f, 1.0f};
    c[12 + i] = {0.0f, 0.0f, 1.0f};
  }
  return c;
}

TEST(Bicubic, AtAPoleTheNormalIsTheLimitFromInside) {
  const auto c = pole_patch();
  for (const float u : {0.0f, 0.25f, 0.5f, 1.0f}) {
    const auto at = bicubic_point<float>(bicubic_row(c, 1.0f), u);
    EXPECT_FALSE(regular_normal(at.derivative_u, at.derivative_v).margin > 0.0f);
    const auto limit = bicubic_normal(c, u, 1.0f, at);
    const auto wide = widen_net(c);
    const auto near = bicubic_normal(wide, static_cast<double>(u), 1.0 - 1e-6,
                                     bicubic_point<double>(bicubic_row(wide, 1.0 - 1e-6), static_cast<double>(u)));
    EXPECT_NEAR(static_cast<double>(limit.x), near.x, 1e-3);
    EXPECT_NEAR(static_cast<double>(limit.y), near.y, 1e-3);
    EXPECT_NEAR(static_cast<double>(limit.z), near.z, 1e-3);
  }
}

TEST(Bicubic, APatchThatIsOnePointHasAFiniteNormal) {
  ControlPoints<float> c;
  c.fill({2, 3, 4});
  const auto n = bicubic_normal(c, 0.5f, 0.5f, bicubic_point<float>(bicubic_row(c, 0.5f), 0.5f));
  EXPECT_EQ(n.x, 0.0f);
  EXPECT_EQ(n.y, 0.0f);
  EXPECT_EQ(n.z, 1.0f);
}

TEST(Bicubic, CoincidentControlPointsGiveExactlyZeroDerivatives) {
  const auto c = pole_patch();
  const auto at = bicubic_point<float>(bicubic_row(c, 1.0f), 0.37f);
  EXPECT_EQ(at.derivative_u.x, 0.0f);
  EXPECT_EQ(at.derivative_u.y, 0.0f);
  EXPECT_EQ(at.derivative_u.z, 0.0f);
}

}  // namespace
}  // namespace tessera::shaders::bicubic_test

// Invariant 3: no point of a displaced, moving, defocused sub-patch lies outside its bound, whatever the method.
#include "base/real.h"
#include "frontend/bounds/enclosure.h"
#include "tests/frontend/bound_checks.h"
#include "tests/support/tests.h"

namespace tessera::frontend::sub_patch_bounds_test {
namespace {

// ---- Nets -------------------------------------------------------------------------------------------------------

PatchNet random_net(Random& random, float bend) {
  std::vector<Vec3> c = test::flat_patch({-1, -1, 0}, {2, 0, 0}, {0, 2, 0});
  const float skew = random.uniform(-2.5f, 2.5f);  // opens or closes the angle between the tangents
  for (Vec3& p : c) p = p + Vec3(skew * p.y, 0, 0) + random.in_box(bend);
  return make_net(std::span<const Vec3, 16>(c));
}

struct DoublePoint {
  DVec3 position, u, v;
};
DoublePoint evaluate(const PatchNet& net, double u, double v) {
  shaders::ControlPoints<double> c;
  for (std::size_t k = 0; k < 16; ++k) c[k] = {net.c[0][k], net.c[1][k], net.c[2][k]};
  const auto p = shaders::bicubic_point<double>(shaders::bicubic_row(c, v), u);
  const auto vec = [](const Vector3<double>& a) { return DVec3(a.x, a.y, a.z); };
  return {vec(p.position), vec(p.derivative_u), vec(p.derivative_v)};
}

TEST(PatchNet, PartsReproduceTheSurface) {
  Random random(9);
  for (int trial = 0; trial < 300; ++trial) {
    const PatchNet net = random_net(random, 1.0f);
    const scene::ParameterRange range{random.uniform(0, 0.5f), random.uniform(0, 0.5f), random.uniform(0.5f, 1),
                                      random.uniform(0.5f, 1)};
    const PatchNet part = restrict_net(net, range);
    const double s = static_cast<double>(random.uniform(0, 1)), t = static_cast<double>(random.uniform(0, 1));
    const auto mix = [](float a, float b, double w) {
      return static_cast<double>(a) * (1 - w) + static_cast<double>(b) * w;
    };
    const DVec3 a = evaluate(part, s, t).position,
                b = evaluate(net, mix(range.u0, range.u1, s), mix(range.v0, range.v1, t)).position;
    EXPECT_LT(glm::length(a - b), 1e-12);
  }
}

TEST(PatchNet, AFlatStripHasAMuchTighterBoxInItsOwnFrameThanInTheWorlds) {
  std::vector<Vec3> points = test::flat_patch({0, 0, 0}, {1, 1, 0}, {-0.06f, 0.06f, 0});
  const std::array<PatchNet, 1> net = {make_net(std::span<const Vec3, 16>(points))};
  const Extents e = measure_extents(net[0], corner_frame(net).axes);
  EXPECT_LT((e.high[0] - e.low[0]) * (e.high[1] - e.low[1]), 0.2 * 1.06 * 1.06);
}

// ---- Normal cones -----------------------------------------------------------------------------------------------

struct ConeOutcome {
  int normals = 0, violations = 0, cones = 0, npatch_cones = 0, looser = 0;
};

// Random nets, half of them with tangents that open beyond 90 degrees; true normals against the ranges.
ConeOutcome cone_outcome(std::uint32_t seed, bool npatch) {
  Random random(seed);
  ConeOutcome out;
  for (int trial = 0; trial < 20000; ++trial) {
    const std::array<PatchNet, 1> net = {random_net(random, random.uniform(0.0f, 0.35f))};
    const CornerFrame frame = corner_frame(net);
    const NetMeasure m = measure_net(net[0], frame.axes, frame.tangent_u, frame.tangent_v);
    const DerivativeError error{0, 1, 1};
    const std::optional<TangentCones> tangents = tangent_cones(m, frame);
    std::optional<NormalCone> tpatch = tangents ? tpatch_cone(*tangents, error) : std::nullopt, cone = tpatch;
    if (npatch) cone = npatch_cone(net[0], m, frame, tpatch, error);
    out.cones += tpatch ? 1 : 0;
    out.npatch_cones += cone ? 1 : 0;
    if (tpatch && (!cone || cone->sine > tpatch->sine)) ++out.looser;
    if (!cone) continue;
    const NormalRange range = normal_range(cone);
    for (int k = 0; k < 30; ++k) {
      DVec3 n;
      if (npatch) {
        const DoublePoint p =
            evaluate(net[0], static_cast<double>(random.uniform(0, 1)), static_cast<double>(random.uniform(0, 1)));
        n = glm::normalize(glm::cross(p.u, p.v));
      } else {
        // TPATCH holds for tangents at different points as well, which back-face culling relies on.
        const auto draw = [&] {
          return evaluate(net[0], static_cast<double>(random.integer(0, 4)) / 4,
                          static_cast<double>(random.integer(0, 4)) / 4);
        };
        n = glm::normalize(glm::cross(draw().u, draw().v));
      }
      ++out.normals;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double s = glm::dot(n, frame.axes[axis]);
        if (s < range.low[axis] || s > range.high[axis]) {
          ++out.violations;
          break;
        }
      }
    }
  }
  return out;
}

TEST(Tpatch, ContainsNormalsAlsoWhenTangentsOpenBeyondNinetyDegrees) {
  const ConeOutcome out = cone_outcome(3, false);
  EXPECT_EQ(out.violations, 0);
  EXPECT_GT(out.normals, 100000);
}

// Cone pairs alone, without patches: the formula itself.
int cone_pair_violations(bool signed_cosine) {
  Random random(17);
  int violations = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const double beta = static_cast<double>(random.uniform(0.3f, 2.84f)),
                 room = std::min(beta, 3.14159265358979 - beta);
    const double alpha_u = room * static_cast<double>(random.uniform(0.02f, 0.6f)),
                 alpha_v = (room - alpha_u) * static_cast<double>(random.uniform(0.05f, 0.98f));
    const DVec3 t(1, 0, 0), b(std::cos(beta), std::sin(beta), 0);
    const double cosine = signed_cosine ? std::cos(beta) : std::abs(std::cos(beta));
    TangentCones cones{
        std::sin(alpha_u), std::sin(alpha_v), std::sin(beta), cosine, std::sin(room - alpha_u - alpha_v), 1, 1, 1, 1};
    const auto cone = tpatch_cone(cones, {0, 1, 1});
    if (!cone) continue;
    const auto edge_of = [&](const DVec3& axis, double alpha) {
      const DVec3 side = glm::normalize(glm::cross(axis, DVec3(0, 0, 1))), up = glm::cross(side, axis);
      const double turn = static_cast<double>(random.uniform(0, 6.2831853f));
      return axis * std::cos(alpha) + (side * std::cos(turn) + up * std::sin(turn)) * std::sin(alpha);
    };
    for (int k = 0; k < 200; ++k) {
      const DVec3 n = glm::normalize(glm::cross(edge_of(t, alpha_u), edge_of(b, alpha_v)));
      if (n.z < cone->cosine - 1e-9) {
        ++violations;
        break;
      }
    }
  }
  return violations;
}

TEST(Tpatch, HoldsForAnyPairOfTangentCones) { EXPECT_EQ(cone_pair_violations(false), 0); }

TEST(Tpatch, ThePublishedSignOfTheCosineIsCaught) { EXPECT_GT(cone_pair_violations(true), 0); }

TEST(Npatch, ContainsEveryNormalAndIsNeverLooserThanTpatch) {
  const ConeOutcome out = cone_outcome(4, true);
  EXPECT_EQ(out.violations, 0);
  EXPECT_EQ(out.looser, 0);
  EXPECT_GT(out.npatch_cones, out.cones) << "NPATCH has a cone where TPATCH has none";
}

TEST(NormalCones, DegenerateNetsHaveNone) {
  const auto cone_of = [](const PatchNet& net) {
    const std::array<PatchNet, 1> nets = {net};
    const CornerFrame frame = corner_frame(nets);
    const NetMeasure m = measure_net(net, frame.axes, frame.tangent_u, frame.tangent_v);
    const auto tangents = tangent_cones(m, frame);
    return npatch_cone(net, m, frame, tangents ? tpatch_cone(*tangents, {0, 1, 1}) : std::nullopt, {0, 1, 1});
  };
  Random random(2);
  for (const Hard kind : {Hard::kPoint, Hard::kParallel, Hard::kPole}) {
    std::vector<Vec3> points = hard_net(kind, random);
    if (kind == Hard::kPole)  // both tangents vanish at a corner
      for (const std::size_t k : {1u, 4u, 5u}) points[k] = points[0];
    EXPECT_FALSE(cone_of(make_net(std::span<const Vec3, 16>(points))).has_value());
  }
}

// ---- Intervals --------------------------------------------------------------------------------------------------

// A polynomial and a quotient with a root, as a stage would be written.
template <class Real>
Real stage(Real u, Real v) {
  using tessera::real_abs, tessera::real_max, tessera::real_min, tessera::real_sqrt;
  const Real a = (Real(1) - u) * (Real(2) + v * v) - Real(0.25f) * u,
             b = real_max(real_abs(u * v - Real(0.1f)), Real(0.05f));
  return real_sqrt(a * a + b) / (Real(0.5f) + b * b) - real_min(u, v) * Real(1000.0f);
}

TEST(Enclosure, HoldsTheFloatResultsOfAStageAnywhereInItsBox) {
  Random random(6);
  for (int trial = 0; trial < 20000; ++trial) {
    const float size = std::exp2(static_cast<float>(-random.integer(0, 22)));
    const float u0 = random.uniform(-1, 1), v0 = random.uniform(-1, 1), u1 = u0 + size * random.uniform(0, 1),
                v1 = v0 + size * random.uniform(0, 1);
    const Enclosure e = stage(Enclosure::first_parameter(static_cast<double>(u0), static_cast<double>(u1)),
                              Enclosure::second_parameter(static_cast<double>(v0), static_cast<double>(v1)));
    for (int k = 0; k < 8; ++k) {
      const float u = std::clamp(random.uniform(u0, u1), u0, u1), v = std::clamp(random.uniform(v0, v1), v0, v1),
                  result = stage(u, v);
      EXPECT_GE(static_cast<double>(result), e.low());
      EXPECT_LE(static_cast<double>(result), e.high());
    }
  }
}

TEST(Enclosure, TightensWithTheSquareOfItsBox) {
  // u (1 - u) about its maximum: intervals alone stay as wide as the box.
  const auto width = [](double half) {
    const Enclosure u = Enclosure::first_parameter(0.5 - half, 0.5 + half), e = u * (Enclosure(1) - u);
    return e.range().high() - e.range().low();
  };
  EXPECT_LT(width(0.01), 0.05 * width(0.1));
  EXPECT_GE(width(0.01), 0.0001);
}

TEST(Interval, HoldsEveryResultAndIsEverythingWhereThereIsNone) {
  Random random(8);
  for (int trial = 0; trial < 5000; ++trial) {
    const auto draw = [&] {
      const double a = static_cast<double>(random.uniform(-2, 2)), b = static_cast<double>(random.uniform(-2, 2));
      return Interval(std::min(a, b), std::max(a, b));
    };
    const Interval a = draw(), b = draw();
    const auto member = [&](const Interval& i) {
      return i.low() + (i.high() - i.low()) * static_cast<double>(random.uniform(0, 1));
    };
    const auto holds = [](const Interval& i, double x) { return i.low() <= x && x <= i.high(); };
    const double x = member(a), y = member(b);
    EXPECT_TRUE(holds(a + b, x + y) && holds(a - b, x - y) && holds(a * b, x * y) && holds(a / b, x / y) &&
                holds(square_root(absolute(a)), std::sqrt(std::abs(x))));
  }
  const Interval infinite(0, std::numeric_limits<double>::infinity());
  EXPECT_TRUE(std::isinf((Interval(0.0) * infinite).high()));
  EXPECT_TRUE(std::isinf((Interval(1.0) / Interval(-1, 1)).low()));
  EXPECT_TRUE(std::isinf(square_root(Interval(-1, 4)).high()));
}

// ---- Whole sub-patches ------------------------------------------------------------------------------------------

class SubPatchBounds : public testing::TestWithParam<std::tuple<int, int>> {};

// Together the instances make more than ten million checks.
TEST_P(SubPatchBounds, HoldEveryPointOfTheDisplacedMovingDefocusedPatch) {  // M3
  const auto kind = static_cast<Hard>(std::get<0>(GetParam()));
  const auto method = static_cast<BoundMethod>(std::get<1>(GetParam()));
  Random random(100 + static_cast<std::uint32_t>(std::get<0>(GetParam())));
  BoundOutcome total;
#ifdef TESSERA_SANITIZED
  constexpr int kScenes = 8;
#else
  constexpr int kScenes = 60;
#endif
  for (int trial = 0; trial < kScenes; ++trial) {
    const Scene scene(kind, random);
    const BoundOutcome outcome = check_scene(scene, random, method, BoundTwin::kHonest, 6);
    total.points += outcome.points;
    total.violations += outcome.violations;
  }
  EXPECT_EQ(total.violations, 0);
  EXPECT_GT(total.points, kScenes * 400) << "the case shows nothing";
  RecordProperty("checks", static_cast<int>(total.points));
}

std::string case_name(const testing::TestParamInfo<std::tuple<int, int>>& instance) {
  const auto [kind, method] = instance.param;
  return std::string(kHardNames[kind]) + "_" + std::string(kEnumWords<BoundMethod>[static_cast<std::size_t>(method)]);
}
INSTANTIATE_TEST_SUITE_P(HardCase, SubPatchBounds,
                         testing::Combine(testing::Range(0, static_cast<int>(Hard::kCount)),
                                          testing::Range(0, static_cast<int>(kEnumWords<BoundMethod>.size()))),
                         case_name);

std::int64_t twin_violations(Hard kind, BoundTwin twin) {
  Random random(7);
  std::int64_t violations = 0;
  for (int trial = 0; trial < 20; ++trial)
    violations += check_scene(Scene(kind, random), random, BoundMethod::kTpatch, twin, 6).violations;
  return violations;
}

TEST(SubPatchBoundsTwin, ABoundThatForgetsDisplacementIsCaught) {
  EXPECT_GT(twin_violations(Hard::kBigDisplacement, BoundTwin::kNoDisplacement), 0);
}

TEST(SubPatchBoundsTwin, ABoundThatForgetsVerticesOfOtherPatchesIsCaught) {
  EXPECT_GT(twin_violations(Hard::kRandom, BoundTwin::kNoForeignVertices), 0);
}

TEST(SubPatchBoundsTwin, ABoundThatForgetsMotionIsCaught) {
  EXPECT_GT(twin_violations(Hard::kRandom, BoundTwin::kNoMotion), 0);
}

TEST(SubPatchBoundsTwin, ABoundThatIsAFiftiethTooSmallIsCaught) {
  EXPECT_GT(twin_violations(Hard::kFlatTexture, BoundTwin::kShrunk), 0);
}

TEST(BoundMethods, AreOrderedByTightness) {
  // Mean extent of random displaced patches: each method's reason to exist.
  Random random(21);
  std::array<double, 5> sum{};
  for (int trial = 0; trial < 40; ++trial) {
    const Scene scene(Hard::kNoMotion, random);
    for (std::size_t m = 0; m < 5; ++m) {
      SubPatchBounder bounder(*scene.frame, *scene.pyramids, static_cast<BoundMethod>(m));
      bounder.begin(0);
      const MovingBox box = bounder.box({4, 4, 12, 12});
      for (std::size_t axis = 0; axis < 3; ++axis) sum[m] += box.high[0][axis] - box.low[0][axis];
    }
  }
  EXPECT_LT(sum[static_cast<std::size_t>(BoundMethod::kTpatch)], sum[static_cast<std::size_t>(BoundMethod::kObb)]);
  EXPECT_LE(sum[static_cast<std::size_t>(BoundMethod::kNpatch)], sum[static_cast<std::size_t>(BoundMethod::kTpatch)]);
}

}  // namespace
}  // namespace tessera::frontend::sub_patch_bounds_test

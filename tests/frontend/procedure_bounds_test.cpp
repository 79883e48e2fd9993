// Enclosures of procedural shapes: intervals against results in floats and doubles.
#include "frontend/bounds/enclosure_functions.h"
#include "shaders_cpp/procedures/procedures.h"
#include "tests/support/programs.h"
#include "tests/support/tests.h"

namespace tessera::frontend::procedure_bounds_test {
namespace {

using shaders::ShapeId;
using shaders::ShapeInput;

struct Box {
  double u0, u1, v0, v1;
};

Box random_box(Random& random) {
  const float size = std::exp2(random.uniform(-10, 0));
  const float u = random.uniform(0, 1 - size), v = random.uniform(0, 1 - size);
  return {static_cast<double>(u), static_cast<double>(u + size), static_cast<double>(v), static_cast<double>(v + size)};
}

Vector3<Enclosure> enclose(ShapeId id, const ShapeInput& in, const Box& box) {
  return shaders::shape_point(id, in, Enclosure::first_parameter(box.u0, box.u1),
                              Enclosure::second_parameter(box.v0, box.v1));
}

bool holds(const Enclosure& e, double value) { return !(value < e.low() || value > e.high()) || std::isnan(value); }

// Points of random boxes of random shapes that their enclosure, narrowed by `shrink`, does not hold.
int violations(std::uint32_t seed, int boxes, double shrink) {
  Random random(seed);
  int count = 0;
  for (int trial = 0; trial < boxes; ++trial) {
    const auto id = static_cast<ShapeId>(trial % test::kShapeCount);
    const ShapeInput in = test::random_shape(random, id);
    const Box box = random_box(random);
    const Vector3<Enclosure> e = enclose(id, in, box);
    const auto outside = [&](const Enclosure& a, double value) {
      const double middle = (a.low() + a.high()) / 2, half = (a.high() - a.low()) / 2 * (1 - shrink);
      return shrink > 0 ? std::abs(value - middle) > half : !holds(a, value);
    };
    for (int k = 0; k < 8; ++k) {
      float u = random.uniform(static_cast<float>(box.u0), static_cast<float>(box.u1)),
            v = random.uniform(static_cast<float>(box.v0), static_cast<float>(box.v1));
      if (k < 4)
        u = static_cast<float>(k & 1 ? box.u1 : box.u0), v = static_cast<float>(k & 2 ? box.v1 : box.v0);  // corners
      const Vector3<float> p = shaders::shape_point(id, in, u, v);
      const Vector3<double> q = shaders::shape_point(id, in, static_cast<double>(u), static_cast<double>(v));
      const bool bad = outside(e.x, static_cast<double>(p.x)) || outside(e.y, static_cast<double>(p.y)) ||
                       outside(e.z, static_cast<double>(p.z)) || outside(e.x, q.x) || outside(e.y, q.y) ||
                       outside(e.z, q.z);
      count += bad ? 1 : 0;
    }
  }
  return count;
}

TEST(ProcedureEnclosure, HoldsFloatAndDoubleEvaluationsOfEveryShape) { EXPECT_EQ(violations(1, 200000, 0), 0); }

TEST(ProcedureEnclosure, ANarrowerOneIsCaught) { EXPECT_GT(violations(1, 20000, 0.05), 100); }

TEST(ProcedureEnclosure, DerivativesHoldTheSlopesOfDuals) {
  Random random(2);
  for (int trial = 0; trial < 100000; ++trial) {
    const auto id = static_cast<ShapeId>(trial % test::kShapeCount);
    const ShapeInput in = test::random_shape(random, id);
    const Box box = random_box(random);
    const Vector3<Enclosure> e = enclose(id, in, box);
    const double u = box.u0 + (box.u1 - box.u0) * static_cast<double>(random.uniform(0, 1)),
                 v = box.v0 + (box.v1 - box.v0) * static_cast<double>(random.uniform(0, 1));
    shaders::with_shape(id, [&](auto shape) {
      const shaders::ShapePoint<double> p = shaders::shape_tangents<decltype(shape)>(in, u, v);
      const auto check = [&](const Enclosure& a, double by_u, double by_v) {
        // An enclosure's derivatives are scaled to [-1, 1]; the shape's numbers round differently in double.
        const double s = by_u * (box.u1 - box.u0) / 2, t = by_v * (box.v1 - box.v0) / 2,
                     slack = 1e-6 * (1 + std::abs(s) + std::abs(t));
        ASSERT_FALSE(s < a.by_s().low() - slack || s > a.by_s().high() + slack)
            << static_cast<int>(id) << " trial " << trial;
        ASSERT_FALSE(t < a.by_t().low() - slack || t > a.by_t().high() + slack)
            << static_cast<int>(id) << " trial " << trial;
      };
      check(e.x, p.by_u.x, p.by_v.x);
      check(e.y, p.by_u.y, p.by_v.y);
      check(e.z, p.by_u.z, p.by_v.z);
    });
    if (HasFatalFailure()) return;
  }
}

TEST(ProcedureEnclosure, TightensWithItsBox) {
  // Sum of the sides over the extent of a dense sampling, per shape, for a box of 1/32: the meaning of tight.
  Random random(3);
  for (int s = 0; s < test::kShapeCount; ++s) {
    const auto id = static_cast<ShapeId>(s);
    double bound = 0, truth = 0;
    for (int trial = 0; trial < 50; ++trial) {
      const ShapeInput in = test::random_shape(random, id);
      const double u = static_cast<double>(random.uniform(0.1f, 0.8f)),
                   v = static_cast<double>(random.uniform(0.1f, 0.8f));
      const Vector3<Enclosure> e = enclose(id, in, {u, u + 0.03125, v, v + 0.03125});
      double low[3] = {1e30, 1e30, 1e30}, high[3] = {-1e30, -1e30, -1e30};
      for (int k = 0; k < 81; ++k) {
        const Vector3<double> p = shaders::shape_point(id, in, u + (k % 9) / 256.0, v + (k / 9) / 256.0);
        const double c[3] = {p.x, p.y, p.z};
        for (int a = 0; a < 3; ++a) low[a] = std::min(low[a], c[a]), high[a] = std::max(high[a], c[a]);
      }
      const double sides = (e.x.high() - e.x.low()) + (e.y.high() - e.y.low()) + (e.z.high() - e.z.low());
      if (!std::isfinite(sides)) continue;  // a path that stands still has no direction
      bound += sides;
      truth += (high[0] - low[0]) + (high[1] - low[1]) + (high[2] - low[2]);
    }
    EXPECT_LT(bound, (id == ShapeId::kSweptCubic ? 3.0 : id == ShapeId::kHeightField ? 3.0 : 1.6) * truth + 1e-6) << s;
  }
}

TEST(ProcedureEnclosure, NoiseStaysInItsRangeAcrossLatticeLines) {
  Random random(4);
  for (int trial = 0; trial < 20000; ++trial) {
    const double x = static_cast<double>(random.uniform(-5, 5)), y = static_cast<double>(random.uniform(-5, 5)),
                 w = static_cast<double>(random.uniform(0, 2.5f));
    const NoiseRange r = noise_range({x, x + w}, {y, y + w});
    const double px = x + w * static_cast<double>(random.uniform(0, 1)),
                 py = y + w * static_cast<double>(random.uniform(0, 1));
    const auto n = shaders::plane_noise_with_slopes(px, py);
    ASSERT_TRUE(n.value >= r.value.low() && n.value <= r.value.high());
    ASSERT_TRUE(n.by_x >= r.by_x.low() && n.by_x <= r.by_x.high());
    ASSERT_TRUE(n.by_y >= r.by_y.low() && n.by_y <= r.by_y.high());
  }
}

bool same(const Interval& a, const Interval& b) { return a.low() == b.low() && a.high() == b.high(); }
bool same(const Enclosure& a, const Enclosure& b) {
  return same(a.range(), b.range()) && same(a.middle(), b.middle()) && same(a.by_s(), b.by_s()) &&
         same(a.by_t(), b.by_t()) && a.error() == b.error();
}

TEST(ProgramBounds, EqualTheBoundsOfBuiltInShapes) {  // PGM1
  Random random(31);
  for (int trial = 0; trial < 2000; ++trial) {
    const auto id = static_cast<ShapeId>(trial % test::kShapeCount);
    const ShapeInput in = test::random_shape(random, id);
    const test::ShapeTwin twin(id, in);
    const Box box = random_box(random);
    const Vector3<Enclosure> a = enclose(id, in, box), b = enclose(ShapeId::kProgram, twin.input, box);
    EXPECT_TRUE(same(a.x, b.x) && same(a.y, b.y) && same(a.z, b.z)) << trial;
  }
}

// Selection and steps, which no built-in shape has.
TEST(ProgramBounds, HoldTheResultsOfSelectionsAndSteps) {
  const char* const texts[] = {
      "shape s { return vec3(u < v ? u * 3 : v - 2, floor(u * 7) * v, fract(v * 5 + u)); }",
      "shape s { let a = noise(u * 4, v * 4); return vec3(a > 0 ? a : 0 - a * 2, floor(a * 3) / 3, smooth(a)); }",
      "shape s { let s = sincos(u * 3); return vec3(clamp(s.x, 0.2, 0.7), mix(u, s.y, v), abs(s.x - v)); }"};
  Random random(32);
  for (const char* text : texts) {
    const shaders::CompiledText compiled = shaders::compile_programs(text);
    ASSERT_FALSE(compiled.fault);
    ShapeInput in;
    const std::vector<float> constants = compiled.programs.shape->bind({});
    in.program = compiled.programs.shape.get();
    in.constants = constants.data();
    for (int trial = 0; trial < 2000; ++trial) {
      const Box box = random_box(random);
      const Vector3<Enclosure> e = enclose(ShapeId::kProgram, in, box);
      for (int k = 0; k < 8; ++k) {
        const float u = random.uniform(static_cast<float>(box.u0), static_cast<float>(box.u1)),
                    v = random.uniform(static_cast<float>(box.v0), static_cast<float>(box.v1));
        const Vector3<float> p = shaders::shape_point(ShapeId::kProgram, in, u, v);
        EXPECT_TRUE(holds(e.x, static_cast<double>(p.x)) && holds(e.y, static_cast<double>(p.y)) &&
                    holds(e.z, static_cast<double>(p.z)))
            << text << " " << u << " " << v;
      }
    }
  }
}

}  // namespace
}  // namespace tessera::frontend::procedure_bounds_test

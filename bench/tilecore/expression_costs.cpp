// Measures the host time of built-in stages written as programs, relative to the built-ins: prints a table of ratios.
//
//   tessera_expression_costs [--check]
//
// Array: 256 samples with tangents and view. Point: one sample with tangents, or one colour. Interval: one cell. With
// --check the sphere, the spring and the marble may take at most twice the time, and a point of the spring 2.5 times (it takes 2.22).
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <fmt/format.h>

#include "base/thread_clock.h"
#include "frontend/bounds/enclosure_functions.h"
#include "shaders_cpp/procedures/procedures.h"
#include "tests/support/programs.h"
#include "tilecore/procedural/procedure_kernel.h"

namespace tessera::bench {
namespace {

using frontend::Enclosure;
using shaders::ShapeId;
using shaders::ShapeInput;
using shaders::TextureId;
using test::Random;

constexpr double kMaxRatio = 2, kMaxSpringPoint = 2.5;
constexpr int kRounds = 31;

volatile float sink = 0;

// Uses all results: a compiler would drop unused ones from the built-ins alone.
void use(const Vector3<float>& a) { sink = a.x + a.y + a.z; }
void use(const shaders::ShapePoint<float>& p) { use(p.position + p.by_u + p.by_v); }
double all_of(const Enclosure& e) {
  return e.low() + e.high() + e.by_s().low() + e.by_s().high() + e.by_t().low() + e.by_t().high();
}

// As in deferred shading: a stage chosen at run time, one point at a time.
[[gnu::noinline]] shaders::ShapePoint<float> point_of(ShapeId id, const ShapeInput& in, float u, float v) {
  return shaders::with_shape(id, [&](auto shape) { return shaders::shape_tangents<decltype(shape)>(in, u, v); });
}
[[gnu::noinline]] Vector3<float> color_of(TextureId id, const float* numbers, const shaders::PointRecord<float>& at) {
  return shaders::texture_color(id, numbers, at);
}
[[gnu::noinline]] Vector3<float> color_of(const test::TextureTwin& twin, const shaders::PointRecord<float>& at) {
  return shaders::program_color(*twin.program, twin.constants.data(), at);
}

// Processor time of `second` relative to `first`, each called `calls` times: the least of interleaved rounds, which
// other work of the host disturbs least.
double ratio(int calls, const std::function<void()>& first, const std::function<void()>& second) {
  const auto seconds = [&](const std::function<void()>& work) {
    const double start = thread_seconds();
    for (int k = 0; k < calls; ++k) work();
    return thread_seconds() - start;
  };
  double a = seconds(first), b = seconds(second);
  for (int round = 0; round < kRounds; ++round) {
    a = std::min(a, seconds(first));
    b = std::min(b, seconds(second));
  }
  return b / a;
}

struct Row {
  std::string name;
  std::optional<double> array, point, interval;
  bool same = true;
};

constexpr std::size_t kPoints = 64;
struct Points {
  std::array<float, kPoints> u, v;
};
Points random_points(Random& random) {
  Points out;
  for (std::size_t k = 0; k < kPoints; ++k) out.u[k] = random.uniform(0, 1), out.v[k] = random.uniform(0, 1);
  return out;
}

double array_ratio(ShapeId id, const ShapeInput& in, const ShapeInput& twin, bool& same) {
  const auto fill = [&](tilecore::SampleRegisters& registers) {
    Random random(5);
    for (std::size_t k = 0; k < tilecore::kArraySamples; ++k)
      registers.u[k] = random.uniform(0, 1), registers.v[k] = random.uniform(0, 1);
  };
  const auto a = std::make_unique<tilecore::SampleRegisters>(), b = std::make_unique<tilecore::SampleRegisters>();
  fill(*a), fill(*b);
  tilecore::ArrayProgram first, second;
  first.shape = id, first.input = &in;
  second.shape = ShapeId::kProgram, second.input = &twin;
  first.to_raster[0] = second.to_raster[0] = Mat4(100, 0, 0, 0, 0, -100, 0, 0, -50, -50, -1, -1, 250, 250, 5, 5);
  const double out = ratio(
      200, [&] { tilecore::run_procedure(first, tilecore::kArraySamples, *a); },
      [&] { tilecore::run_procedure(second, tilecore::kArraySamples, *b); });
  same = same && std::memcmp(&a->at[0], &b->at[0], sizeof a->at[0]) == 0;
  return out;
}

Row shape_row(ShapeId id) {
  Random random(static_cast<std::uint32_t>(id) + 40);
  ShapeInput in = test::random_shape(random, id);
  if (id == ShapeId::kHeightField) in.p[4] = 4;
  const test::ShapeTwin twin(id, in);
  const Points at = random_points(random);
  Row row;
  row.name = shaders::shape_declarations()[static_cast<std::size_t>(id)].name;
  row.array = array_ratio(id, in, twin.input, row.same);
  const auto points = [&](ShapeId of, const ShapeInput& input) {
    for (std::size_t k = 0; k < kPoints; ++k) use(point_of(of, input, at.u[k], at.v[k]));
  };
  row.point = ratio(
      40, [&] { points(id, in); }, [&] { points(ShapeId::kProgram, twin.input); });
  const auto enclose = [&](ShapeId of, const ShapeInput& input) {
    for (std::size_t k = 0; k < kPoints; ++k) {
      const double u = static_cast<double>(at.u[k]) * 0.9, v = static_cast<double>(at.v[k]) * 0.9;
      const Vector3<Enclosure> p = shaders::shape_point(of, input, Enclosure::first_parameter(u, u + 0.01),
                                                        Enclosure::second_parameter(v, v + 0.01));
      sink = static_cast<float>(all_of(p.x) + all_of(p.y) + all_of(p.z));
    }
  };
  row.interval = ratio(
      10, [&] { enclose(id, in); }, [&] { enclose(ShapeId::kProgram, twin.input); });
  return row;
}

Row texture_row(TextureId id) {
  Random random(static_cast<std::uint32_t>(id) + 60);
  std::array<float, 12> numbers = test::random_texture(random, id);
  if (id == TextureId::kMarble) numbers[8] = 4;
  const test::TextureTwin twin(id, numbers);
  std::array<shaders::PointRecord<float>, kPoints> at;
  for (auto& record : at) {
    record.u = random.uniform(0, 1), record.v = random.uniform(0, 1), record.pixel = random.uniform(0, 0.01f);
    record.object = {random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-2, 2)};
  }
  Row row;
  row.name = shaders::texture_declarations()[static_cast<std::size_t>(id)].name;
  for (const auto& record : at) {
    const Vector3<float> a = color_of(id, numbers.data(), record), b = color_of(twin, record);
    row.same = row.same && a.x == b.x && a.y == b.y && a.z == b.z;
  }
  row.point = ratio(
      40,
      [&] {
        for (const auto& record : at) use(color_of(id, numbers.data(), record));
      },
      [&] {
        for (const auto& record : at) use(color_of(twin, record));
      });
  return row;
}

int run(bool check) {
  fmt::print("| stage | array | point | interval | bits |\n|---|---:|---:|---:|---|\n");
  bool good = true;
  const auto print = [&](const Row& row) {
    const auto cell = [](const std::optional<double>& value) { return value ? fmt::format("{:.2f}", *value) : ""; };
    fmt::print("| {} | {} | {} | {} | {} |\n", row.name, cell(row.array), cell(row.point), cell(row.interval),
               row.same ? "same" : "OTHER");
    good = good && row.same;
    if (row.name != "sphere" && row.name != "spring" && row.name != "marble") return;
    for (const auto& value : {row.array, row.interval}) good = good && (!value || *value <= kMaxRatio);
    good = good && (!row.point || *row.point <= (row.name == "spring" ? kMaxSpringPoint : kMaxRatio));
  };
  for (int id = 0; id < test::kShapeCount; ++id) print(shape_row(static_cast<ShapeId>(id)));
  for (int id = 0; id < test::kTextureCount; ++id) print(texture_row(static_cast<TextureId>(id)));
  if (!good)
    fmt::print(
        "bits differ, or sphere, spring or marble take more than {:g} times the built-in's time ({:g} a point of the "
        "spring)\n",
        kMaxRatio, kMaxSpringPoint);
  return check && !good ? 1 : 0;
}

}  // namespace
}  // namespace tessera::bench

int main(int argc, char** argv) { return tessera::bench::run(argc > 1 && std::string(argv[1]) == "--check"); }

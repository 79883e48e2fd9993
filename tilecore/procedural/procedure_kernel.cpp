#include "tilecore/procedural/procedure_kernel.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tilecore/procedural/procedure_kernel.cpp"
#include <hwy/foreach_target.h>

#include "shaders_cpp/procedures/procedures-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::tilecore::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
namespace stage = shaders::HWY_NAMESPACE;
using Lanes = tessera::HWY_NAMESPACE::FloatLanes;
using tessera::HWY_NAMESPACE::Vector3;
using Point = Vector3<Lanes>;

// One row of a matrix applied to a point and to its two tangents.
struct Row {
  Lanes value, by_u, by_v;
};
HWY_INLINE Row transformed_row(const Mat4& m, int row, const stage::ShapePoint<Lanes>& p) {
  const Lanes a(m[0][row]), b(m[1][row]), c(m[2][row]), d(m[3][row]);
  const auto direction = [&](const Point& t) HWY_ATTR { return (a * t.x + b * t.y) + c * t.z; };
  return {(a * p.position.x + b * p.position.y) + (c * p.position.z + d), direction(p.by_u), direction(p.by_v)};
}

HWY_INLINE void store_column(std::array<std::array<float, kArraySamples>, SampleRegisters::kColumns>& at,
                             std::size_t column, std::size_t first, const Row& row) {
  row.value.store(&at[column][first]);
  row.by_u.store(&at[column + SampleRegisters::kXu][first]);
  row.by_v.store(&at[column + SampleRegisters::kXv][first]);
}

// Projects at keys from `key` up to `end`, which is excluded.
HWY_INLINE void run_view(const ArrayProgram& program, const stage::ShapePoint<Lanes>& p, std::size_t key,
                         std::size_t end, std::size_t first, SampleRegisters& registers) {
  for (; key < end; ++key) {
    Row x = transformed_row(program.to_raster[key], 0, p), y = transformed_row(program.to_raster[key], 1, p);
    const Row z = transformed_row(program.to_raster[key], 2, p);
    if (program.divided && !program.orthographic) {
      const Lanes inverse = Lanes(1.0f) / z.value;
      const auto divide = [&](Row& a) HWY_ATTR {
        a.value = a.value * inverse;
        a.by_u = (a.by_u - a.value * z.by_u) * inverse;
        a.by_v = (a.by_v - a.value * z.by_v) * inverse;
      };
      divide(x);
      divide(y);
    }
    store_column(registers.at[key], SampleRegisters::kX, first, x);
    store_column(registers.at[key], SampleRegisters::kY, first, y);
    store_column(registers.at[key], SampleRegisters::kZ, first, z);
  }
}

template <class Shape>
HWY_INLINE Point lane_normals(const shaders::ShapeInput& input, Lanes u, Lanes v, const stage::ShapePoint<Lanes>& p) {
  Lanes margin;
  const Point n = stage::unit_normal(p.by_u, p.by_v, margin);
  const auto regular = hn::Gt(margin.v, hn::Zero(Lanes::D()));
  if (hn::AllTrue(Lanes::D(), regular)) return n;
  const stage::ShapePoint<Lanes> beside =
      stage::shape_tangents<Shape>(input, stage::towards_middle(u), stage::towards_middle(v));
  const Point m = stage::unit_normal(beside.by_u, beside.by_v, margin);
  const auto pick = [&](Lanes a, Lanes b) HWY_ATTR { return Lanes(hn::IfThenElse(regular, a.v, b.v)); };
  return {pick(n.x, m.x), pick(n.y, m.y), pick(n.z, m.z)};
}

// The stages after geometry.
template <class Shape>
HWY_INLINE void run_rest(const ArrayProgram& program, const stage::ShapePoint<Lanes>& p, Lanes u, Lanes v,
                         std::size_t first, SampleRegisters& registers) {
  run_view(program, p, 0, program.close != nullptr ? 1 : static_cast<std::size_t>(program.keys), first, registers);
  if (program.surface == nullptr) return;
  const Lanes depth = Lanes::load(&registers.at[0][SampleRegisters::kZ][first]);
  stage::PointRecord<Lanes> record;
  const Point color = stage::run_surface_stages(*program.surface, u, v, p.position,
                                                lane_normals<Shape>(*program.input, u, v, p), depth, record);
  color.x.store(&registers.r[first]);
  color.y.store(&registers.g[first]);
  color.z.store(&registers.b[first]);
}

template <class Shape>
HWY_NOINLINE void run_shape(const ArrayProgram& program, std::size_t count, SampleRegisters& registers) {
  for (std::size_t first = 0; first < count; first += Lanes::count()) {
    const Lanes u = Lanes::load(&registers.u[first]), v = Lanes::load(&registers.v[first]);
    run_rest<Shape>(program, stage::shape_tangents<Shape>(*program.input, u, v), u, v, first, registers);
    if (program.close != nullptr)
      run_view(program, stage::shape_tangents<Shape>(*program.close, u, v), 1, 2, first, registers);
  }
}

// Samples for which a program runs at a time: enough to pay for the dispatch of instructions, few enough for its
// registers to stay in the host's L1 cache.
constexpr std::size_t kProgramSamples = 64, kGroups = kProgramSamples / hn::MaxLanes(Lanes::D());

// Runs a program on samples `first` to `end` and calls visit(vector of them, register of a coordinate).
template <class Real, class Load, class Visit>
HWY_INLINE void run_groups(const shaders::ShapeInput& input, std::size_t first, std::size_t end, const Load& load,
                           const Visit& visit) {
  const shaders::Program& program = *input.program;
  const std::size_t groups = std::min<std::size_t>(kGroups, (end - first + Lanes::count() - 1) / Lanes::count());
  stage::ProgramRegisters<Real, kGroups> r;
  for (std::size_t g = 0; g < groups; ++g) {
    r.at[shaders::Program::kU][g] = load(true, first + g * Lanes::count());
    r.at[shaders::Program::kV][g] = load(false, first + g * Lanes::count());
  }
  stage::run_instructions<false, Real, kGroups>(program.instructions, input.constants, input.image, groups, r.at);
  for (std::size_t g = 0; g < groups; ++g)
    visit(first + g * Lanes::count(), r.at[program.result[0]][g], r.at[program.result[1]][g],
          r.at[program.result[2]][g]);
}

// Calls rest(first sample of a vector, its points) for the samples of a user's shape.
template <class Rest>
HWY_INLINE void run_program_points(const shaders::ShapeInput& input, std::size_t count,
                                   const SampleRegisters& registers, const Rest& rest) {
  using Tangent = stage::Dual<Lanes>;
  const Lanes one(1.0f), none(0.0f);
  for (std::size_t first = 0; first < count; first += kProgramSamples)
    run_groups<Tangent>(
        input, first, count,
        [&](bool is_u, std::size_t at) HWY_ATTR {
          return is_u ? Tangent(Lanes::load(&registers.u[at]), one, none)
                      : Tangent(Lanes::load(&registers.v[at]), none, one);
        },
        [&](std::size_t at, const Tangent& x, const Tangent& y, const Tangent& z) HWY_ATTR {
          rest(at, stage::ShapePoint<Lanes>{
                       {x.value, y.value, z.value}, {x.by_u, y.by_u, z.by_u}, {x.by_v, y.by_v, z.by_v}});
        });
}

HWY_NOINLINE void run_program(const ArrayProgram& program, std::size_t count, SampleRegisters& registers) {
  run_program_points(*program.input, count, registers, [&](std::size_t at, const stage::ShapePoint<Lanes>& p) HWY_ATTR {
    run_rest<stage::ProgramShape>(program, p, Lanes::load(&registers.u[at]), Lanes::load(&registers.v[at]), at,
                                  registers);
  });
  if (program.close != nullptr)
    run_program_points(*program.close, count, registers,
                       [&](std::size_t at, const stage::ShapePoint<Lanes>& p)
                           HWY_ATTR { run_view(program, p, 1, 2, at, registers); });
}

void RunProcedure(const ArrayProgram& program, std::size_t count, SampleRegisters& registers) {
  switch (program.shape) {
#define TESSERA_SHAPE_CASE(name)  \
  case shaders::ShapeId::k##name: \
    return run_shape<stage::name>(program, count, registers);
    TESSERA_SHAPES(TESSERA_SHAPE_CASE)
#undef TESSERA_SHAPE_CASE
    case shaders::ShapeId::kProgram:
      return run_program(program, count, registers);
  }
}

template <class Shape>
HWY_NOINLINE void shape_vertices(const shaders::ShapeInput& input, const float* u, const float* v, std::size_t count,
                                 PointArrays position) {
  for (std::size_t i = 0; i < count; i += Lanes::count()) {
    const Point p = Shape::point(input, Lanes::load(u + i), Lanes::load(v + i));
    p.x.store(position.x + i);
    p.y.store(position.y + i);
    p.z.store(position.z + i);
  }
}

HWY_NOINLINE void program_vertices(const shaders::ShapeInput& input, const float* u, const float* v, std::size_t count,
                                   PointArrays position) {
  for (std::size_t first = 0; first < count; first += kProgramSamples)
    run_groups<Lanes>(
        input, first, count, [&](bool is_u, std::size_t at) HWY_ATTR { return Lanes::load((is_u ? u : v) + at); },
        [&](std::size_t at, Lanes x, Lanes y, Lanes z) HWY_ATTR {
          x.store(position.x + at);
          y.store(position.y + at);
          z.store(position.z + at);
        });
}

void ProcedureVertices(shaders::ShapeId shape, const shaders::ShapeInput& input, const float* u, const float* v,
                       std::size_t count, PointArrays position) {
  switch (shape) {
#define TESSERA_SHAPE_CASE(name)  \
  case shaders::ShapeId::k##name: \
    return shape_vertices<stage::name>(input, u, v, count, position);
    TESSERA_SHAPES(TESSERA_SHAPE_CASE)
#undef TESSERA_SHAPE_CASE
    case shaders::ShapeId::kProgram:
      return program_vertices(input, u, v, count, position);
  }
}

}  // namespace tessera::tilecore::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::tilecore {

HWY_EXPORT(RunProcedure);
HWY_EXPORT(ProcedureVertices);

void run_procedure(const ArrayProgram& program, std::size_t count, SampleRegisters& registers) {
  HWY_DYNAMIC_DISPATCH(RunProcedure)(program, count, registers);
}
void procedure_vertices(shaders::ShapeId shape, const shaders::ShapeInput& input, const float* u, const float* v,
                        std::size_t count, PointArrays position) {
  HWY_DYNAMIC_DISPATCH(ProcedureVertices)(shape, input, u, v, count, position);
}

}  // namespace tessera::tilecore
#endif

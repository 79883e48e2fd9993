// Any bytes as a text of programs: a program that compiles is evaluated over every number type, anywhere.
#include <cmath>
#include <memory>

#include "frontend/bounds/enclosure_functions.h"
#include "shaders_cpp/procedures/operation_count.h"
#include "shaders_cpp/procedures/procedures.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/support/programs.h"
#include "tilecore/procedural/procedure_kernel.h"

namespace tessera::fuzz {
namespace {

using frontend::Enclosure;
using shaders::Program;

constexpr float kPlaces[] = {0.0f, 0.3f, 0.5f, 1.0f};

// PGM3, PGM4: nothing but its own registers and constants, and jumps that stay inside.
void check(const Program& program) {
  require(program.registers <= shaders::ProgramLimits::kRegisters, "more registers than there are");
  require(program.instructions.size() <= shaders::ProgramLimits::kInstructions, "more instructions than allowed");
  for (std::size_t k = 0; k < program.instructions.size(); ++k) {
    require(program.instructions[k].to < shaders::ProgramLimits::kRegisters, "a register that there is not");
    require(k + program.instructions[k].skip < program.instructions.size() ||
                program.instructions[k].operation == shaders::Operation::kSkip || program.instructions[k].skip == 0,
            "a jump out of the program");
  }
}

std::vector<float> constants_of(const Program& program, float first) {
  std::vector<float> numbers;
  for (const shaders::ParameterDeclaration& p : program.parameters)
    for (int k = 0; k < p.size; ++k) numbers.push_back(p.required() ? first : p.default_value);
  return program.bind(numbers);
}

void evaluate_shape(const Program& program) {
  static const shaders::GeometryImage kImage{2, 2, {0, 1, 0, 1}, {0, 0, 1, 1}, {0, 0, 0, 1}};
  const std::vector<float> constants = constants_of(program, 0.7f);
  shaders::ShapeInput in;
  in.program = &program, in.constants = constants.data(), in.image = &kImage;
  count_geometry(shaders::ShapeId::kProgram, in);
  const auto registers = std::make_unique<tilecore::SampleRegisters>();
  tilecore::ArrayProgram array;
  array.shape = shaders::ShapeId::kProgram, array.input = &in, array.divided = false, array.orthographic = true;
  for (std::size_t k = 0; k < 16; ++k) registers->u[k] = kPlaces[k % 4], registers->v[k] = kPlaces[k / 4];
  run_procedure(array, 16, *registers);
  for (std::size_t k = 0; k < 16; ++k) {
    const float u = kPlaces[k % 4], v = kPlaces[k / 4];
    const auto p = shaders::shape_tangents<shaders::ProgramShape>(in, u, v);
    const Vector3<float> alone = shaders::ProgramShape::point(in, u, v);
    shaders::ProgramShape::point(in, static_cast<double>(u), static_cast<double>(v));
    // Rows of the unit matrix keep finite numbers but for the sign of zero.
    if (std::isfinite(p.position.x + p.position.y + p.position.z))
      require(registers->at[0][tilecore::SampleRegisters::kX][k] == p.position.x, "lanes have other bits than floats");
    const Vector3<Enclosure> e = shaders::ProgramShape::point(
        in, Enclosure::first_parameter(static_cast<double>(u) * 0.9, static_cast<double>(u)),
        Enclosure::second_parameter(static_cast<double>(v), static_cast<double>(v)));
    for (const auto& [bound, value] : {std::pair(e.x, alone.x), std::pair(e.y, alone.y), std::pair(e.z, alone.z)})
      if (std::isfinite(value) && std::isfinite(bound.low()) && std::isfinite(bound.high()))
        require(static_cast<double>(value) >= bound.low() && static_cast<double>(value) <= bound.high(),
                "a point outside its enclosure");
  }
}

void evaluate_texture(const Program& program) {
  const std::vector<float> constants = constants_of(program, 0.7f);
  shaders::SurfaceProgram surface;
  surface.texture = shaders::TextureId::kProgram;
  surface.texture_program = &program, surface.texture_constants = constants.data();
  count_surface(surface);
  for (const float u : kPlaces) {
    shaders::PointRecord<float> record;
    shaders::run_surface_stages<float>(surface, u, 1 - u, {u * 100, -u, 1 / u}, {0, 1, 0}, 1, record);
  }
}

void run_text(Bytes input) {
  const std::string_view text(reinterpret_cast<const char*>(input.data()), input.size());
  const shaders::CompiledText compiled = shaders::compile_programs(text);
  if (compiled.fault) {
    require(compiled.fault->line >= 1 && compiled.fault->column >= 1 && !compiled.fault->message.empty(),
            "a fault without a place");
    return;
  }
  for (const auto& program : {compiled.programs.shape, compiled.programs.texture, compiled.programs.rates})
    if (program != nullptr) check(*program);
  if (compiled.programs.shape) evaluate_shape(*compiled.programs.shape);
  if (compiled.programs.texture) evaluate_texture(*compiled.programs.texture);
  if (compiled.programs.rates) {
    const double inputs[] = {0.5, 0.5, 0.1, 0.1, 2, 3, 0.25};
    program_rates(*compiled.programs.rates, constants_of(*compiled.programs.rates, 1).data(), inputs);
  }
}

std::vector<std::string> texts() {
  std::vector<std::string> all;
  for (const auto& [name, text] : test::builtin_programs()) all.emplace_back(text);
  all.emplace_back(
      "shape s { kinks; fn f(x) { var y = x; repeat 2 { y = y * y; } return y; } let a: vec2 = vec2(u, v).yx;\n"
      "return vec3(f(a.x) < 0.5 ? fract(a.y * 3) : clamp(v, 0.1, 0.2), mix(u, v, 0.5), length(a)); }\n"
      "texture t { return normalize(cross(normal, view)) * exp2(dot(world, object)); }");
  return all;
}

}  // namespace

const Target kProgramTarget{
    "program", "any bytes as a text of programs of `TESSERA_procedure`", 4 << 10, run_text, texts, nullptr};

}  // namespace tessera::fuzz

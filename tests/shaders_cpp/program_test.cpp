// Programs: built-in stages written in the language give the built-ins' bits and costs; any text compiles or is refused
// with its place.
#include "shaders_cpp/procedures/program.h"
#include "shaders_cpp/procedures/operation_count.h"
#include "shaders_cpp/procedures/procedures.h"
#include "tests/support/programs.h"
#include "tests/support/tests.h"

namespace tessera::shaders::program_test {
namespace {

bool same_bits(float a, float b) { return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b); }
bool same_bits(double a, double b) { return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b); }
template <class Real>
bool same_bits(const Vector3<Real>& a, const Vector3<Real>& b) {
  return same_bits(a.x, b.x) && same_bits(a.y, b.y) && same_bits(a.z, b.z);
}
template <class Real>
bool same_bits(const ShapePoint<Real>& a, const ShapePoint<Real>& b) {
  return same_bits(a.position, b.position) && same_bits(a.by_u, b.by_u) && same_bits(a.by_v, b.by_v);
}
bool same_counts(const OperationCount& a, const OperationCount& b) {
  return a.multiplies == b.multiplies && a.adds == b.adds && a.divides == b.divides &&
         a.square_roots == b.square_roots && a.comparisons == b.comparisons;
}

// ---- PGM1 -------------------------------------------------------------------------------------------------------

TEST(Programs, BuiltInShapesGiveTheirBits) {
  Random random(21);
  for (int trial = 0; trial < 5000; ++trial) {
    const auto id = static_cast<ShapeId>(trial % test::kShapeCount);
    const ShapeInput in = test::random_shape(random, id);
    const test::ShapeTwin twin(id, in);
    const float u = random.uniform(0, 1), v = random.uniform(0, 1);
    const auto du = static_cast<double>(u), dv = static_cast<double>(v);
    with_shape(id, [&](auto shape) {
      using Shape = decltype(shape);
      EXPECT_TRUE(same_bits(Shape::point(in, u, v), ProgramShape::point(twin.input, u, v))) << Shape::kName;
      EXPECT_TRUE(same_bits(Shape::point(in, du, dv), ProgramShape::point(twin.input, du, dv))) << Shape::kName;
      EXPECT_TRUE(same_bits(shape_tangents<Shape>(in, u, v), shape_tangents<ProgramShape>(twin.input, u, v)))
          << Shape::kName;
      EXPECT_TRUE(same_bits(shape_tangents<Shape>(in, du, dv), shape_tangents<ProgramShape>(twin.input, du, dv)))
          << Shape::kName;
    });
  }
}

TEST(Programs, BuiltInShapesCostTheirOperations) {
  Random random(22);
  for (int trial = 0; trial < 100; ++trial) {
    const auto id = static_cast<ShapeId>(trial % test::kShapeCount);
    const ShapeInput in = test::random_shape(random, id);
    const test::ShapeTwin twin(id, in);
    EXPECT_TRUE(same_counts(count_position(id, in), count_position(ShapeId::kProgram, twin.input))) << trial;
    EXPECT_TRUE(same_counts(count_geometry(id, in), count_geometry(ShapeId::kProgram, twin.input))) << trial;
  }
}

TEST(Programs, BuiltInShapesAreDeclaredAlike) {
  for (const StageDeclaration& stage : shape_declarations()) {
    const ProgramSet set = test::builtin(stage.name);
    ASSERT_NE(set.shape, nullptr) << stage.name;
    const StageDeclaration& own = set.shape->declaration;
    EXPECT_EQ(own.name, stage.name);
    EXPECT_EQ(own.meaning, stage.meaning);
    EXPECT_EQ(own.patches_u, stage.patches_u);
    EXPECT_EQ(own.patches_v, stage.patches_v);
    EXPECT_EQ(own.kinks, stage.kinks);
    ASSERT_EQ(own.parameters.size(), stage.parameters.size());
    for (std::size_t k = 0; k < own.parameters.size(); ++k) {
      const ParameterDeclaration &a = own.parameters[k], &b = stage.parameters[k];
      EXPECT_EQ(a.name, b.name);
      EXPECT_EQ(a.meaning, b.meaning);
      EXPECT_EQ(a.size, b.size);
      EXPECT_EQ(a.layout, b.layout);
      EXPECT_EQ(a.default_value, b.default_value);
      EXPECT_EQ(a.min, b.min);
      EXPECT_EQ(a.max, b.max);
    }
  }
}

TEST(Programs, BuiltInTexturesGiveTheirBitsAndCostTheirOperations) {
  Random random(23);
  for (int trial = 0; trial < 4000; ++trial) {
    const auto id = static_cast<TextureId>(trial % test::kTextureCount);
    SurfaceProgram plain, own;
    plain.texture = id;
    plain.shading = own.shading = ShadingId::kPhong;
    plain.texture_numbers = test::random_texture(random, id);
    const test::TextureTwin twin(id, plain.texture_numbers);
    twin.put(own);
    PointRecord<float> a, b;
    const Vector3<float> object = {random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-2, 2)};
    plain.pixel = own.pixel = random.uniform(0, 0.1f);
    const float u = random.uniform(0, 1), v = random.uniform(0, 1);
    run_surface_stages<float>(plain, u, v, object, {0, 1, 0}, 1, a);
    run_surface_stages<float>(own, u, v, object, {0, 1, 0}, 1, b);
    EXPECT_TRUE(same_bits(a.color, b.color)) << trial;
    if (trial < 40) {
      EXPECT_TRUE(same_counts(count_surface(plain), count_surface(own))) << trial;
    }
  }
}

// ---- The language -----------------------------------------------------------------------------------------------

// The first number of a shape's point.
float value_of(const std::string& statements, float u = 0.25f, float v = 0.75f) {
  const CompiledText compiled = compile_programs("shape s {" + statements + "}");
  EXPECT_FALSE(compiled.fault) << compiled.fault->line << ":" << compiled.fault->column << ": "
                               << compiled.fault->message;
  if (compiled.fault) return 0;
  const Program& program = *compiled.programs.shape;
  const std::vector<float> constants = program.bind(std::array<float, kBlockNumbers>{2, 3});
  ShapeInput in;
  in.program = &program;
  in.constants = constants.data();
  return ProgramShape::point(in, u, v).x;
}

TEST(Programs, ExpressionsEvaluateToKnownValues) {
  EXPECT_EQ(value_of("return vec3(1 + 2 * 3 - 4 / 2);"), 5.0f);
  EXPECT_EQ(value_of("return vec3(u < v ? 1 : 2);"), 1.0f);
  EXPECT_EQ(value_of("return vec3(u > v ? 1 : 2);"), 2.0f);
  EXPECT_EQ(value_of("return vec3(-u - -v);"), 0.5f);
  EXPECT_EQ(value_of("return vec3(dot(vec3(u, v, 1), vec3(4, 4, 1)));"), 5.0f);
  EXPECT_EQ(value_of("return cross(vec3(0, u, 0), vec3(0, 0, 4));"), 1.0f);
  EXPECT_EQ(value_of("return vec3(length(vec2(3, 4)));"), 5.0f);
  EXPECT_EQ(value_of("return normalize(vec3(8, 0, 0));"), 1.0f);
  EXPECT_EQ(value_of("return vec3(1, 2, 3).zyx;"), 3.0f);
  EXPECT_EQ(value_of("return vec3(clamp(4 * v, 0, 1) + floor(u * 9) + fract(1.25));"), 3.25f);
  EXPECT_EQ(value_of("return vec3(mix(2, 4, u) + min(u, v) + max(1, v) + abs(0 - v));"), 4.5f);
  EXPECT_EQ(value_of("return vec3(sincos(u).x + sqrt(v * 12) + smooth(v - u));"), 4.5f);
}

TEST(Programs, VariablesKeepTheirOrder) {
  EXPECT_EQ(value_of("var a = u; let old = a; a = a + 1; return vec3(old);"), 0.25f);
  EXPECT_EQ(value_of("var p = vec2(u, v); p = p.yx; return vec3(p.x * 10 + p.y);"), 7.75f);
  EXPECT_EQ(value_of("var p = vec2(u * v); p = vec2(p.x + 1); return vec3(p.x - p.y);"), 0.0f);
  EXPECT_EQ(value_of("var a = 0; repeat 4 as k { a = a + k; } return vec3(a + u);"), 6.25f);
  EXPECT_EQ(value_of("var a = 0; repeat 4 { repeat 3 { a = a + u; } } return vec3(a);"), 3.0f);
  EXPECT_EQ(value_of("var a = u; repeat 3 { var b = a * 2; b = b + a; a = b; } return vec3(a);"), 6.75f);
}

TEST(Programs, RepetitionsEndWhereTheirUniformSays) {
  const std::string head = "param n = 1; param step = 1; var a = 0; uniform s = 1;";
  EXPECT_EQ(value_of(head + "repeat 8 as k while k < n { a = a + u; s = s * step; } return vec3(a + s);"), 9.5f);
  EXPECT_EQ(value_of(head + "repeat 8 as k while k < n { repeat 4 as j while j < k { a = a + 1; } } return vec3(a);"),
            1.0f);
  EXPECT_EQ(value_of(head + "repeat 8 as k while k < 3 { a = a + 1; } return vec3(a);"), 3.0f);
}

TEST(Programs, FunctionsSeeTheirArgumentsAndEarlierDeclarations) {
  EXPECT_EQ(value_of("let a = 2; fn f(x) = x * a; fn g(x) { var y = f(x); y = y + 1; return y; } return vec3(g(v));"),
            2.5f);
  EXPECT_EQ(value_of("fn f(x) { var y = x; repeat 2 { y = y * 3; } return y; } uniform a = 2; return vec3(f(a));"),
            18.0f);
  EXPECT_EQ(value_of("param n; fn f(x) { var y = x; y = y + 1; return y; } uniform a = f(n); return vec3(a);"), 3.0f);
}

TEST(Programs, UnreadExpressionsCostNothing) {
  const CompiledText with = compile_programs("shape s { let a = sincos(u * 3); return vec3(u, v, 1); }");
  ASSERT_FALSE(with.fault);
  EXPECT_EQ(with.programs.shape->instructions.size(), 1u);  // the constant
}

TEST(Programs, RatesAreComputedInDouble) {
  const CompiledText compiled =
      compile_programs("rates fine { param more = 2; return vec2(reach.x * more / spacing, size.y + u); }");
  ASSERT_FALSE(compiled.fault);
  const std::vector<float> constants = compiled.programs.rates->bind(std::array<float, 1>{2});
  const double inputs[] = {0.5, 0, 0.125, 0.25, 0.1, 0, 0.3};
  const auto steps = program_rates(*compiled.programs.rates, constants.data(), inputs);
  EXPECT_EQ(steps[0], 0.1 * 2 / 0.3);
  EXPECT_EQ(steps[1], 0.75);
}

// ---- PGM2 -------------------------------------------------------------------------------------------------------

std::string refusal(std::string_view text) {
  const CompiledText compiled = compile_programs(text);
  if (!compiled.fault) return "";
  EXPECT_EQ(compiled.programs.shape, nullptr);
  return std::to_string(compiled.fault->line) + ":" + std::to_string(compiled.fault->column) + ": " +
         compiled.fault->message;
}

TEST(Programs, FaultsHaveTheirLineAndColumn) {
  const std::pair<const char*, const char*> cases[] = {
      {"", "1:1: there is no program"},
      {"sphere", "1:1: expected 'shape', 'texture' or 'rates', found 'sphere'"},
      {"shape s {\n  return vec3(u, v, w);\n}", "2:21: 'w' is not known"},
      {"shape s { return vec2(u, v); }", "1:30: the program returns a vec2, not a vec3"},
      {"shape s { }", "1:11: the program returns nothing"},
      {"shape s {\n\tlet a = vec2(1, 2) + vec3(1);\n return vec3(0); }", "2:21: a vec2 and a vec3 do not go together"},
      {"shape s { let a: vec3 = u; return a; }", "1:25: 'a' is a vec3, the value is a number"},
      {"shape s { let a = 1; a = 2; return vec3(a); }", "1:22: 'a' is not a 'var' or 'uniform'"},
      {"shape s { uniform a = u; return vec3(a); }",
       "1:23: a uniform cannot depend on numbers that differ between samples"},
      {"shape s { uniform a = u + 1; return vec3(a); }",
       "1:25: a uniform cannot depend on numbers that differ between samples"},
      {"shape s { return vec3(noise(u, v, 1)); }", "1:23: only a texture may use noise in space"},
      {"shape s { return vec3(exp2(u)); }", "1:23: only a texture may use 'exp2'"},
      {"texture t { return vec3(image(u, v)); }", "1:25: only a shape may use 'image'"},
      {"shape s { return vec3(sqrt(u, v)); }", "1:23: 'sqrt' takes 1 argument, not 2"},
      {"shape s { return vec3(what(u)); }", "1:23: there is no function 'what'"},
      {"shape s { fn f(x) = f(x); return vec3(f(u)); }", "1:21: there is no function 'f'"},
      {"shape s { param a: float[3]; return a; }", "1:40: the program returns a row of 3 numbers, not a vec3"},
      {"shape s { param a: float[3]; return vec3(a[3]); }", "1:44: the index is 3, outside 0 to 2"},
      {"shape s { param a: float[3]; return vec3(a[u]); }",
       "1:44: an index must be known when the program is compiled"},
      {"shape s { param a: float[49]; }", "1:26: expected a whole number from 1 to 48"},
      {"shape s { param a = 2 in [0, 1]; }", "1:21: the default lies outside the range"},
      {"shape s { param a: chain w; }", "1:26: a chain runs along u or v"},
      {"shape s { param u = 1; }", "1:17: 'u' is taken"},
      {"shape s { param let = 1; }", "1:17: 'let' is a word of the language"},
      {"shape s { patches 3, 1; }", "1:19: patches are a power of two"},
      {"shape s { repeat 33 { } }", "1:18: expected a whole number from 1 to 32"},
      {"shape s { repeat 2 { return u; } }", "1:22: a repetition cannot return"},
      {"shape s { repeat 2 as k while u < k { } }",
       "1:31: repetitions cannot depend on numbers that differ between samples"},
      {"shape s { return vec3(1); let a = 1; }", "1:27: nothing may follow 'return'"},
      {"shape s { return vec3(1).w; }", "1:26: a vec3 has no component 'w'"},
      {"shape s { return vec3(1e99); }", "1:23: the number is beyond single precision"},
      {"shape s { return vec3(1x); }", "1:24: 'x' after a number"},
      {"shape s \"no end", "1:9: the text does not end on its line, or is not plain ASCII"},
      {"shape s { @ }", "1:11: '@' means nothing here"},
      {"shape s { \xc3\xa4 }", "1:11: byte 0xc3 means nothing here"},
      {"shape s { return vec3(1) }", "1:26: expected ';', found '}'"},
      {"shape s { return vec3(1);", "1:26: nothing may follow 'return'"},
      {"shape s { fn f() { let a = 1;", "1:18: the block does not end"},
      {"shape s { return vec3(0); }\nshape t { return vec3(0); }", "2:1: a second shape"},
      {"rates r { param a: chain u; return vec2(1, 1); }", "1:20: only shapes have chains"},
  };
  for (const auto& [text, expected] : cases) EXPECT_EQ(refusal(text), expected) << text;
}

TEST(Programs, LimitsAreStated) {
  EXPECT_THAT(refusal(std::string(ProgramLimits::kSourceBytes + 1, ' ')), HasSubstr("more than 16384"));
  std::string deep = "shape s { return vec3(";
  for (int k = 0; k < 1000; ++k) deep += "(";
  EXPECT_THAT(refusal(deep), HasSubstr("more than 48 expressions, blocks and calls inside each other"));
  std::string minus = "shape s { return vec3(" + std::string(1000, '-') + "u); }";
  EXPECT_THAT(refusal(minus), HasSubstr("inside each other"));
  EXPECT_THAT(refusal("shape s { var a = u; repeat 32 { repeat 32 { a = a * u + v * a; } } return vec3(a); }"),
              HasSubstr("more than 1024 instructions"));
  std::string wide = "shape s { param n; ";
  for (int k = 0; k < 300; ++k) wide += "uniform a" + std::to_string(k) + " = n + 1;";
  EXPECT_THAT(refusal(wide), HasSubstr("more than 256 parameters, uniforms and literals"));
  std::string many = "shape s { ", total = "0";
  for (int k = 0; k < 70; ++k) {
    many += "let a" + std::to_string(k) + " = sqrt(u + " + std::to_string(k) + ");";
    total = "(" + std::string("a") + std::to_string(k) + " + v)" + (k == 0 ? "" : " * 2");
  }
  many += "var t = 0;";
  for (int k = 0; k < 70; ++k) many += "t = t * v + a" + std::to_string(k) + ";";
  EXPECT_THAT(refusal(many + "return vec3(t); }"), HasSubstr("more than 64 numbers are needed at one time"));
  // Calls that fold to nothing end, too.
  std::string calls = "shape s { fn f0(x) = x + 1;";
  for (int k = 1; k < 12; ++k) {
    const std::string before = "f" + std::to_string(k - 1) + "(x)";
    calls += "fn f" + std::to_string(k) + "(x) = " + before + " + " + before + " + " + before + ";";
  }
  EXPECT_THAT(refusal(calls + "return vec3(f11(1)); }"), HasSubstr("calls and repetitions make the program longer"));
  std::string names = "shape s { ";
  for (int k = 0; k < 600; ++k) names += "let a" + std::to_string(k) + "=1;";
  EXPECT_THAT(refusal(names), HasSubstr("more than 512 names"));
}

TEST(Programs, EveryCutTextIsRefused) {
  for (const auto& [name, text] : test::builtin_programs())
    for (std::size_t size = 0; size + 3 < text.size(); ++size)
      EXPECT_NE(refusal(text.substr(0, size)), "") << name << " " << size;
}

// ---- PGM3, PGM4 -------------------------------------------------------------------------------------------------

// Operands that are registers, and the register or registers written.
TEST(Programs, InstructionsStayInsideTheirRegisters) {
  for (const auto& [name, text] : test::builtin_programs()) {
    const CompiledText compiled = compile_programs(text);
    ASSERT_FALSE(compiled.fault) << name << " " << compiled.fault->line << " " << compiled.fault->message;
    for (const auto& program : {compiled.programs.shape, compiled.programs.texture}) {
      if (program == nullptr) continue;
      for (std::size_t k = 0; k < program->instructions.size(); ++k) {
        EXPECT_LT(program->instructions[k].to, program->registers);
        EXPECT_LE(k + program->instructions[k].skip, program->instructions.size());
      }
      for (const std::uint8_t r : program->result) EXPECT_LT(r, program->registers);
    }
  }
}

}  // namespace
}  // namespace tessera::shaders::program_test

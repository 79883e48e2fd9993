#include "shaders_cpp/procedures/program_compiler.h"

#include <fmt/format.h>

namespace tessera::shaders {
namespace program_text {
namespace {

using Numbers = std::vector<Scalar>;

void need(const BuiltinCall& call, std::size_t count) {
  if (call.arguments.size() != count)
    refuse(call.name, fmt::format("'{}' takes {} {}, not {}", call.name.text, count,
                                  count == 1 ? "argument" : "arguments", call.arguments.size()));
}

void need_kind(const BuiltinCall& call, ProgramKind kind) {
  if (call.kind != kind)
    refuse(call.name, fmt::format("only a {} may use '{}'", program_kind_name(kind), call.name.text));
}

Scalar sum_of(Emitter& e, const Scalar& a, const Scalar& b) { return e.binary(Operation::kAdd, a, b); }
Scalar product_of(Emitter& e, const Scalar& a, const Scalar& b) { return e.binary(Operation::kMultiply, a, b); }

Scalar dot_of(const BuiltinCall& call, const Numbers& a, const Numbers& b) {
  if (a.size() != b.size() || a.size() < 2)
    refuse(call.name, fmt::format("'{}' takes vectors of one size", call.name.text));
  Scalar out = product_of(call.emitter, a[0], b[0]);
  for (std::size_t k = 1; k < a.size(); ++k) out = sum_of(call.emitter, out, product_of(call.emitter, a[k], b[k]));
  return out;
}

Numbers cross_of(const BuiltinCall& call, const Numbers& a, const Numbers& b) {
  if (a.size() != 3 || b.size() != 3) refuse(call.name, "'cross' takes two vec3");
  Numbers out;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t i = (k + 1) % 3, j = (k + 2) % 3;
    const Scalar first = product_of(call.emitter, a[i], b[j]), second = product_of(call.emitter, a[j], b[i]);
    out.push_back(call.emitter.binary(Operation::kSubtract, first, second));
  }
  return out;
}

// Coordinates, given as numbers or as one vector.
Numbers coordinates(const BuiltinCall& call) {
  Numbers out;
  for (const Numbers& n : call.arguments) out.insert(out.end(), n.begin(), n.end());
  return out;
}

Numbers noise_of(const BuiltinCall& call) {
  const Numbers at = coordinates(call);
  if (at.size() == 2) return {call.emitter.operate(Operation::kPlaneNoise, at)};
  if (at.size() != 3) refuse(call.name, fmt::format("'noise' takes two or three numbers, not {}", at.size()));
  if (call.kind != ProgramKind::kTexture) refuse(call.name, "only a texture may use noise in space");
  return {call.emitter.operate(Operation::kSpaceNoise, at)};
}

}  // namespace

std::optional<Numbers> call_on_vectors(const BuiltinCall& call) {
  Emitter& e = call.emitter;
  const std::string_view name = call.name.text;
  const auto& arguments = call.arguments;
  if (name == "dot") {
    need(call, 2);
    return Numbers{dot_of(call, arguments[0], arguments[1])};
  }
  if (name == "cross") {
    need(call, 2);
    return cross_of(call, arguments[0], arguments[1]);
  }
  if (name == "length") {
    need(call, 1);
    return Numbers{e.unary(Operation::kSquareRoot, dot_of(call, arguments[0], arguments[0]))};
  }
  if (name == "normalize") {
    need(call, 1);
    const Scalar square = e.binary(Operation::kMax, dot_of(call, arguments[0], arguments[0]), Emitter::literal(1e-30f));
    const Scalar inverse =
        e.binary(Operation::kDivide, Emitter::literal(1.0f), e.unary(Operation::kSquareRoot, square));
    Numbers out;
    for (const Scalar& s : arguments[0]) out.push_back(product_of(e, s, inverse));
    return out;
  }
  if (name == "sincos") {
    need(call, 1);
    if (arguments[0].size() != 1) refuse(call.name, "'sincos' takes one number");
    const std::array<Scalar, 2> out = e.sine_cosine(arguments[0][0]);
    return Numbers{out[0], out[1]};
  }
  if (name == "noise") return noise_of(call);
  if (name == "image") {
    need_kind(call, ProgramKind::kShape);
    const Numbers at = coordinates(call);
    if (at.size() != 2) refuse(call.name, fmt::format("'image' takes two numbers, not {}", at.size()));
    Numbers out;
    for (int plane = 0; plane < 3; ++plane) out.push_back(e.operate(Operation::kImage, at, plane));
    return out;
  }
  return std::nullopt;
}

std::optional<NumberFunction> number_function(const BuiltinCall& call) {
  const std::string_view name = call.name.text;
  const auto unary = [&](Operation operation) -> NumberFunction {
    need(call, 1);
    return [operation](Emitter& e, const Numbers& n) { return e.unary(operation, n[0]); };
  };
  const auto binary = [&](Operation operation) -> NumberFunction {
    need(call, 2);
    return [operation](Emitter& e, const Numbers& n) { return e.binary(operation, n[0], n[1]); };
  };
  if (name == "sqrt") return unary(Operation::kSquareRoot);
  if (name == "abs") return unary(Operation::kAbsolute);
  if (name == "floor") return unary(Operation::kRoundDown);
  if (name == "smooth") return unary(Operation::kSmoothStep);
  if (name == "min") return binary(Operation::kMin);
  if (name == "max") return binary(Operation::kMax);
  if (name == "exp2") {
    need_kind(call, ProgramKind::kTexture);
    return unary(Operation::kPowerOfTwo);
  }
  if (name == "fract") {
    need(call, 1);
    return [](Emitter& e, const Numbers& n) {
      return e.binary(Operation::kSubtract, n[0], e.unary(Operation::kRoundDown, n[0]));
    };
  }
  if (name == "clamp") {
    need(call, 3);
    return [](Emitter& e, const Numbers& n) {
      return e.binary(Operation::kMin, e.binary(Operation::kMax, n[0], n[1]), n[2]);
    };
  }
  if (name == "mix") {
    need(call, 3);
    return [](Emitter& e, const Numbers& n) {
      return sum_of(e, n[0], product_of(e, e.binary(Operation::kSubtract, n[1], n[0]), n[2]));
    };
  }
  return std::nullopt;
}

}  // namespace program_text

std::vector<LanguageRow> program_language() {
  using Limits = ProgramLimits;
  std::vector<LanguageRow> rows = {
      {"shape NAME \"meaning\" { ... return vec3(x, y, z); }", "program",
       "A point of object space; du x dv points outwards. Tangents, normals, bounds and vertices follow from it."},
      {"texture NAME \"meaning\" { ... return vec3(r, g, b); }", "program", "A linear colour."},
      {"rates NAME \"meaning\" { ... return vec2(along u, along v); }", "program",
       "Samples of a cell of the parameter map, in double precision, rounded up. Without one: 2 reach / spacing. Fewer "
       "leave holes."},
      {"patches U, V;", "declaration", "Shapes: base patches of a piece where it is tessellated, powers of two."},
      {"kinks;", "declaration", "Shapes: derivatives may jump inside a piece."},
      {"param NAME: TYPE = DEFAULT in [MIN, MAX] \"meaning\";", "declaration",
       "A number that the capture may give. TYPE: float (the default), vec2 to vec4, float[N], or chain u and chain v: "
       "8 numbers, the control points (a, b) of one cubic of a chain. DEFAULT and range may be left out, the default "
       "then is required. Parameters come first."},
      {"fn NAME(a, b) { ... return VALUE; }", "declaration",
       "A function of values of any type, or fn NAME(a, b) = VALUE; it may call earlier functions, and is copied to "
       "where it is called."},
      {"let NAME = VALUE;", "statement", "A value; `let NAME: vec3` checks its type."},
      {"var NAME = VALUE; NAME = VALUE;", "statement", "A value that may be assigned to."},
      {"uniform NAME = VALUE;", "statement",
       "A value of parameters and literals alone, computed once per piece; it may be assigned to. Everything else is "
       "computed, and counted, per sample as it is written; only operations on literals are folded."},
      {"repeat N as K while UNIFORM < UNIFORM { ... }", "statement",
       fmt::format(
           "Copies its body N times, at most {}, with K = 0, 1, ...; ends where the condition, if there is one, "
           "fails.",
           Limits::kRepetitions)},
      {"+ - * /", "operator", "Number by number; a single number combines with every vector. -x is 0 - x."},
      {"x < y ? a : b, x > y ? a : b", "operator",
       "Selection: both are computed. In shapes bounds are tight only where one side is certain."},
      {"v.x, v.rgb, row[2]", "operator", "Components; indices must be known when the program is compiled."},
      {"sqrt(x), abs(x), floor(x), fract(x), min(x, y), max(x, y), clamp(x, low, high)", "function",
       "Number by number; fract(x) = x - floor(x)."},
      {"smooth(x)", "function", "t t (3 - 2 t) with t = x limited to [0, 1]."},
      {"mix(x, y, t)", "function", "x + (y - x) t."},
      {"sincos(turns)", "function", "vec2 of sine and cosine; exact at whole quarter turns."},
      {"dot(a, b), cross(a, b), length(a), normalize(a)", "function", "Functions of vectors."},
      {"vec2(...), vec3(...), vec4(...)", "function", "The numbers of all arguments; one number fills the vector."},
      {"noise(x, y)", "function", "Gradient noise in the plane, in [-1, 1], of one lattice point per unit."},
      {"noise(x, y, z)", "function", "Textures: smooth value noise in space, in [-1, 1]."},
      {"exp2(x)", "function", "Textures: 2 to the power x, x limited to [-126, 126]."},
      {"image(u, v)", "function", "Shapes: the point of the capture's `image`, bilinear."},
      {"limits", "program",
       fmt::format("{} bytes of text, {} instructions, {} numbers at one time, {} parameters, uniforms and literals, "
                   "{} numbers of parameters, {} levels of nesting, {} words with calls and repetitions written out.",
                   Limits::kSourceBytes, Limits::kInstructions, Limits::kRegisters, Limits::kConstants, kBlockNumbers,
                   Limits::kDepth, Limits::kSteps)}};
  for (const ProgramKind kind : {ProgramKind::kShape, ProgramKind::kTexture, ProgramKind::kRates})
    for (const ProgramInput& input : program_inputs(kind))
      rows.push_back({fmt::format("{}{}", input.name, input.size == 1 ? "" : fmt::format(" (vec{})", input.size)),
                      fmt::format("input of {}", program_kind_name(kind)), std::string(input.meaning) + "."});
  return rows;
}

}  // namespace tessera::shaders

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "shaders_cpp/procedures/declarations.h"

namespace tessera::shaders {

// Stages that users write: a small expression language, compiled once to a flat list of instructions that program.inc
// evaluates over the same number types as the built-in stages. The language: `tessera describe procedures`.
//
// Invariants (cited by the tests):
//   PGM1  A built-in stage written as a program (builtin_stages.txt) gives the built-in's bits over floats, lanes, tangents and
//         enclosures, and costs the same operations.
//   PGM2  Any text is compiled or refused with the line and the column of its fault, within the limits below.
//   PGM3  A compiled program reads registers that were written, and nothing outside its registers and constants.
//   PGM4  Evaluation ends: instructions run in order, jumps lead forward.

enum class ProgramKind : std::uint8_t { kShape, kTexture, kRates };

struct ProgramLimits {
  static constexpr std::size_t kSourceBytes = 16384;           // of a text
  static constexpr std::size_t kInstructions = 1024;           // of a program
  static constexpr std::size_t kSetup = 1024;                  // instructions that compute uniforms
  static constexpr std::size_t kRegisters = 64;                // at one time
  static constexpr std::size_t kConstants = 256;               // parameters, uniforms and literals
  static constexpr std::size_t kRepetitions = 32;              // of one `repeat`
  static constexpr std::size_t kNames = 512;                   // at one place; as many functions
  static constexpr std::size_t kDepth = 48;                    // of expressions, blocks and calls inside each other
  static constexpr std::size_t kSteps = std::size_t{1} << 17;  // tokens read, those of calls and repetitions each time
};

// ---- Instructions -----------------------------------------------------------------------------------------------

// X(name, operands): registers a, b, c, d give register `to`. Of the forms of a two-operand instruction, C has constant
// b for its second operand, and From constant a for its first. A product with what follows it, a * b + c, a * b - c and
// c - a * b, has the forms C for a constant b and a constant c; the sum of two products, a * b + c * d, one for constants
// b and d.
// clang-format off
#define TESSERA_PROGRAM_BINARIES(X) X(Add) X(Subtract) X(Multiply) X(Divide) X(Min) X(Max)
#define TESSERA_PROGRAM_OPERATIONS(X) \
  X(Constant) X(Copy) X(Skip) \
  X(Add) X(AddC) X(AddFrom) X(Subtract) X(SubtractC) X(SubtractFrom) X(Multiply) X(MultiplyC) X(MultiplyFrom) \
  X(Divide) X(DivideC) X(DivideFrom) X(Min) X(MinC) X(MinFrom) X(Max) X(MaxC) X(MaxFrom) \
  X(MultiplyAdd) X(MultiplyCAdd) X(MultiplyAddC) X(MultiplyCAddC) \
  X(MultiplySubtract) X(MultiplyCSubtract) X(MultiplySubtractC) X(MultiplyCSubtractC) \
  X(MultiplyRest) X(MultiplyCRest) X(MultiplyRestC) X(MultiplyCRestC) X(ProductSum) X(ProductSumC) \
  X(SquareRoot) X(Absolute) X(RoundDown) X(SmoothStep) X(PowerOfTwo) X(SineCosine) X(SelectLess) X(PlaneNoise) \
  X(SpaceNoise) X(Image)
// clang-format on

enum class Operation : std::uint8_t {
#define TESSERA_PROGRAM_NAME(name) k##name,
  TESSERA_PROGRAM_OPERATIONS(TESSERA_PROGRAM_NAME)
#undef TESSERA_PROGRAM_NAME
};

struct Instruction {
  Operation operation = Operation::kConstant;
  std::uint8_t to = 0, a = 0, b = 0, c = 0, d = 0;  // of kSineCosine, d takes the cosine; of kImage, c is the plane
  std::uint16_t skip = 0;                           // kSkip: instructions left out unless constant a is positive
};

// ---- Programs ---------------------------------------------------------------------------------------------------

// What a program may read besides its parameters, in the order in which evaluators hand it over.
struct ProgramInput {
  std::string_view name;
  int size;
  std::string_view meaning;
};
std::span<const ProgramInput> program_inputs(ProgramKind kind);
std::string_view program_kind_name(ProgramKind kind);

// Numbers of its result: a point, a colour, samples along u and v.
inline constexpr std::size_t program_result_size(ProgramKind kind) { return kind == ProgramKind::kRates ? 2 : 3; }

// One compiled stage. Immovable: the declaration looks into its own text.
struct Program {
  // An input number and the register that holds it at the start.
  struct Input {
    std::uint8_t number, to;
  };

  Program() = default;
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  ProgramKind kind = ProgramKind::kShape;
  std::shared_ptr<const std::string> source;
  StageDeclaration declaration;
  std::vector<ParameterDeclaration> parameters;  // what the declaration points at
  bool reads_image = false;
  std::vector<Instruction> setup;         // on the constants alone: a, b, c, d and `to` are constants
  std::vector<Instruction> instructions;  // per evaluation
  // Those that are read; a shape has u and v in fixed registers, read or not.
  static constexpr std::size_t kU = 0, kV = 1;
  std::vector<Input> inputs;
  std::vector<float> constants;  // parameters, then what setup computes and literals
  std::array<std::uint8_t, 3> result{};
  std::size_t parameter_numbers = 0, registers = 0;

  // Constants for the numbers of the parameters.
  std::vector<float> bind(std::span<const float> numbers) const;
};

// Of one text, at most one of each kind.
struct ProgramSet {
  std::shared_ptr<const Program> shape, texture, rates;
};

struct ProgramFault {
  int line = 1, column = 1;  // from 1, in bytes
  std::string message;
};

struct CompiledText {
  ProgramSet programs;
  std::optional<ProgramFault> fault;  // no programs then
};
CompiledText compile_programs(std::string_view text);

// Samples along u and along v that a program of rates asks for. `inputs` as program_inputs(kRates) has them.
std::array<double, 2> program_rates(const Program& program, const float* constants, std::span<const double> inputs);

// ---- For people -------------------------------------------------------------------------------------------------

// One thing that programs may say.
struct LanguageRow {
  std::string name, kind, meaning;
};
std::vector<LanguageRow> program_language();

}  // namespace tessera::shaders

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

// Stages that users write in a small expression language. A text is compiled once to a flat list of instructions, which
// program.inc evaluates over the same number types as the built-in stages. `tessera describe procedures` shows the language.
//
// Invariants (cited by the tests):
//   PGM1  A built-in stage written as a program (builtin_stages.txt) gives the built-in's bits over floats, lanes, tangents and
//         enclosures, and costs the same operations.
//   PGM2  Any text is compiled or refused with the line and the column of its fault, within the limits below.
//   PGM3  A compiled program reads only registers that were written, and nothing outside its registers and constants.
//   PGM4  Evaluation ends: instructions run in order, jumps lead forward.

enum class ProgramKind : std::uint8_t { kShape, kTexture, kRates };

struct ProgramLimits {
  static constexpr std::size_t kSourceBytes = 16384;           // bytes of a text
  static constexpr std::size_t kInstructions = 1024;           // instructions of a program
  static constexpr std::size_t kSetup = 1024;                  // instructions that compute uniforms
  static constexpr std::size_t kRegisters = 64;                // at one time
  static constexpr std::size_t kConstants = 256;               // parameters, uniforms and literals
  static constexpr std::size_t kRepetitions = 32;              // repetitions of one `repeat`
  static constexpr std::size_t kNames = 512;                   // names visible at one place, and functions
  static constexpr std::size_t kDepth = 48;                    // nesting of expressions, blocks and calls
  static constexpr std::size_t kSteps = std::size_t{1} << 17;  // tokens read; calls and repetitions count each time
};

// ---- Instructions -----------------------------------------------------------------------------------------------

// X(name, operands): the instruction computes register `to` from registers a, b, c, d. Forms of a two-operand
// instruction: C takes constant b as its second operand, From takes constant a as its first. Fused products a * b +
// c, a * b - c and c - a * b have forms C for a constant b and for a constant c; the sum of two products, a * b + c *
// d, has one for constants b and d.
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
  std::uint8_t to = 0, a = 0, b = 0, c = 0, d = 0;  // kSineCosine writes the cosine to d; c of kImage is the plane
  std::uint16_t skip = 0;  // kSkip: number of instructions to skip unless constant a is positive
};

// ---- Programs ---------------------------------------------------------------------------------------------------

// Inputs of a program besides its parameters, in the order in which evaluators pass them.
struct ProgramInput {
  std::string_view name;
  int size;
  std::string_view meaning;
};
std::span<const ProgramInput> program_inputs(ProgramKind kind);
std::string_view program_kind_name(ProgramKind kind);

// Numbers of a program's result: a point, a colour, or samples along u and v.
inline constexpr std::size_t program_result_size(ProgramKind kind) { return kind == ProgramKind::kRates ? 2 : 3; }

// One compiled stage. Not movable, as the declaration points into its own text.
struct Program {
  // An input number, and the register that holds it at the start.
  struct Input {
    std::uint8_t number, to;
  };

  Program() = default;
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  ProgramKind kind = ProgramKind::kShape;
  std::shared_ptr<const std::string> source;
  StageDeclaration declaration;
  std::vector<ParameterDeclaration> parameters;  // parameters that the declaration points at
  bool reads_image = false;
  std::vector<Instruction> setup;         // run on the constants alone: a, b, c, d and `to` are constants
  std::vector<Instruction> instructions;  // per evaluation
  // Inputs that are read. A shape has u and v in fixed registers, read or not.
  static constexpr std::size_t kU = 0, kV = 1;
  std::vector<Input> inputs;
  std::vector<float> constants;  // parameters, then results of setup and literals
  std::array<std::uint8_t, 3> result{};
  std::size_t parameter_numbers = 0, registers = 0;

  // Computes the constants for given parameters.
  std::vector<float> bind(std::span<const float> numbers) const;
};

// The programs of one text, at most one of each kind.
struct ProgramSet {
  std::shared_ptr<const Program> shape, texture, rates;
};

struct ProgramFault {
  int line = 1, column = 1;  // from 1, in bytes
  std::string message;
};

struct CompiledText {
  ProgramSet programs;
  std::optional<ProgramFault> fault;  // if set, there are no programs
};
CompiledText compile_programs(std::string_view text);

// Samples along u and along v that a program of rates requests. `inputs`: in the order of program_inputs(kRates).
std::array<double, 2> program_rates(const Program& program, const float* constants, std::span<const double> inputs);

// ---- For people -------------------------------------------------------------------------------------------------

// One element of the language.
struct LanguageRow {
  std::string name, kind, meaning;
};
std::vector<LanguageRow> program_language();

}  // namespace tessera::shaders

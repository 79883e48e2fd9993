#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string_view>
#include <vector>

#include "shaders_cpp/procedures/program.h"

namespace tessera::shaders::program_text {

// A word of a program's text.
struct Token {
  enum class Kind : std::uint8_t { kName, kNumber, kText, kSymbol, kEnd };
  Kind kind = Kind::kEnd;
  std::string_view text;  // without quotes for kText
  float value = 0;        // for kNumber
  int line = 1, column = 1;
};

// Thrown inside the compiler; compile_programs() turns it into a value.
struct Fault {
  ProgramFault fault;
};
[[noreturn]] void refuse(const Token& at, std::string message);

// The name of a token in messages.
std::string shown(const Token& token);

// All tokens of a text of at most ProgramLimits::kSourceBytes; the last is kEnd. Views into `text`.
std::vector<Token> split(std::string_view text);

// One number of an expression: known at compile time, the same for all samples, or different for each sample.
struct Scalar {
  enum class Kind : std::uint8_t { kLiteral, kUniform, kVarying };
  Kind kind = Kind::kLiteral;
  float value = 0;  // kLiteral
  int index = 0;    // kUniform: constant; kVarying: virtual register
};

// Collects the instructions of one program over virtual registers and makes the program from them. The evaluator itself
// folds literals, so folding keeps bits. No other instructions are merged or moved: the text tells a program's cost.
class Emitter {
 public:
  explicit Emitter(std::size_t inputs) : registers_(static_cast<int>(inputs)) {}

  // Sets the origin of the next instructions, for faults.
  void set_place(const Token& token) { place_ = &token; }
  // In a declaration of uniforms operations go to the setup, and varying numbers are refused.
  void set_uniform(bool uniform) { uniform_ = uniform; }
  bool uniform() const { return uniform_; }

  static Scalar literal(float value) { return {Scalar::Kind::kLiteral, value, 0}; }
  Scalar parameter();  // the next constant
  Scalar input(std::size_t number) const { return {Scalar::Kind::kVarying, 0, static_cast<int>(number)}; }

  // `operation`: the form with registers alone.
  Scalar unary(Operation operation, const Scalar& a) { return operate(operation, {a}); }
  Scalar binary(Operation operation, const Scalar& a, const Scalar& b);
  Scalar select_less(const Scalar& a, const Scalar& b, const Scalar& x, const Scalar& y) {
    return operate(Operation::kSelectLess, {a, b, x, y});
  }
  // All operations except the ones with two forms; `plane` is for kImage.
  Scalar operate(Operation operation, const std::vector<Scalar>& operands, int plane = 0);
  std::array<Scalar, 2> sine_cosine(const Scalar& turns);

  // A number that is assigned to, in a register of its own. If `initial` was made by an instruction since `mark` and
  // is used nowhere else, that instruction writes the register.
  Scalar variable(const Scalar& initial, std::size_t mark);
  // The current value, unaffected by later assignments.
  Scalar settled(const Scalar& value);
  std::size_t mark() const { return code_.size(); }
  void assign(const Scalar& variable, const Scalar& value, std::size_t mark);

  // Instructions from here to put_label(label) run only where a uniform is positive.
  void skip_unless(const Scalar& condition, int label);
  int new_label() { return labels_++; }
  void put_label(int label);

  bool reads_image() const { return reads_image_; }
  // Fills instructions, setup, constants, inputs, result and registers.
  void finish(std::span<const Scalar> result, Program& program);

 private:
  // An instruction over virtual registers. A label marks a place to skip to; kSkip names its label.
  struct Virtual {
    Operation operation = Operation::kConstant;
    int to = -1, a = -1, b = -1, c = -1, d = -1;
    int label = -1;
    bool is_label = false;
  };

  Scalar fold(Operation operation, const std::vector<Scalar>& operands, float* second);
  int new_register() { return registers_++; }
  int constant_of(const Scalar& scalar);
  int register_of(const Scalar& scalar);
  int add_constant(float value);
  void push(const Virtual& instruction);
  Scalar push_setup(Operation operation, const std::vector<Scalar>& operands, int second);
  void remove_unused(std::span<const int> result);
  void fuse_products(std::span<const int> result);
  static Virtual product_with(Virtual product, const Virtual& next);
  template <class Visit>
  static void for_each_read(const Virtual& v, const Visit& visit);
  void allocate(std::span<const int> result, Program& program);

  const Token* place_ = nullptr;
  bool uniform_ = false, reads_image_ = false;
  int registers_, labels_ = 0;
  std::vector<Virtual> code_;
  std::vector<Instruction> setup_;
  std::vector<float> constants_;
  std::map<std::uint32_t, int> literals_;  // constants by their bits
  std::vector<bool> assigned_;             // by virtual register: whether it is a variable
};

// A call of a function that every program has.
struct BuiltinCall {
  const Token& name;
  Emitter& emitter;
  ProgramKind kind;
  std::vector<std::vector<Scalar>> arguments;
};

// Calls a function of whole vectors; empty if there is none of that name.
std::optional<std::vector<Scalar>> call_on_vectors(const BuiltinCall& call);

// A function that works number by number.
using NumberFunction = std::function<Scalar(Emitter&, const std::vector<Scalar>&)>;
std::optional<NumberFunction> number_function(const BuiltinCall& call);

}  // namespace tessera::shaders::program_text

#include "shaders_cpp/procedures/program_compiler.h"

#include <algorithm>
#include <bit>

#include <fmt/format.h>

#include "shaders_cpp/procedures/procedures.h"

namespace tessera::shaders::program_text {
namespace {

using Kind = Scalar::Kind;

Operation next_form(Operation operation, int forms) {
  return static_cast<Operation>(static_cast<int>(operation) + forms);
}

bool has_forms(Operation operation) {
  switch (operation) {
#define TESSERA_PROGRAM_BINARY(name) case Operation::k##name:
    TESSERA_PROGRAM_BINARIES(TESSERA_PROGRAM_BINARY)
#undef TESSERA_PROGRAM_BINARY
    return true;
    default:
      return false;
  }
}

// Whether an instruction reads its operands a, b, c, d as registers.
std::array<bool, 4> reads(Operation operation) {
  switch (operation) {
#define TESSERA_PROGRAM_BINARY(name)    \
  case Operation::k##name:              \
    return {true, true, false, false};  \
  case Operation::k##name##C:           \
    return {true, false, false, false}; \
  case Operation::k##name##From:        \
    return {false, true, false, false};
    TESSERA_PROGRAM_BINARIES(TESSERA_PROGRAM_BINARY)
#undef TESSERA_PROGRAM_BINARY
    case Operation::kConstant:
    case Operation::kSkip:
      return {};
    case Operation::kCopy:
    case Operation::kSquareRoot:
    case Operation::kAbsolute:
    case Operation::kRoundDown:
    case Operation::kSmoothStep:
    case Operation::kPowerOfTwo:
    case Operation::kSineCosine:
    case Operation::kMultiplyCAddC:
    case Operation::kMultiplyCSubtractC:
    case Operation::kMultiplyCRestC:
      return {true, false, false, false};
    case Operation::kPlaneNoise:
    case Operation::kImage:
    case Operation::kMultiplyAddC:
    case Operation::kMultiplySubtractC:
    case Operation::kMultiplyRestC:
      return {true, true, false, false};
    case Operation::kProductSumC:
    case Operation::kMultiplyCAdd:
    case Operation::kMultiplyCSubtract:
    case Operation::kMultiplyCRest:
      return {true, false, true, false};
    case Operation::kMultiplyAdd:
    case Operation::kMultiplySubtract:
    case Operation::kMultiplyRest:
    case Operation::kSpaceNoise:
      return {true, true, true, false};
    case Operation::kSelectLess:
    case Operation::kProductSum:
      return {true, true, true, true};
  }
  return {};
}

}  // namespace

// Calls visit(register) for each register that an instruction reads.
template <class Visit>
void Emitter::for_each_read(const Virtual& v, const Visit& visit) {
  if (v.is_label) return;
  const std::array<bool, 4> read = reads(v.operation);
  const int operands[] = {v.a, v.b, v.c, v.d};
  for (std::size_t n = 0; n < 4; ++n)
    if (read[n]) visit(operands[n]);
}

// ---- Emission ---------------------------------------------------------------------------------------------------

Scalar Emitter::parameter() { return {Kind::kUniform, 0, add_constant(0.0f)}; }

int Emitter::add_constant(float value) {
  if (constants_.size() == ProgramLimits::kConstants)
    refuse(*place_, fmt::format("more than {} parameters, uniforms and literals", ProgramLimits::kConstants));
  constants_.push_back(value);
  return static_cast<int>(constants_.size()) - 1;
}

int Emitter::constant_of(const Scalar& scalar) {
  if (scalar.kind == Kind::kUniform) return scalar.index;
  const auto [at, fresh] = literals_.try_emplace(std::bit_cast<std::uint32_t>(scalar.value), 0);
  if (fresh) at->second = add_constant(scalar.value);
  return at->second;
}

int Emitter::register_of(const Scalar& scalar) {
  if (scalar.kind == Kind::kVarying) return scalar.index;
  Virtual load;
  load.to = new_register();
  load.a = constant_of(scalar);
  push(load);
  return load.to;
}

void Emitter::push(const Virtual& instruction) {
  if (code_.size() == ProgramLimits::kInstructions)
    refuse(*place_, fmt::format("the program has more than {} instructions", ProgramLimits::kInstructions));
  code_.push_back(instruction);
}

Scalar Emitter::fold(Operation operation, const std::vector<Scalar>& operands, float* second) {
  float r[6][1] = {};
  for (std::size_t k = 0; k < operands.size(); ++k) r[k][0] = operands[k].value;
  const auto d = static_cast<std::uint8_t>(operation == Operation::kSineCosine ? 5 : 3);
  const Instruction instruction{operation, 4, 0, 1, 2, d, 0};
  run_instructions<true, float, 1>({&instruction, 1}, nullptr, nullptr, 1, r);
  if (second != nullptr) *second = r[5][0];
  return literal(r[4][0]);
}

Scalar Emitter::push_setup(Operation operation, const std::vector<Scalar>& operands, int second) {
  if (setup_.size() == ProgramLimits::kSetup)
    refuse(*place_, fmt::format("uniforms take more than {} instructions", ProgramLimits::kSetup));
  Instruction instruction{operation, 0, 0, 0, 0, 0, 0};
  std::uint8_t* const at[] = {&instruction.a, &instruction.b, &instruction.c, &instruction.d};
  for (std::size_t k = 0; k < operands.size(); ++k) {
    if (operands[k].kind == Kind::kVarying)
      refuse(*place_, "a uniform cannot depend on numbers that differ between samples");
    *at[k] = static_cast<std::uint8_t>(constant_of(operands[k]));
  }
  if (second >= 0) instruction.d = static_cast<std::uint8_t>(second);
  const int to = add_constant(0.0f);
  instruction.to = static_cast<std::uint8_t>(to);
  setup_.push_back(instruction);
  return {Kind::kUniform, 0, to};
}

Scalar Emitter::operate(Operation operation, const std::vector<Scalar>& operands, int plane) {
  const auto is_literal = [](const Scalar& s) { return s.kind == Kind::kLiteral; };
  const bool image = operation == Operation::kImage;
  if (!image && std::all_of(operands.begin(), operands.end(), is_literal)) return fold(operation, operands, nullptr);
  if (uniform_) {
    if (image) refuse(*place_, "a uniform cannot read an image");
    return push_setup(operation, operands, -1);
  }
  Virtual v;
  v.operation = operation;
  int* const at[] = {&v.a, &v.b, &v.c, &v.d};
  for (std::size_t k = 0; k < operands.size(); ++k) *at[k] = register_of(operands[k]);
  if (image) v.c = plane, reads_image_ = true;
  v.to = new_register();
  push(v);
  return {Kind::kVarying, 0, v.to};
}

Scalar Emitter::binary(Operation operation, const Scalar& a, const Scalar& b) {
  const bool known = a.kind == Kind::kLiteral && b.kind == Kind::kLiteral;
  if (uniform_ || known || !has_forms(operation) || (a.kind == Kind::kVarying && b.kind == Kind::kVarying))
    return operate(operation, {a, b});
  Virtual v;
  if (b.kind != Kind::kVarying) {
    v.a = register_of(a);
    v.b = constant_of(b);
    v.operation = next_form(operation, 1);
  } else {
    v.a = constant_of(a);
    v.b = b.index;
    v.operation = next_form(operation, 2);
  }
  v.to = new_register();
  push(v);
  return {Kind::kVarying, 0, v.to};
}

std::array<Scalar, 2> Emitter::sine_cosine(const Scalar& turns) {
  if (turns.kind == Kind::kLiteral) {
    float cosine;
    const Scalar sine = fold(Operation::kSineCosine, {turns}, &cosine);
    return {sine, literal(cosine)};
  }
  if (uniform_) {
    const int second = add_constant(0.0f);
    return {push_setup(Operation::kSineCosine, {turns}, second), Scalar{Kind::kUniform, 0, second}};
  }
  Virtual v;
  v.operation = Operation::kSineCosine;
  v.a = register_of(turns);
  v.to = new_register();
  v.d = new_register();
  push(v);
  return {Scalar{Kind::kVarying, 0, v.to}, Scalar{Kind::kVarying, 0, v.d}};
}

Scalar Emitter::variable(const Scalar& initial, std::size_t mark) {
  const Scalar out{Kind::kVarying, 0, new_register()};
  assigned_.resize(static_cast<std::size_t>(registers_));
  assigned_.back() = true;
  assign(out, initial, mark);
  return out;
}

Scalar Emitter::settled(const Scalar& value) {
  if (value.kind != Kind::kVarying || static_cast<std::size_t>(value.index) >= assigned_.size() ||
      !assigned_[static_cast<std::size_t>(value.index)])
    return value;
  Virtual v;
  v.operation = Operation::kCopy;
  v.a = value.index;
  v.to = new_register();
  push(v);
  return {Kind::kVarying, 0, v.to};
}

void Emitter::assign(const Scalar& variable, const Scalar& value, std::size_t mark) {
  // The instruction that made the value writes the variable directly, unless the old value is read later.
  if (value.kind == Kind::kVarying) {
    for (std::size_t k = code_.size(); k > mark; --k) {
      Virtual& v = code_[k - 1];
      if (v.is_label || v.operation == Operation::kSkip) break;
      if (v.to == value.index && v.operation != Operation::kSineCosine) {
        v.to = variable.index;
        return;
      }
      bool uses = false;
      for_each_read(v, [&](int r) { uses |= r == variable.index || r == value.index; });
      if (uses) break;
    }
  }
  Virtual v;
  const bool varies = value.kind == Kind::kVarying;
  v.operation = varies ? Operation::kCopy : Operation::kConstant;
  v.a = varies ? value.index : constant_of(value);
  v.to = variable.index;
  push(v);
}

void Emitter::skip_unless(const Scalar& condition, int label) {
  Virtual v;
  v.operation = Operation::kSkip;
  v.a = constant_of(condition);
  v.label = label;
  push(v);
}

void Emitter::put_label(int label) {
  Virtual v;
  v.is_label = true;
  v.label = label;
  push(v);
}

// ---- The program ------------------------------------------------------------------------------------------------

void Emitter::finish(std::span<const Scalar> result, Program& program) {
  std::vector<int> registers;
  for (const Scalar& s : result) registers.push_back(register_of(s));
  assigned_.resize(static_cast<std::size_t>(registers_));
  remove_unused(registers);
  fuse_products(registers);
  allocate(registers, program);
  program.setup = std::move(setup_);
  program.constants = std::move(constants_);
  program.reads_image = reads_image_;
}

void Emitter::remove_unused(std::span<const int> result) {
  std::vector<bool> live(static_cast<std::size_t>(registers_));
  for (const int r : result) live[static_cast<std::size_t>(r)] = true;
  std::vector<Virtual> kept;
  for (std::size_t k = code_.size(); k > 0; --k) {
    const Virtual& v = code_[k - 1];
    const bool control = v.is_label || v.operation == Operation::kSkip;
    bool wanted = control || live[static_cast<std::size_t>(v.to)];
    if (!control && v.operation == Operation::kSineCosine) wanted |= live[static_cast<std::size_t>(v.d)];
    if (!wanted) continue;
    kept.push_back(v);
    if (control) continue;
    // A variable may keep its earlier value if this is skipped.
    if (!assigned_[static_cast<std::size_t>(v.to)]) live[static_cast<std::size_t>(v.to)] = false;
    for_each_read(v, [&](int r) { live[static_cast<std::size_t>(r)] = true; });
  }
  std::reverse(kept.begin(), kept.end());
  code_ = std::move(kept);
}

// Fuses a product and the only sum or difference that reads it into one instruction at the sum's place, and two products
// with their sum: fewer numbers pass through the registers. Each operation still rounds, and counts, on its own; addition
// and multiplication commute bit for bit. No product crosses a skip, where it would be counted more or less often.
void Emitter::fuse_products(std::span<const int> result) {
  std::vector<int> uses(static_cast<std::size_t>(registers_)), made_at(uses.size(), -1);
  for (const int r : result) ++uses[static_cast<std::size_t>(r)];
  for (const Virtual& v : code_) for_each_read(v, [&](int r) { ++uses[static_cast<std::size_t>(r)]; });
  std::vector<bool> taken(code_.size());
  int block = 0;
  // The product that made a register, if it may be computed later: no other instruction reads it, and its operands
  // are not assigned in between.
  const auto product_of = [&](int r) -> Virtual* {
    const int at = r < 0 ? -1 : made_at[static_cast<std::size_t>(r)];
    if (at < block || uses[static_cast<std::size_t>(r)] != 1 || assigned_[static_cast<std::size_t>(r)]) return nullptr;
    Virtual& m = code_[static_cast<std::size_t>(at)];
    bool fixed = m.operation >= Operation::kMultiply && m.operation <= Operation::kMultiplyFrom;
    for_each_read(m, [&](int read) { fixed = fixed && !assigned_[static_cast<std::size_t>(read)]; });
    return fixed ? &m : nullptr;
  };
  const auto take = [&](const Virtual* m) { taken[static_cast<std::size_t>(m - code_.data())] = true; };
  for (std::size_t k = 0; k < code_.size(); ++k) {
    Virtual& v = code_[k];
    if (v.is_label || v.operation == Operation::kSkip) {
      block = static_cast<int>(k) + 1;
      continue;
    }
    if (v.operation >= Operation::kAdd && v.operation <= Operation::kSubtractFrom) {
      const bool a = v.operation != Operation::kAddFrom && v.operation != Operation::kSubtractFrom,
                 b = v.operation != Operation::kAddC && v.operation != Operation::kSubtractC;
      const Virtual* m = product_of(b ? v.b : -1);
      if (m == nullptr) m = product_of(a ? v.a : -1);
      if (m != nullptr) take(m), v = product_with(*m, v);
      const bool by_constant = v.operation == Operation::kMultiplyCAdd;
      if (by_constant || v.operation == Operation::kMultiplyAdd) {
        const Virtual* other = product_of(v.c);
        if (other != nullptr && by_constant == (other->operation != Operation::kMultiply)) {
          take(other);
          const bool turned = other->operation == Operation::kMultiplyFrom;
          v.c = turned ? other->b : other->a, v.d = turned ? other->a : other->b;
          v.operation = by_constant ? Operation::kProductSumC : Operation::kProductSum;
        }
      }
    }
    made_at[static_cast<std::size_t>(v.to)] = static_cast<int>(k);
  }
  std::vector<Virtual> fused;
  for (std::size_t k = 0; k < code_.size(); ++k)
    if (!taken[k]) fused.push_back(code_[k]);
  code_ = std::move(fused);
}

// Joins product `m` and the sum or difference `v` that reads it.
Emitter::Virtual Emitter::product_with(Virtual m, const Virtual& v) {
  const bool sum = v.operation <= Operation::kAddFrom;
  const int form = static_cast<int>(v.operation) - static_cast<int>(sum ? Operation::kAdd : Operation::kSubtract);
  // 0: registers a and b; 1: b is a constant; 2: a is one.
  const bool first = form == 1 || (form == 0 && v.a == m.to);
  if (m.operation == Operation::kMultiplyFrom) std::swap(m.a, m.b), m.operation = Operation::kMultiplyC;
  const Operation base = sum     ? Operation::kMultiplyAdd
                         : first ? Operation::kMultiplySubtract
                                 : Operation::kMultiplyRest;
  m.operation = next_form(base, (m.operation == Operation::kMultiplyC ? 1 : 0) + (form != 0 ? 2 : 0));
  m.c = first ? v.b : v.a;
  m.to = v.to;
  return m;
}

// Linear scan: a virtual register keeps its register from its first write to its last read in the order of the list,
// which is also the order of skips.
void Emitter::allocate(std::span<const int> result, Program& program) {
  const auto none = static_cast<int>(code_.size());
  std::vector<int> last(static_cast<std::size_t>(registers_), -1);
  for (int k = 0; k < none; ++k) {
    const Virtual& v = code_[static_cast<std::size_t>(k)];
    if (v.is_label || v.operation == Operation::kSkip) continue;
    for_each_read(v, [&](int r) { last[static_cast<std::size_t>(r)] = k; });
    last[static_cast<std::size_t>(v.to)] = std::max(last[static_cast<std::size_t>(v.to)], k);
    if (v.operation == Operation::kSineCosine)
      last[static_cast<std::size_t>(v.d)] = std::max(last[static_cast<std::size_t>(v.d)], k);
  }
  for (const int r : result) last[static_cast<std::size_t>(r)] = none;

  std::vector<int> place(static_cast<std::size_t>(registers_), -1);
  std::array<int, ProgramLimits::kRegisters> owner{};
  owner.fill(-1);
  const auto take = [&](int r) {
    if (place[static_cast<std::size_t>(r)] >= 0) return;
    const auto free = std::find(owner.begin(), owner.end(), -1);
    if (free == owner.end())
      refuse(*place_, fmt::format("more than {} numbers are needed at one time", ProgramLimits::kRegisters));
    *free = r;
    place[static_cast<std::size_t>(r)] = static_cast<int>(free - owner.begin());
    program.registers = std::max(program.registers, static_cast<std::size_t>(free - owner.begin()) + 1);
  };
  const auto release = [&](int k) {
    for (int& o : owner)
      if (o >= 0 && last[static_cast<std::size_t>(o)] <= k) o = -1;
  };
  std::size_t inputs = 0;
  for (const ProgramInput& input : program_inputs(program.kind)) inputs += static_cast<std::size_t>(input.size);
  for (std::size_t n = 0; n < inputs; ++n) {
    if (last[n] < 0 && program.kind != ProgramKind::kShape) continue;
    take(static_cast<int>(n));
    program.inputs.push_back({static_cast<std::uint8_t>(n), static_cast<std::uint8_t>(place[n])});
  }
  std::vector<std::size_t> label_at(static_cast<std::size_t>(labels_));
  std::vector<std::pair<std::size_t, int>> skips;
  for (int k = 0; k < none; ++k) {
    const Virtual& v = code_[static_cast<std::size_t>(k)];
    if (v.is_label) {
      label_at[static_cast<std::size_t>(v.label)] = program.instructions.size();
      continue;
    }
    Instruction i;
    i.operation = v.operation;
    const std::array<bool, 4> r = reads(v.operation);
    const int operands[] = {v.a, v.b, v.c, v.d};
    std::uint8_t* const at[] = {&i.a, &i.b, &i.c, &i.d};
    for (std::size_t n = 0; n < 4; ++n)
      *at[n] =
          static_cast<std::uint8_t>(r[n] ? place[static_cast<std::size_t>(operands[n])] : std::max(operands[n], 0));
    if (v.operation == Operation::kSkip) {
      skips.emplace_back(program.instructions.size(), v.label);
    } else if (v.operation == Operation::kSineCosine) {
      take(v.to), take(v.d);  // before the operand is released: the two results must differ
      release(k);
      i.to = static_cast<std::uint8_t>(place[static_cast<std::size_t>(v.to)]);
      i.d = static_cast<std::uint8_t>(place[static_cast<std::size_t>(v.d)]);
    } else {
      // An operand that is read here for the last time may pass its register to the result.
      for (int& o : owner)
        if (o >= 0 && o != v.to && last[static_cast<std::size_t>(o)] <= k) o = -1;
      take(v.to);
      release(k);
      i.to = static_cast<std::uint8_t>(place[static_cast<std::size_t>(v.to)]);
    }
    program.instructions.push_back(i);
  }
  for (const auto& [at, label] : skips)
    program.instructions[at].skip = static_cast<std::uint16_t>(label_at[static_cast<std::size_t>(label)] - at - 1);
  for (std::size_t n = 0; n < result.size(); ++n)
    program.result[n] = static_cast<std::uint8_t>(place[static_cast<std::size_t>(result[n])]);
}

}  // namespace tessera::shaders::program_text

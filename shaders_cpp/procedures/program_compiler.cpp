// The compiler of programs: one pass over the words of a text, which emits instructions as it reads. It reads bodies
// of functions and of repetitions again each time they are used.
#include <algorithm>
#include <cmath>
#include <deque>

#include <fmt/format.h>

#include "shaders_cpp/procedures/program_compiler.h"

namespace tessera::shaders {
namespace program_text {
namespace {

using Kind = Scalar::Kind;

// One to four numbers, or a row of numbers that is accessible by index alone.
struct Value {
  std::vector<Scalar> numbers;
  bool row = false;

  int size() const { return static_cast<int>(numbers.size()); }
};

struct Symbol {
  enum class Role : std::uint8_t { kLet, kVariable, kUniform };
  std::string_view name;
  Role role = Role::kLet;
  Value value;
};

struct Function {
  std::string_view name;
  std::vector<std::string_view> arguments;
  std::size_t body = 0;     // token after '{' or after '='
  bool expression = false;  // one expression, not a block
  std::size_t symbols = 0;  // number of the program's own symbols that it sees
};

std::string type_name(const Value& value) {
  if (value.row) return fmt::format("a row of {} numbers", value.size());
  return value.size() == 1 ? "a number" : fmt::format("a vec{}", value.size());
}

// Compiles one program from the word of its kind to its closing brace.
class Compiler {
 public:
  Compiler(const std::vector<Token>& tokens, std::size_t at, std::size_t& steps)
      : tokens_(tokens), at_(at), steps_(steps) {}

  std::size_t compile(Program& program);

 private:
  // ---- Words ----
  const Token& peek() const { return tokens_[at_]; }
  const Token& next() {
    if (++steps_ > ProgramLimits::kSteps)
      refuse(peek(), fmt::format("calls and repetitions make the program longer than {} words", ProgramLimits::kSteps));
    const Token& token = tokens_[at_];
    if (token.kind != Token::Kind::kEnd) ++at_;
    return token;
  }
  bool is_symbol(std::string_view text) const { return peek().kind == Token::Kind::kSymbol && peek().text == text; }
  bool is_word(std::string_view text) const { return peek().kind == Token::Kind::kName && peek().text == text; }
  bool accept(std::string_view symbol) { return is_symbol(symbol) && (next(), true); }
  bool accept_word(std::string_view word) { return is_word(word) && (next(), true); }
  void expect(std::string_view symbol) {
    if (!accept(symbol)) refuse(peek(), fmt::format("expected '{}', found {}", symbol, shown(peek())));
  }
  const Token& expect_new_name();
  double expect_number();
  std::size_t expect_count(std::size_t min, std::size_t max);
  void skip_block();
  struct Depth {
    explicit Depth(Compiler& c) : compiler(c) {
      if (++compiler.depth_ > ProgramLimits::kDepth)
        refuse(compiler.peek(),
               fmt::format("more than {} expressions, blocks and calls inside each other", ProgramLimits::kDepth));
    }
    ~Depth() { --compiler.depth_; }
    Depth(const Depth&) = delete;
    Depth& operator=(const Depth&) = delete;
    Compiler& compiler;
  };

  // ---- Declarations ----
  void declare_parameter();
  void declare_function();
  void read_default(ParameterDeclaration& p);

  // ---- Statements ----
  std::optional<Value> block();      // reads to the closing brace; returns the block's value
  std::optional<Value> statement();  // returns the statement's value
  void let(Symbol::Role role);
  void assign();
  void repeat();

  // ---- Expressions ----
  Value expression();
  Value sum();
  Value product();
  Value factor();
  Value part();
  Value name_or_call();
  Value call_builtin(const Token& name, const std::vector<Value>& arguments);
  Value call(const Token& name, const Function& function, std::vector<Value> arguments);
  Value operate(const Token& at, Operation operation, const Value& a, const Value& b);
  Value each(const Token& at, const std::vector<Value>& arguments,
             const std::function<Scalar(const std::vector<Scalar>&)>& of_numbers);
  Value select(const Value& a);
  Scalar one(const Token& at, const Value& value) const;
  Value joined(const Token& name, std::size_t size, const std::vector<Value>& arguments) const;
  const Symbol* find(std::string_view name) const;
  void add_symbol(const Token& at, Symbol symbol);

  const std::vector<Token>& tokens_;
  std::size_t at_;
  std::size_t& steps_;
  std::size_t depth_ = 0;
  Program* program_ = nullptr;
  std::optional<Emitter> emitter_;
  std::deque<Symbol> symbols_;
  std::deque<Function> functions_;
  std::size_t barrier_ = 0;  // symbols from here on belong to the function in progress
  std::size_t visible_ = 0;  // number of the program's own symbols that are visible
  bool in_call_ = false;
  std::size_t callable_ = 0;       // number of callable functions: the ones before the function in progress
  std::optional<Scalar> running_;  // inside `repeat ... while`: positive where this repetition runs
};

// ---- Words ------------------------------------------------------------------------------------------------------

const std::string_view kReserved[] = {"shape",   "texture", "rates", "param", "fn",     "let",     "var",
                                      "uniform", "repeat",  "as",    "while", "return", "patches", "kinks",
                                      "in",      "chain",   "float", "vec2",  "vec3",   "vec4"};

const Token& Compiler::expect_new_name() {
  const Token& name = peek();
  if (name.kind != Token::Kind::kName) refuse(name, fmt::format("expected a name, found {}", shown(name)));
  if (std::find(std::begin(kReserved), std::end(kReserved), name.text) != std::end(kReserved))
    refuse(name, fmt::format("'{}' is a word of the language", name.text));
  return next();
}

double Compiler::expect_number() {
  const bool negative = accept("-");
  if (peek().kind != Token::Kind::kNumber) refuse(peek(), fmt::format("expected a number, found {}", shown(peek())));
  const auto value = static_cast<double>(next().value);
  return negative ? -value : value;
}

std::size_t Compiler::expect_count(std::size_t min, std::size_t max) {
  const Token& at = peek();
  const double value = expect_number();
  if (!(value >= static_cast<double>(min) && value <= static_cast<double>(max)) || value != std::floor(value))
    refuse(at, fmt::format("expected a whole number from {} to {}", min, max));
  return static_cast<std::size_t>(value);
}

// Moves from behind an opening brace to behind its closing one.
void Compiler::skip_block() {
  const Token& open = tokens_[at_ - 1];
  for (std::size_t depth = 1; depth > 0;) {
    if (peek().kind == Token::Kind::kEnd) refuse(open, "the block does not end");
    depth += is_symbol("{") ? 1 : 0;
    depth -= is_symbol("}") ? 1 : 0;
    next();
  }
}

const Symbol* Compiler::find(std::string_view name) const {
  for (std::size_t k = symbols_.size(); k > 0; --k) {
    const std::size_t n = k - 1;
    if (n < barrier_ && n >= visible_) continue;
    if (symbols_[n].name == name) return &symbols_[n];
  }
  return nullptr;
}

void Compiler::add_symbol(const Token& at, Symbol symbol) {
  if (symbols_.size() == ProgramLimits::kNames)
    refuse(at, fmt::format("more than {} names at one time", ProgramLimits::kNames));
  symbols_.push_back(std::move(symbol));
}

// ---- Declarations -----------------------------------------------------------------------------------------------

void Compiler::read_default(ParameterDeclaration& p) {
  p.default_value = ParameterDeclaration::kRequired;
  p.min = -1e6f, p.max = 1e6f;
  const Token* value = nullptr;
  if (is_symbol("=")) {
    next();
    value = &peek();
    p.default_value = static_cast<float>(expect_number());
  }
  if (accept_word("in")) {
    expect("[");
    p.min = static_cast<float>(expect_number());
    expect(",");
    const Token& at = peek();
    p.max = static_cast<float>(expect_number());
    if (!(p.min <= p.max)) refuse(at, "the range is empty");
    expect("]");
  }
  if (value != nullptr && !(p.default_value >= p.min && p.default_value <= p.max))
    refuse(*value, "the default lies outside the range");
}

// param name [: type] [= number] [in [min, max]] ["meaning"];
void Compiler::declare_parameter() {
  const Token& name = expect_new_name();
  emitter_->set_place(name);
  if (find(name.text) != nullptr) refuse(name, fmt::format("'{}' is taken", name.text));
  ParameterDeclaration p{name.text, ParameterLayout::kNumbers, 1, 0, 0, 0, ""};
  bool row = false;
  if (accept(":")) {
    const Token& type = next();
    if (type.text == "chain") {
      row = true;
      p.size = 8;
      const bool along_u = accept_word("u");
      if (!along_u && !accept_word("v")) refuse(peek(), "a chain runs along u or v");
      p.layout = along_u ? ParameterLayout::kChainU : ParameterLayout::kChainV;
      if (program_->kind != ProgramKind::kShape) refuse(type, "only shapes have chains");
    } else if (type.text == "float" && accept("[")) {
      row = true;
      p.size = static_cast<int>(expect_count(1, kBlockNumbers));
      expect("]");
    } else if (type.text == "vec2" || type.text == "vec3" || type.text == "vec4") {
      p.size = type.text.back() - '0';
    } else if (type.text != "float") {
      refuse(type, fmt::format("{} is no type: float, vec2 to vec4, float[N] or chain", shown(type)));
    }
  }
  read_default(p);
  if (p.layout != ParameterLayout::kNumbers && !p.required()) refuse(name, "a chain has no default");
  if (peek().kind == Token::Kind::kText) p.meaning = next().text;
  expect(";");
  program_->parameter_numbers += static_cast<std::size_t>(p.size);
  if (program_->parameter_numbers > kBlockNumbers)
    refuse(name, fmt::format("the parameters have more than {} numbers", kBlockNumbers));
  program_->parameters.push_back(p);
  Symbol symbol{name.text, Symbol::Role::kLet, {}};
  symbol.value.row = row;
  for (int k = 0; k < p.size; ++k) symbol.value.numbers.push_back(emitter_->parameter());
  add_symbol(name, std::move(symbol));
}

// fn name(a, b) { ... return value; }   fn name(a, b) = value;
void Compiler::declare_function() {
  Function function;
  const Token& name = expect_new_name();
  function.name = name.text;
  if (functions_.size() == ProgramLimits::kNames)
    refuse(name, fmt::format("more than {} functions", ProgramLimits::kNames));
  for (const Function& f : functions_)
    if (f.name == name.text) refuse(name, fmt::format("'{}' is taken", name.text));
  expect("(");
  while (!is_symbol(")")) {
    if (!function.arguments.empty()) expect(",");
    function.arguments.push_back(expect_new_name().text);
  }
  expect(")");
  function.expression = is_symbol("=");
  if (!function.expression && !is_symbol("{"))
    refuse(peek(), fmt::format("expected '{{' or '=', found {}", shown(peek())));
  next();
  function.body = at_;
  function.symbols = symbols_.size();
  if (function.expression) {
    while (!is_symbol(";") && peek().kind != Token::Kind::kEnd) next();
    expect(";");
  } else {
    skip_block();
  }
  functions_.push_back(std::move(function));
}

// ---- Statements -------------------------------------------------------------------------------------------------

std::optional<Value> Compiler::block() {
  const Depth depth(*this);
  const std::size_t scope = symbols_.size();
  std::optional<Value> returned;
  while (!is_symbol("}")) {
    if (returned) refuse(peek(), "nothing may follow 'return'");
    returned = statement();
  }
  next();
  symbols_.resize(scope);
  return returned;
}

std::optional<Value> Compiler::statement() {
  emitter_->set_place(peek());
  if (accept_word("let")) {
    let(Symbol::Role::kLet);
  } else if (accept_word("var")) {
    let(Symbol::Role::kVariable);
  } else if (accept_word("uniform")) {
    let(Symbol::Role::kUniform);
  } else if (accept_word("repeat")) {
    repeat();
  } else if (accept_word("return")) {
    Value value = expression();
    expect(";");
    return value;
  } else if (peek().kind == Token::Kind::kName) {
    assign();
  } else {
    refuse(peek(), fmt::format("expected a statement, found {}", shown(peek())));
  }
  return std::nullopt;
}

// Whether each number was made separately.
bool all_distinct(const Value& value) {
  for (std::size_t a = 0; a < value.numbers.size(); ++a)
    for (std::size_t b = 0; b < a; ++b)
      if (value.numbers[a].kind == Kind::kVarying && value.numbers[b].kind == Kind::kVarying &&
          value.numbers[a].index == value.numbers[b].index)
        return false;
  return true;
}

// let name [: type] = value;
void Compiler::let(Symbol::Role role) {
  const Token& name = expect_new_name();
  int size = 0;
  if (accept(":")) {
    const Token& type = next();
    size = type.text == "float" ? 1 : type.text == "vec2" ? 2 : type.text == "vec3" ? 3 : type.text == "vec4" ? 4 : 0;
    if (size == 0) refuse(type, fmt::format("{} is no type: float or vec2 to vec4", shown(type)));
  }
  expect("=");
  const Token& at = peek();
  const std::size_t mark = emitter_->mark();
  const bool was = emitter_->uniform();
  if (was && role == Symbol::Role::kVariable) role = Symbol::Role::kUniform;  // in a function called for a uniform
  emitter_->set_uniform(was || role == Symbol::Role::kUniform);
  Value value = expression();
  emitter_->set_uniform(was);
  expect(";");
  emitter_->set_place(name);
  if (value.row) refuse(at, fmt::format("'{}' cannot be {}", name.text, type_name(value)));
  if (size != 0 && size != value.size())
    refuse(at, fmt::format("'{}' is {}, the value is {}", name.text,
                           size == 1 ? "a number" : fmt::format("a vec{}", size), type_name(value)));
  const std::size_t own = all_distinct(value) ? mark : emitter_->mark();
  for (Scalar& s : value.numbers) {
    if (role == Symbol::Role::kUniform && s.kind == Kind::kVarying)
      refuse(at, "a uniform cannot depend on numbers that differ between samples");
    if (role == Symbol::Role::kVariable) s = emitter_->variable(s, own);
    if (role == Symbol::Role::kLet) s = emitter_->settled(s);
  }
  add_symbol(name, {name.text, role, std::move(value)});
}

// name = value;
void Compiler::assign() {
  const Token& name = next();
  const Symbol* const symbol = find(name.text);
  if (symbol == nullptr) refuse(name, fmt::format("'{}' is not known", name.text));
  std::size_t index = symbols_.size() - 1;
  while (&symbols_[index] != symbol) --index;
  if (symbol->role == Symbol::Role::kLet) refuse(name, fmt::format("'{}' is not a 'var' or 'uniform'", name.text));
  if (index < barrier_) refuse(name, fmt::format("'{}' belongs to the program; a function only reads it", name.text));
  const bool uniform = symbol->role == Symbol::Role::kUniform, was = emitter_->uniform();
  expect("=");
  const Token& at = peek();
  const std::size_t mark = emitter_->mark();
  emitter_->set_uniform(was || uniform);
  Value value = expression();
  expect(";");
  emitter_->set_place(name);
  Value& to = symbols_[index].value;
  if (value.row || value.size() != to.size())
    refuse(at, fmt::format("'{}' is {}, the value is {}", name.text, type_name(to), type_name(value)));
  if (uniform) {
    for (std::size_t k = 0; k < to.numbers.size(); ++k) {
      if (value.numbers[k].kind == Kind::kVarying)
        refuse(at, "a uniform cannot depend on numbers that differ between samples");
      // A variable keeps its value if the repetition does not run.
      to.numbers[k] = running_
                          ? emitter_->select_less(Emitter::literal(0.0f), *running_, value.numbers[k], to.numbers[k])
                          : value.numbers[k];
    }
    emitter_->set_uniform(was);
    return;
  }
  const std::size_t own = all_distinct(value) ? mark : emitter_->mark();
  if (value.size() > 1)
    for (Scalar& s : value.numbers) s = emitter_->settled(s);  // as in p = p.yx
  for (std::size_t k = 0; k < to.numbers.size(); ++k) emitter_->assign(to.numbers[k], value.numbers[k], own);
}

// repeat N as k [while uniform < uniform] { ... }
void Compiler::repeat() {
  const Token& at = tokens_[at_ - 1];
  if (emitter_->uniform()) refuse(at, "no repetitions inside a uniform");
  const std::size_t count = expect_count(1, ProgramLimits::kRepetitions);
  std::string_view name;
  if (accept_word("as")) name = expect_new_name().text;
  const std::size_t head = at_;
  const std::optional<Scalar> outer = running_;
  const int end = emitter_->new_label();
  for (std::size_t k = 0; k < count; ++k) {
    at_ = head;
    const std::size_t scope = symbols_.size();
    if (!name.empty())
      symbols_.push_back({name, Symbol::Role::kLet, {{Emitter::literal(static_cast<float>(k))}, false}});
    bool runs = true;
    if (accept_word("while")) {
      const Token& condition = peek();
      emitter_->set_uniform(true);
      const Value a = sum();
      const bool less = is_symbol("<");
      if (!less && !is_symbol(">")) refuse(peek(), fmt::format("expected '<' or '>', found {}", shown(peek())));
      next();
      const Value b = sum();
      const Scalar x = one(condition, a), y = one(condition, b);
      for (const Scalar& s : {x, y})
        if (s.kind == Kind::kVarying)
          refuse(condition, "repetitions cannot depend on numbers that differ between samples");
      const Scalar yes =
          emitter_->select_less(less ? x : y, less ? y : x, Emitter::literal(1.0f), Emitter::literal(0.0f));
      running_ = running_ ? emitter_->binary(Operation::kMultiply, *running_, yes) : yes;
      emitter_->set_uniform(false);
      runs = running_->kind != Kind::kLiteral || running_->value > 0;
      if (running_->kind != Kind::kLiteral) emitter_->skip_unless(*running_, end);
    }
    expect("{");
    if (!runs) {
      skip_block();
      symbols_.resize(scope);
      break;
    }
    const Token& first = peek();
    if (block()) refuse(first, "a repetition cannot return");
    symbols_.resize(scope);
  }
  emitter_->put_label(end);
  running_ = outer;
}

// ---- Expressions ------------------------------------------------------------------------------------------------

Scalar Compiler::one(const Token& at, const Value& value) const {
  if (value.row || value.size() != 1) refuse(at, fmt::format("expected a number, this is {}", type_name(value)));
  return value.numbers[0];
}

// Applies a function number by number; an argument of one number serves all.
Value Compiler::each(const Token& at, const std::vector<Value>& arguments,
                     const std::function<Scalar(const std::vector<Scalar>&)>& of_numbers) {
  int size = 1;
  for (const Value& v : arguments) {
    if (v.row) refuse(at, fmt::format("{} is taken apart by an index first", type_name(v)));
    if (v.size() == 1) continue;
    if (size != 1 && size != v.size())
      refuse(at, fmt::format("a vec{} and a vec{} do not go together", size, v.size()));
    size = v.size();
  }
  Value out;
  for (int k = 0; k < size; ++k) {
    std::vector<Scalar> numbers;
    numbers.reserve(arguments.size());
    for (const Value& v : arguments) numbers.push_back(v.numbers[v.size() == 1 ? 0 : static_cast<std::size_t>(k)]);
    out.numbers.push_back(of_numbers(numbers));
  }
  return out;
}

Value Compiler::operate(const Token& at, Operation operation, const Value& a, const Value& b) {
  emitter_->set_place(at);
  return each(at, {a, b}, [&](const std::vector<Scalar>& n) { return emitter_->binary(operation, n[0], n[1]); });
}

// sum [< sum ? expression : expression]
Value Compiler::expression() {
  const Depth depth(*this);
  Value a = sum();
  if (!is_symbol("<") && !is_symbol(">")) return a;
  const Token& at = next();
  const bool less = at.text == "<";
  const Value b = sum();
  expect("?");
  const Value x = expression();
  expect(":");
  const Value y = expression();
  emitter_->set_place(at);
  return each(at, {less ? a : b, less ? b : a, x, y},
              [&](const std::vector<Scalar>& n) { return emitter_->select_less(n[0], n[1], n[2], n[3]); });
}

Value Compiler::sum() {
  Value a = product();
  while (is_symbol("+") || is_symbol("-")) {
    const Token& at = next();
    a = operate(at, at.text == "+" ? Operation::kAdd : Operation::kSubtract, a, product());
  }
  return a;
}

Value Compiler::product() {
  Value a = factor();
  while (is_symbol("*") || is_symbol("/")) {
    const Token& at = next();
    a = operate(at, at.text == "*" ? Operation::kMultiply : Operation::kDivide, a, factor());
  }
  return a;
}

Value Compiler::factor() {
  const Depth depth(*this);
  if (!is_symbol("-")) return part();
  const Token& at = next();
  return operate(at, Operation::kSubtract, {{Emitter::literal(0.0f)}, false}, factor());
}

// A name, number, call or parenthesis, followed by components or an index.
Value Compiler::part() {
  Value value;
  if (peek().kind == Token::Kind::kNumber) {
    value.numbers = {Emitter::literal(next().value)};
  } else if (accept("(")) {
    value = expression();
    expect(")");
  } else if (peek().kind == Token::Kind::kName) {
    value = name_or_call();
  } else {
    refuse(peek(), fmt::format("expected a value, found {}", shown(peek())));
  }
  while (is_symbol(".") || is_symbol("[")) value = select(value);
  return value;
}

// .xyzw, .rgba or [index]
Value Compiler::select(const Value& a) {
  if (accept("[")) {
    const Token& at = peek();
    const Scalar index = one(at, expression());
    expect("]");
    if (index.kind != Kind::kLiteral) refuse(at, "an index must be known when the program is compiled");
    const float n = index.value;
    if (!(n >= 0 && n < static_cast<float>(a.size())) || n != std::floor(n))
      refuse(at, fmt::format("the index is {:g}, outside 0 to {}", n, a.size() - 1));
    return {{a.numbers[static_cast<std::size_t>(n)]}, false};
  }
  next();
  const Token& names = next();
  if (a.row) refuse(names, fmt::format("{} has no components, only an index", type_name(a)));
  Value out;
  for (const char c : names.kind == Token::Kind::kName ? names.text : std::string_view()) {
    const std::size_t n = std::min(std::string_view("xyzw").find(c), std::string_view("rgba").find(c));
    if (n >= a.numbers.size() || out.size() == 4) {
      out.numbers.clear();
      break;
    }
    out.numbers.push_back(a.numbers[n]);
  }
  if (out.numbers.empty()) refuse(names, fmt::format("{} has no component {}", type_name(a), shown(names)));
  return out;
}

Value Compiler::name_or_call() {
  const Token& name = next();
  if (!is_symbol("(")) {
    const Symbol* symbol = find(name.text);
    if (symbol == nullptr) refuse(name, fmt::format("'{}' is not known", name.text));
    return symbol->value;
  }
  const Depth depth(*this);
  next();
  std::vector<Value> arguments;
  while (!is_symbol(")")) {
    if (!arguments.empty()) expect(",");
    arguments.push_back(expression());
    if (arguments.size() > 16) refuse(name, "more than 16 arguments");
  }
  next();
  emitter_->set_place(name);
  const std::size_t count = in_call_ ? callable_ : functions_.size();
  for (std::size_t k = 0; k < count; ++k)
    if (functions_[k].name == name.text) {
      const std::size_t before = callable_;
      callable_ = k;
      Value value = call(name, functions_[k], std::move(arguments));
      callable_ = before;
      return value;
    }
  return call_builtin(name, arguments);
}

Value Compiler::call(const Token& name, const Function& function, std::vector<Value> arguments) {
  if (arguments.size() != function.arguments.size())
    refuse(name,
           fmt::format("'{}' takes {} arguments, not {}", name.text, function.arguments.size(), arguments.size()));
  const std::size_t back = at_, scope = symbols_.size(), barrier = barrier_, visible = visible_;
  const bool in_call = in_call_;
  barrier_ = scope, visible_ = function.symbols, in_call_ = true;
  for (std::size_t k = 0; k < arguments.size(); ++k)
    add_symbol(name, {function.arguments[k], Symbol::Role::kLet, std::move(arguments[k])});
  at_ = function.body;
  std::optional<Value> value;
  if (function.expression) {
    value = expression();
    expect(";");
  } else {
    value = block();
  }
  if (!value) refuse(name, fmt::format("'{}' returns nothing", name.text));
  symbols_.resize(scope);
  barrier_ = barrier, visible_ = visible, in_call_ = in_call;
  at_ = back;
  return *value;
}

// The numbers of all arguments in a row; one number fills the whole vector.
Value Compiler::joined(const Token& name, std::size_t size, const std::vector<Value>& arguments) const {
  Value out;
  for (const Value& v : arguments) {
    if (v.row) refuse(name, fmt::format("{} is taken apart by an index first", type_name(v)));
    out.numbers.insert(out.numbers.end(), v.numbers.begin(), v.numbers.end());
  }
  if (out.size() == 1) out.numbers.resize(size, Scalar(out.numbers[0]));
  if (out.numbers.size() != size)
    refuse(name, fmt::format("'{}' takes {} numbers, not {}", name.text, size, out.size()));
  return out;
}

Value Compiler::call_builtin(const Token& name, const std::vector<Value>& arguments) {
  BuiltinCall call{name, *emitter_, program_->kind, {}};
  for (const Value& v : arguments) {
    if (v.row) refuse(name, fmt::format("{} is taken apart by an index first", type_name(v)));
    call.arguments.push_back(v.numbers);
  }
  if (name.text == "vec2" || name.text == "vec3" || name.text == "vec4")
    return joined(name, static_cast<std::size_t>(name.text.back() - '0'), arguments);
  if (auto whole = call_on_vectors(call)) return {std::move(*whole), false};
  const std::optional<NumberFunction> function = number_function(call);
  if (!function) refuse(name, fmt::format("there is no function '{}'", name.text));
  return each(name, arguments, [&](const std::vector<Scalar>& n) { return (*function)(*emitter_, n); });
}

// ---- The program ------------------------------------------------------------------------------------------------

std::size_t Compiler::compile(Program& program) {
  program_ = &program;
  next();  // the program's kind
  std::size_t inputs = 0;
  for (const ProgramInput& input : program_inputs(program.kind)) {
    Symbol symbol{input.name, Symbol::Role::kLet, {}};
    for (int k = 0; k < input.size; ++k)
      symbol.value.numbers.push_back({Kind::kVarying, 0, static_cast<int>(inputs++)});
    symbols_.push_back(std::move(symbol));
  }
  emitter_.emplace(inputs);
  const Token& name = expect_new_name();
  emitter_->set_place(name);
  program.declaration.name = name.text;
  if (peek().kind == Token::Kind::kText) program.declaration.meaning = next().text;
  expect("{");
  std::optional<Value> result;
  bool declaring = true;
  while (!is_symbol("}")) {
    const Token& at = peek();
    if (result) refuse(at, "nothing may follow 'return'");
    emitter_->set_place(at);
    const bool shape = program.kind == ProgramKind::kShape;
    if (accept_word("param")) {
      // Parameters are the first constants.
      if (!declaring) refuse(at, "parameters come before statements");
      declare_parameter();
    } else if (shape && accept_word("patches")) {
      for (int* count : {&program.declaration.patches_u, &program.declaration.patches_v}) {
        const Token& number = peek();
        *count = static_cast<int>(expect_count(1, 64));
        if ((*count & (*count - 1)) != 0) refuse(number, "patches are a power of two");
        if (count == &program.declaration.patches_u) expect(",");
      }
      expect(";");
    } else if (shape && accept_word("kinks")) {
      expect(";");
      program.declaration.kinks = true;
    } else if (accept_word("fn")) {
      declare_function();
    } else {
      declaring = false;
      result = statement();
    }
  }
  const Token& end = next();
  if (!result) refuse(end, "the program returns nothing");
  emitter_->set_place(end);
  const auto size = static_cast<int>(program_result_size(program.kind));
  if (result->row || result->size() != size)
    refuse(end, fmt::format("the program returns {}, not a vec{}", type_name(*result), size));
  emitter_->finish(result->numbers, program);
  program.declaration.parameters = program.parameters;
  return at_;
}

}  // namespace
}  // namespace program_text

CompiledText compile_programs(std::string_view text) {
  using namespace program_text;
  CompiledText out;
  if (text.size() > ProgramLimits::kSourceBytes) {
    out.fault = ProgramFault{
        1, 1, fmt::format("the text has {} bytes, more than {}", text.size(), ProgramLimits::kSourceBytes)};
    return out;
  }
  const auto source = std::make_shared<const std::string>(text);
  try {
    const std::vector<Token> tokens = split(*source);
    std::size_t at = 0, steps = 0;
    if (tokens.size() == 1) refuse(tokens[0], "there is no program");
    while (tokens[at].kind != Token::Kind::kEnd) {
      auto program = std::make_shared<Program>();
      program->source = source;
      std::shared_ptr<const Program>* to = nullptr;
      const std::pair<ProgramKind, std::shared_ptr<const Program>*> kinds[] = {
          {ProgramKind::kShape, &out.programs.shape},
          {ProgramKind::kTexture, &out.programs.texture},
          {ProgramKind::kRates, &out.programs.rates}};
      for (const auto& [kind, place] : kinds)
        if (tokens[at].kind == Token::Kind::kName && tokens[at].text == program_kind_name(kind))
          program->kind = kind, to = place;
      if (to == nullptr)
        refuse(tokens[at], fmt::format("expected 'shape', 'texture' or 'rates', found {}", shown(tokens[at])));
      if (*to != nullptr) refuse(tokens[at], fmt::format("a second {}", tokens[at].text));
      at = Compiler(tokens, at, steps).compile(*program);
      *to = std::move(program);
    }
  } catch (const Fault& fault) {
    out.programs = {};
    out.fault = fault.fault;
  }
  return out;
}

}  // namespace tessera::shaders

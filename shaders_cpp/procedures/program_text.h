#pragma once

#include <string_view>
#include <vector>

#include "shaders_cpp/procedures/program.h"

namespace tessera::shaders::program_text {

// A word of a program's text.
struct Token {
  enum class Kind : std::uint8_t { kName, kNumber, kText, kSymbol, kEnd };
  Kind kind = Kind::kEnd;
  std::string_view text;  // of kText without its quotes
  float value = 0;        // of kNumber
  int line = 1, column = 1;
};

// Thrown inside the compiler; compile_programs() turns it into a value.
struct Fault {
  ProgramFault fault;
};
[[noreturn]] void refuse(const Token& at, std::string message);

// What messages call a token.
std::string shown(const Token& token);

// All tokens of a text of at most ProgramLimits::kSourceBytes; the last is kEnd. Views into `text`.
std::vector<Token> split(std::string_view text);

}  // namespace tessera::shaders::program_text

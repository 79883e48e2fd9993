#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "shaders_cpp/procedures/program_emitter.h"

namespace tessera::shaders::program_text {

// The functions that every program has.
struct BuiltinCall {
  const Token& name;
  Emitter& emitter;
  ProgramKind kind;
  std::vector<std::vector<Scalar>> arguments;
};

// Functions of whole vectors; none where the name is not one of theirs.
std::optional<std::vector<Scalar>> call_on_vectors(const BuiltinCall& call);

// Functions that work number by number.
using NumberFunction = std::function<Scalar(Emitter&, const std::vector<Scalar>&)>;
std::optional<NumberFunction> number_function(const BuiltinCall& call);

}  // namespace tessera::shaders::program_text

#pragma once

#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>

#include "shaders_cpp/procedures/program.h"
#include "shaders_cpp/procedures/uniforms.h"
#include "tests/support/procedures.h"

namespace tessera::test {

inline constexpr int kTextureCount = 4;

// The built-in stages as programs, by their names.
inline const std::map<std::string, std::string>& builtin_programs() {
  static const std::map<std::string, std::string> kPrograms = [] {
    std::map<std::string, std::string> programs;
    std::ifstream text(TESSERA_SOURCE_DIR "/shaders_cpp/procedures/builtin_stages.txt");
    std::string* program = nullptr;
    for (std::string line; std::getline(text, line);) {
      std::istringstream words(line);
      std::string kind, name;
      if (words >> kind >> name; kind == "shape" || kind == "texture" || kind == "rates") program = &programs[name];
      if (program != nullptr) *program += line + "\n";
    }
    return programs;
  }();
  return kPrograms;
}

// A built-in stage's text, compiled.
inline shaders::ProgramSet builtin(std::string_view stage) {
  const auto found = builtin_programs().find(std::string(stage));
  if (found == builtin_programs().end()) return {};
  const shaders::CompiledText compiled = shaders::compile_programs(found->second);
  if (compiled.fault)
    throw std::logic_error(std::string(stage) + ":" + std::to_string(compiled.fault->line) + ":" +
                           std::to_string(compiled.fault->column) + ": " + compiled.fault->message);
  return compiled.programs;
}

// A built-in shape as a program, with the same parameters.
struct ShapeTwin {
  ShapeTwin(shaders::ShapeId id, const shaders::ShapeInput& from)
      : program(builtin(shaders::shape_declarations()[static_cast<std::size_t>(id)].name).shape),
        constants(program->bind(from.p)),
        input(from) {
    input.program = program.get();
    input.constants = constants.data();
  }
  ShapeTwin(const ShapeTwin&) = delete;
  ShapeTwin& operator=(const ShapeTwin&) = delete;

  std::shared_ptr<const shaders::Program> program;
  std::vector<float> constants;
  shaders::ShapeInput input;
};

inline std::array<float, 12> random_texture(Random& random, shaders::TextureId id) {
  std::array<float, 12> p{};
  for (std::size_t k = 0; k < 6; ++k) p[k] = random.uniform(0, 1);
  p[6] = random.uniform(0, 8), p[7] = random.uniform(0, 3);
  p[8] = id == shaders::TextureId::kMarble ? static_cast<float>(random.integer(1, 8)) : random.uniform(0, 0.3f);
  return p;
}

struct TextureTwin {
  TextureTwin(shaders::TextureId id, const std::array<float, 12>& numbers)
      : program(builtin(shaders::texture_declarations()[static_cast<std::size_t>(id)].name).texture),
        constants(program->bind(numbers)) {}
  TextureTwin(const TextureTwin&) = delete;
  TextureTwin& operator=(const TextureTwin&) = delete;
  void put(shaders::SurfaceProgram& surface) const {
    surface.texture = shaders::TextureId::kProgram;
    surface.texture_program = program.get();
    surface.texture_constants = constants.data();
  }

  std::shared_ptr<const shaders::Program> program;
  std::vector<float> constants;
};

}  // namespace tessera::test

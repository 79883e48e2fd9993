#include "shaders_cpp/procedures/program.h"

#include <algorithm>

#include "base/check.h"
#include "shaders_cpp/procedures/procedures.h"

namespace tessera::shaders {

std::span<const ProgramInput> program_inputs(ProgramKind kind) {
  static const ProgramInput kShape[] = {{"u", 1, "first parameter, of the piece"},
                                        {"v", 1, "second parameter, of the piece"}};
  static const ProgramInput kTexture[] = {{"u", 1, "first parameter, of the whole shape"},
                                          {"v", 1, "second parameter, of the whole shape"},
                                          {"object", 3, "position in object space"},
                                          {"world", 3, "position in the scene"},
                                          {"normal", 3, "unit, in the scene, towards the viewer if double-sided"},
                                          {"view", 3, "unit, in the scene, towards the viewer"},
                                          {"pixel", 1, "width of a pixel on the surface, in object space"}};
  static const ProgramInput kRates[] = {
      {"u", 1, "first parameter in the middle of a cell, of the piece"},
      {"v", 1, "second parameter there"},
      {"size", 2, "the cell's sides in these parameters"},
      {"reach", 2,
       "most pixels that a point of the image moves from the cell's middle to its side, along each parameter"},
      {"spacing", 1, "pixels that half a step may move a sample"}};
  switch (kind) {
    case ProgramKind::kShape:
      return kShape;
    case ProgramKind::kTexture:
      return kTexture;
    case ProgramKind::kRates:
      return kRates;
  }
  return {};
}

std::string_view program_kind_name(ProgramKind kind) {
  return kind == ProgramKind::kShape ? "shape" : kind == ProgramKind::kTexture ? "texture" : "rates";
}

std::vector<float> Program::bind(std::span<const float> numbers) const {
  TESSERA_CHECK(numbers.size() >= parameter_numbers, "numbers of all parameters");
  std::vector<float> out = constants;
  std::copy_n(numbers.begin(), parameter_numbers, out.begin());
  // Constants are the registers of the setup.
  run_instructions<true, float, 1>(setup, out.data(), nullptr, 1, reinterpret_cast<float(*)[1]>(out.data()));
  return out;
}

std::array<double, 2> program_rates(const Program& program, const float* constants, std::span<const double> inputs) {
  ProgramRegisters<double, 1> registers;
  for (const Program::Input& input : program.inputs) registers.at[input.to][0] = inputs[input.number];
  run_instructions<false, double, 1>(program.instructions, constants, nullptr, 1, registers.at);
  return {registers.at[program.result[0]][0], registers.at[program.result[1]][0]};
}

}  // namespace tessera::shaders

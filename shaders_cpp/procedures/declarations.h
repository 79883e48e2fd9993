#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace tessera::shaders {

// Form of a parameter in a capture, and its layout in the block that a procedure reads.
enum class ParameterLayout : std::uint8_t {
  kNumbers,  // `size` numbers, as many in the block
  kChainU,   // points (a, b) of joined cubic Bezier curves, 3 n + 1 of them; the surface is cut into n pieces along u
  kChainV,   // the same along v; a piece's block has the 8 numbers of its own curve's control points
};

struct ParameterDeclaration {
  std::string_view name;
  ParameterLayout layout;
  int size;             // numbers in the block
  float default_value;  // default of each number; kRequired if the capture must give the parameter
  float min, max;
  std::string_view meaning;

  static constexpr float kRequired = -3e38f;
  bool required() const { return default_value == kRequired; }
};

// A passive mesh on a grid of width x height points, read by the shape geometryImage like a texture.
struct GeometryImage {
  int width = 0, height = 0;
  std::vector<float> x, y, z;  // row by row
};

inline constexpr std::size_t kBlockNumbers = 48;

struct Program;

// Inputs of a shape besides (u, v): the numbers of its declaration, in order.
struct ShapeInput {
  std::array<float, kBlockNumbers> p{};
  const GeometryImage* image = nullptr;
  const Program* program = nullptr;  // for ShapeId::kProgram, with its constants (Program::bind)
  const float* constants = nullptr;
};

// Every stage that captures can name, by kind. To add one: write the struct (shapes.inc, textures.inc, shading.inc) and
// its name here; the reader, the bounds, the sampling controller, the tessellator and the documents walk these lists.
// clang-format off
#define TESSERA_SHAPES(X) \
  X(Sphere) X(Cylinder) X(Torus) X(Revolution) X(SweptCubic) X(BilinearPatch) X(BicubicPatch) X(HeightField) X(Spring) \
  X(GeometryImageMesh)
#define TESSERA_TEXTURES(X) X(Plain) X(Checker) X(Marble) X(Wood)
#define TESSERA_SHADING(X) X(Material) X(Phong) X(Gooch)
// clang-format on

#define TESSERA_STAGE_NAME(name) k##name,
// kProgram: a stage of the user's own (program.h).
enum class ShapeId : std::uint8_t { TESSERA_SHAPES(TESSERA_STAGE_NAME) kProgram };
enum class TextureId : std::uint8_t { TESSERA_TEXTURES(TESSERA_STAGE_NAME) kProgram };
enum class ShadingId : std::uint8_t { TESSERA_SHADING(TESSERA_STAGE_NAME) };
#undef TESSERA_STAGE_NAME

// Name, meaning and parameters of one stage, for captures and people.
struct StageDeclaration {
  std::string_view name, meaning;
  std::span<const ParameterDeclaration> parameters;
  int patches_u = 1, patches_v = 1;  // shapes: base patches of a piece when it is tessellated
  bool kinks = false;                // shapes: derivatives may jump inside a piece
};

std::span<const StageDeclaration> shape_declarations();    // by ShapeId
std::span<const StageDeclaration> texture_declarations();  // by TextureId
std::span<const StageDeclaration> shading_declarations();  // by ShadingId

}  // namespace tessera::shaders

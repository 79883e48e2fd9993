#pragma once

#include <array>

#include "base/vec.h"
#include "shaders_cpp/procedures/declarations.h"

namespace tessera::shaders {

// A light in the uniform registers of the SIMD array's shading stage.
struct ProcedureLight {
  bool directional = true;
  std::array<float, 3> direction{0, 1, 0};  // towards the light, unit
  std::array<float, 3> position{};
  std::array<float, 3> color{1, 1, 1};  // linear irradiance, or intensity of a point light
};

// All lights; Gooch shading uses the first one's direction. A scene without lights has one from above, front left.
struct ProcedureLights {
  static constexpr int kMax = 8;
  int count = 1;
  std::array<ProcedureLight, kMax> light{};
  std::array<float, 3> eye{};  // world; the direction towards the viewer if the camera is orthographic
  bool orthographic = false;
};

// Uniform registers of the stages after geometry, for one piece of one object at one time.
struct SurfaceProgram {
  TextureId texture = TextureId::kPlain;
  ShadingId shading = ShadingId::kPhong;
  std::array<float, 12> texture_numbers{};
  std::array<float, 8> shading_numbers{};
  const Program* texture_program = nullptr;  // for TextureId::kProgram, with its constants
  const float* texture_constants = nullptr;
  float u_first = 0, u_scale = 1, v_first = 0,
        v_scale = 1;       // (u, v) of the whole shape = first + scale * (u, v) of the piece
  bool two_sided = false;  // normals turn towards the viewer; otherwise back faces stay dark
  Mat4 to_world{1.0f};
  Mat3 normal_to_world{1.0f};
  float pixel = 0, pixel_by_depth = 0;  // width of a pixel in object space: pixel + pixel_by_depth * depth
  ProcedureLights lights;
};

}  // namespace tessera::shaders

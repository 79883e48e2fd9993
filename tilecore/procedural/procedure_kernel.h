#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "base/vec.h"
#include "shaders_cpp/procedures/uniforms.h"
#include "tilecore/tessellation/tessellator_kernel.h"

namespace tessera::tilecore {

// The emulated SIMD array: runs the stages of a procedure on many samples at once. Between stages all values stay in
// registers; SampleRegisters holds the values that leave the array for the tile buffer. Gives the same bits on every
// instruction set.

inline constexpr std::size_t kArraySamples = 256;

// Values that the array hands to the tile buffer, one column per sample. Inputs are u and v.
struct SampleRegisters {
  alignas(64) std::array<float, kArraySamples> u, v;
  // Raster-space position and its derivatives by u and by v, per key: x, y, z, x_u, y_u, z_u, x_v, y_v, z_v. With
  // `divided` x and y are pixels; otherwise they are homogeneous, and in perspective z is their divisor.
  enum Column : std::size_t { kX, kY, kZ, kXu, kYu, kZu, kXv, kYv, kZv, kColumns };
  alignas(64) std::array<std::array<std::array<float, kArraySamples>, kColumns>, 2> at;
  alignas(64) std::array<float, kArraySamples> r, g, b;  // shaded runs only
};

// Uniform registers of one piece of one object.
struct ArrayProgram {
  shaders::ShapeId shape = shaders::ShapeId::kSphere;
  const shaders::ShapeInput* input = nullptr;
  const shaders::ShapeInput* close = nullptr;  // at the second key, if the shape deforms; else nullptr
  std::array<Mat4, 2> to_raster{Mat4(1.0f), Mat4(1.0f)};
  int keys = 1;  // 2: it moves
  bool orthographic = false;
  bool divided = true;                               // one key only
  const shaders::SurfaceProgram* surface = nullptr;  // texture and shading run too
};

// Geometry -> view, and with a surface program transform -> texture -> shade, for the first `count` samples.
void run_procedure(const ArrayProgram& program, std::size_t count, SampleRegisters& registers);

// Object-space points alone, for the tessellator; arrays are padded by a vector.
void procedure_vertices(shaders::ShapeId shape, const shaders::ShapeInput& input, const float* u, const float* v,
                        std::size_t count, PointArrays position);

}  // namespace tessera::tilecore

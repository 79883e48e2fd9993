#pragma once

#include <cstdint>

#include "shaders_cpp/procedures/uniforms.h"

namespace tessera::shaders {

// Operations of one evaluation, counted by running the templates with a number type that counts. Noise counts as its
// interpolation; its hashes, a table lookup in the published machine, do not count.
struct OperationCount {
  std::uint64_t multiplies = 0, adds = 0, divides = 0, square_roots = 0, comparisons = 0;
  std::uint64_t total() const { return multiplies + adds + divides + square_roots + comparisons; }
};

OperationCount count_position(ShapeId shape, const ShapeInput& input);  // as for a vertex
OperationCount count_geometry(ShapeId shape, const ShapeInput& input);  // position and tangents, as for a sample
OperationCount count_surface(const SurfaceProgram& program);            // transform, texture and shading
// The viewing transform: three rows of a matrix and one division.
inline OperationCount count_view() { return {17, 12, 1, 0, 0}; }

}  // namespace tessera::shaders

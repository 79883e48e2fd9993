#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "base/vec.h"
#include "shaders_cpp/bicubic.h"
#include "shaders_cpp/texture.h"

namespace tessera::tilecore {

// SIMD parts of the tessellator. Every function gives the same bits on every instruction set.

// Object-space vertices as structure of arrays.
struct PointArrays {
  float* x;
  float* y;
  float* z;
};

// Evaluates `count` points of a row at parameters u. Normals (and whether they may be trusted, see regular_normal) are
// computed when `normal_margin` is not null.
void evaluate_row(const shaders::BicubicRow<float>& row, const float* u, std::size_t count, PointArrays position,
                  PointArrays normal, float* normal_margin);

// position += normal * offset, component by component.
void displace(std::size_t count, const float* offset, PointArrays normal, PointArrays position);

// ScalarTexture::sample() at `count` coordinates (u, v), with the same bits.
void sample_heights(const shaders::HeightView& texture, const shaders::Sampler& sampler, float lod, const float* u,
                    const float* v, std::size_t count, float* heights);

// Settings of the projection to raster-space vertices (see MicroMesh).
struct ProjectionSettings {
  bool orthographic;
  float near;
  float subpixels;  // steps of the vertices' grid along a pixel's side: a power of two up to 256
};

// Object space to raster space at one or two motion keys (`moving`); fills x, y, z per key and `projected`. A projected vertex
// that moves by no more than scene::kStillPixels and kStillDepth gets the same bits at both. Returns whether every
// vertex is projected.
bool project_vertices(std::size_t count, const std::array<PointArrays, 2>& object, const std::array<Mat4, 2>& to_raster,
                      bool moving, const ProjectionSettings& settings, const std::array<PointArrays, 2>& raster,
                      std::uint8_t* projected);

}  // namespace tessera::tilecore

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "tilecore/shading/draw_inputs.h"

namespace tessera::tilecore {

// Vertices of a draw of patches: the first control point of the patch, parameters in it, level of detail of its
// heights. All arrays, and the arrays of the results, reach to the next multiple of 16; lanes beyond the last vertex
// repeat the values of some vertex.
struct VertexArrays {
  const std::int32_t* point = nullptr;
  const float *u = nullptr, *v = nullptr, *lod = nullptr;
};

// Place in object space, and normals that are unit vectors in the world: at both keys for a drawable that moves without
// deforming, else at the requested key alone.
struct VertexPlaces {
  std::array<float*, 3> position{}, normal{}, normal_at_close{};
  std::array<float*, 4> tangent{};
};

// Evaluates `count` vertices at a motion key, on SIMD lanes. `base_normals`: without the displacement. `tangents`: the
// slot whose coordinate they follow; nullptr: none.
void place_vertices(const DrawConstants& draw, const VertexArrays& in, std::size_t count, std::size_t key,
                    bool base_normals, const scene::TextureSlot* tangents, const VertexPlaces& out);

// The vertices' coordinates of a set, and their colours.
void vertex_texcoords(const DrawConstants& draw, const VertexArrays& in, std::size_t count, int set,
                      const std::array<float*, 2>& out);
void vertex_colors(const DrawConstants& draw, const VertexArrays& in, std::size_t count,
                   const std::array<float*, 4>& out);

}  // namespace tessera::tilecore

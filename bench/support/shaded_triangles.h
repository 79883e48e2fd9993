#pragma once

#include <cstdint>
#include <vector>

#include "scene/frame_geometry.h"

namespace tessera::bench {

// The triangles of a frame at shutter open, for a renderer that shades. Vertices hold all that its pixel shader reads; the
// draws are in the order that a good engine uses.
struct ShadedTriangles {
  struct Vertex {
    Vec4 clip;  // OpenGL's, homogeneous; w is the depth, and z / w runs from 1 at the near plane to 0 far away
    Vec3 position, normal;  // world
    Vec2 texcoord;          // in the images of the material
    Vec4 color;
  };
  // Triangles of one material that follow each other; `colored`: the shader multiplies by the vertices' colours.
  struct Draw {
    const scene::Material* material;
    bool colored;
    std::size_t first, count;  // in `indices`
  };
  std::vector<Vertex> vertices;
  std::vector<std::uint32_t> indices;  // three per triangle; a front face is counter-clockwise with y up
  // Opaque draws come first, then masked, then blended ones. Opaque and masked patches are grouped by material, and near
  // groups and patches come before far ones. Blended patches are sorted from far to near across all materials.
  std::vector<Draw> draws;

  std::size_t triangle_count() const { return indices.size() / 3; }
};

// The slot whose coordinates a material reads all its textures at (base colour, metalness and roughness, emission); null if
// it has none of them. Throws std::runtime_error if it reads them at several coordinates.
const scene::TextureSlot* image_coordinates(const scene::Material& material);

// Tessellates `patches` whole; the frame must outlive the list. Throws std::runtime_error for an orthographic camera.
ShadedTriangles list_shaded_triangles(const scene::FrameGeometry& frame, const std::vector<std::uint32_t>& patches);

}  // namespace tessera::bench

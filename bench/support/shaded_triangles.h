#pragma once

#include <cstdint>
#include <vector>

#include "scene/frame_geometry.h"

namespace tessera::bench {

// The triangles of a frame at shutter open, for a renderer that shades. Vertices hold all inputs of its pixel shader;
// the draws are in the order of a good engine.
struct ShadedTriangles {
  struct Vertex {
    Vec4
        clip;  // OpenGL's homogeneous coordinates; w is the depth, and z / w runs from 1 at the near plane to 0 far away
    Vec3 position, normal;  // world
    Vec2 texcoord;          // coordinates in the images of the material
    Vec4 color;
  };
  // Consecutive triangles of one material; `colored`: the shader multiplies by the vertices' colours.
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

// The slot with the coordinates at which a material reads all its textures (base colour, metalness and roughness,
// emission); nullptr if it has no texture. Throws std::runtime_error if it reads them at several coordinates.
const scene::TextureSlot* image_coordinates(const scene::Material& material);

// Tessellates `patches` as a whole; the frame must outlive the list. Throws std::runtime_error for an orthographic camera.
ShadedTriangles list_shaded_triangles(const scene::FrameGeometry& frame, const std::vector<std::uint32_t>& patches);

}  // namespace tessera::bench

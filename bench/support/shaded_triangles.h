#pragma once

#include <cstdint>
#include <vector>

#include "scene/frame_geometry.h"

namespace tessera::bench {

// Triangles of a frame at shutter open for renderers that shade: vertices with all that a pixel shader reads, in the order
// in which a good engine draws them.
struct ShadedTriangles {
  struct Vertex {
    Vec4 clip;  // OpenGL's, homogeneous; w is the depth, and z / w runs from 1 at the near plane to 0 far away
    Vec3 position, normal;  // world
    Vec2 texcoord;          // in the images of the material
    Vec4 color;
  };
  // Of one material; `colored`: its vertices have colours.
  struct Draw {
    const scene::Material* material;
    bool colored;
    std::size_t first, count;  // in `indices`
  };
  std::vector<Vertex> vertices;
  std::vector<std::uint32_t> indices;  // three per triangle; a front face is counter-clockwise with y up
  // Opaque ones, masked ones, blended ones. Within the first two the patches of a material are together, and what is near
  // comes first, patches and materials; blended patches come from far to near, whatever their materials.
  std::vector<Draw> draws;

  std::size_t triangle_count() const { return indices.size() / 3; }
};

// The slot whose coordinates all images of a material are read at: base colour, metalness and roughness, emission; null
// where it has none of them. Throws std::runtime_error where they are read at several.
const scene::TextureSlot* image_coordinates(const scene::Material& material);

// Tessellates `patches` whole; the frame must outlive the list. Throws std::runtime_error for an orthographic camera.
ShadedTriangles list_shaded_triangles(const scene::FrameGeometry& frame, const std::vector<std::uint32_t>& patches);

}  // namespace tessera::bench

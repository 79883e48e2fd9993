#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "hardware/shader_costs.h"
#include "scene/frame_geometry.h"
#include "tilecore/shading/draw_inputs.h"

namespace tessera::tilecore {

// Whether pixels of the drawable turn interpolated normals by the gradient of its heights (shading.surface=frame).
bool adds_height_normals(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable);

// Whether pixels interpolate what the vertices of the drawable's grids have (shading.surface=interpolated) instead of
// evaluating its patches again.
bool interpolates_surface(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable);

// Bytes of one vertex in the tile memory, for pixels of the drawable: where it is in the world and in the image and its
// normal, at each motion key where it moves, 40 bytes; its tangent likewise, 16, where a normal map is read along it;
// texture coordinates that the material reads, 8 each, with those of heights that pixels look up, and colour, 16. Attributes take half of that with
// shading.attributes=half.
std::uint64_t vertex_output_bytes(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable);

// Whether vertices have tangents for a material's normal maps and anisotropy: they read along one coordinate.
bool has_vertex_tangents(const scene::Material& material);

// The shader that evaluates such vertices of a drawable.
hardware::ShaderFeatures output_features(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable);

// The vertices of Bezier patches that a tile's pixels see, as a mesh: a core evaluates each once for the tile, before its
// pixels, and keeps it in the tile memory. A vertex is a function of its patch and its place in the grid alone. Keeps its
// scratch memory from draw to draw; one instance per thread.
//
// Invariants (cited by the tests):
//   VO1  What is interpolated at a vertex is the surface there; its normal is a unit vector in the world. With
//        shading.surface=frame the normal is that without displacement, and a pixel that turns it has the displaced one
//        wherever the patch is flat.
//   VO2  Each vertex of the triangles that were asked for is evaluated once.
class VertexOutputs {
 public:
  // kAlphaTest: vertices have what alpha tests read, the coordinates of the colour texture and colours, beside their places.
  enum class Use : std::uint8_t { kPixels, kAlphaTest };
  // Starts a draw of a drawable of Bezier patches in a frame or a segment of it, which must stay.
  void begin(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable, Use use = Use::kPixels);
  // Vertices of a triangle of a patch's grid, by number in the mesh.
  std::array<std::int32_t, 3> triangle(std::uint32_t patch, std::uint32_t number);
  std::size_t count() const { return positions_[0].size(); }
  // Makes a draw's geometry the mesh as it is now; until the next call of another function.
  void set_mesh(DrawConstants& draw);

 private:
  // The number of the vertex `name`: its patch, and its place in the grid. Free where the draw is another one.
  struct Place {
    std::uint64_t name = 0;
    std::uint32_t draw = 0;
    std::int32_t number = 0;
  };

  std::int32_t vertex(std::uint32_t patch, int i, int j, const scene::TessellationPattern& pattern);
  void evaluate(std::uint32_t patch, float u, float v);
  // Its place, or a free one for it.
  Place& place_of(std::uint64_t name);
  void grow();

  const scene::FrameGeometry* frame_ = nullptr;
  DrawConstants patches_;  // attributes of vertices are not rounded
  bool height_normals_ = false;
  std::uint64_t sets_ = 0;  // of coordinates that the material reads, a bit each
  // Which texture's coordinate tangents run along; null: there are none.
  const scene::TextureSlot* tangent_slot_ = nullptr;
  scene::PosedDrawable mesh_;
  scene::Drawable mesh_drawable_;
  scene::Primitive mesh_primitive_;
  std::array<std::vector<Vec3>, 2> positions_, normals_;
  std::array<std::vector<Vec4>, 2> tangents_;
  std::vector<Place> places_;  // a power of two
  std::uint32_t draw_ = 0;
};

}  // namespace tessera::tilecore

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "hardware/shader_costs.h"
#include "scene/frame_geometry.h"
#include "tilecore/shading/draw_inputs.h"
#include "tilecore/shading/grid_vertices.h"

namespace tessera::tilecore {

// Whether pixels of the drawable turn interpolated normals by the gradient of its heights (shading.surface=frame).
bool adds_height_normals(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable);

// Whether pixels interpolate the attributes of the drawable's grid vertices (shading.surface=interpolated) instead of
// evaluating its patches again, or its procedure if that is drawn as patches.
bool interpolates_surface(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable);

// Bytes of one vertex in the tile memory, for pixels of the drawable: 40 bytes for its places in the world and in the
// image and its normal, at each motion key if it moves; 16 for its tangent likewise, if a normal map is read along it;
// 8 for each set of texture coordinates that the material reads, including the set of looked-up heights; 16 for
// the colour. A procedure's textures are read at the place and the normal in object space, 24 bytes. Attributes take
// half of that with shading.attributes=half.
std::uint64_t vertex_output_bytes(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable);

// Whether vertices have tangents for a material's normal maps and anisotropy: these must read along one coordinate.
bool has_vertex_tangents(const scene::Material& material);

// Costs of the shaders that evaluate a vertex: its place alone, and all outputs for pixels. A procedure's shaders are
// not compiled; its operations are counted (tilecore/procedural/procedure_costs.h).
hardware::ShaderCost place_cost(const scene::PosedDrawable& drawable);
hardware::ShaderCost output_cost(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable);

// The vertices of patches that a tile's pixels see, as a mesh: a core evaluates each once for the tile, before its
// pixels, and keeps it in the tile memory. A vertex is a function of its patch and its place in the grid alone. Keeps
// its scratch memory from draw to draw; one instance per thread.
//
// Invariants (cited by the tests):
//   VO1  The interpolated point at a vertex is the surface there; its normal is a unit vector in the world. With
//        shading.surface=frame the normal is that without displacement, and a pixel that turns it has the displaced one
//        wherever the patch is flat.
//   VO2  Each vertex of the requested triangles is evaluated once.
//   VO3  Vertices of a procedure drawn as patches are its points, and pixels between them have the plane's derivatives.
//   VO4  A vertex evaluated on lanes has the same bits for every SIMD target and on one lane.
class VertexOutputs {
 public:
  // kAlphaTest: besides their places, vertices have the inputs of alpha tests: coordinates of the colour texture, and
  // colours.
  enum class Use : std::uint8_t { kPixels, kAlphaTest };
  // Starts a draw of a drawable of patches in a frame or a segment of it; both must outlive the draw.
  void begin(const scene::FrameGeometry& frame, const scene::PosedDrawable& drawable, Use use = Use::kPixels);
  // Vertices of a triangle of a patch's grid, by number in the mesh.
  std::array<std::int32_t, 3> triangle(std::uint32_t patch, std::uint32_t number);
  std::size_t count() const { return vertices_.count(); }
  // Evaluates the requested vertices and makes the mesh a draw's geometry, until the next call of another function. Not
  // for procedures.
  void set_mesh(DrawConstants& draw);
  // A vertex' place and unit normal in object space at a motion key.
  const Vec3& position(std::size_t key, std::int32_t number) const {
    return positions_[mesh_.deforming ? key : 0][static_cast<std::size_t>(number)];
  }
  const Vec3& normal(std::size_t key, std::int32_t number) const {
    return normals_[mesh_.deforming ? key : 0][static_cast<std::size_t>(number)];
  }

 private:
  // Requests a vertex. Vertices of Bezier patches are evaluated on lanes, all requests since the last time together.
  void ask_for(std::uint32_t patch, float u, float v);
  void evaluate_asked();
  void evaluate_batch(std::size_t first, std::size_t count);
  void evaluate_procedure(std::uint32_t patch, float u, float v);

  const scene::FrameGeometry* frame_ = nullptr;
  const scene::Drawable* source_ = nullptr;  // of the draw
  DrawConstants patches_;                    // attributes of vertices are not rounded
  bool height_normals_ = false;
  std::uint64_t sets_ = 0;  // of coordinates that the material reads, a bit each
  // The texture whose coordinate tangents run along; nullptr: there are no tangents.
  const scene::TextureSlot* tangent_slot_ = nullptr;
  scene::PosedDrawable mesh_;
  scene::Drawable mesh_drawable_;
  scene::Primitive mesh_primitive_;
  std::array<std::vector<Vec3>, 2> positions_, normals_;
  std::array<std::vector<Vec4>, 2> tangents_;
  GridVertices vertices_;
  static constexpr std::size_t kBatch = 64;
  std::vector<std::int32_t> asked_point_;  // as VertexArrays
  std::vector<float> asked_u_, asked_v_, asked_lod_;
  std::array<std::array<float, kBatch>, 13> made_;
};

}  // namespace tessera::tilecore

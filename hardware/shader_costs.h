#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tessera::hardware {

// What shaders cost, counted in compiled code.
//
// shader_costs.csv has what LLVM makes of the machine's own shaders for the gfx1030 ISA (RDNA2): whole shaders, and
// what a feature adds to one. tilecore/shading/cost/make_costs.py makes the table. Included: interpolation of
// attributes (barycentric, from posed vertices that are fetched) or evaluation of the patch, displacement, tangent
// frame, material, built-in environment, blending's alpha. Not included: posing vertices (but for domain shaders, which put
// them into the image), exports, rounding of attributes to half precision, what lies behind (a procedure's own stages).
//
// Invariants (cited by the tests):
//   SHADE1  The table is what the compiler gives.
//   SHADE2  A feature more never costs fewer vector operations or texture instructions, but for specular-glossiness,
//           which comes in place of metalness, and an environment's image, in place of the built-in one. Scalar operations and
//           registers may fall: constants of a uniform roughness are scalar ones, and compilers reorder.
//   SHADE3  The sum of rows is within 5 % (vector operations) of a shader that is compiled whole; texture
//           instructions are equal.

// What a shader's code depends on. Everything else is a number in a constant buffer.
struct ShaderFeatures {
  // kDomain: one vertex. kOutputs: one with the attributes that pixels interpolate, `coordinates` of them. kBackground: the
  // environment along a ray of a camera that is kStill or, turning, kMoving. kFill, kLight: the halves of a lit pixel shader
  // with a G-buffer (tilecore/shading/gbuffer.h).
  enum class Stage : std::uint8_t { kPixel, kAlphaTest, kDomain, kOutputs, kBackground, kFill, kLight };
  enum class Surface : std::uint8_t { kTriangles, kPatch, kDisplacedPatch, kComputed };  // kComputed: by a procedure
  enum class Motion : std::uint8_t { kStill, kMoving, kDeforming };  // kDeforming: both poses of a patch are evaluated
  enum class Normals : std::uint8_t { kOfSurface, kMapped, kMappedAlongTangents };  // tangents derived, or given

  Stage stage = Stage::kPixel;
  Surface surface = Surface::kTriangles;
  Motion motion = Motion::kStill;
  // Derivatives of texture coordinates: differences within quads, by the texture unit, or the surface's own.
  bool quads = false;
  // A pixel shader turns the normal of triangles by the gradient of heights; kOutputs gives one without displacement.
  bool height_normals = false;
  bool unlit = false, vertex_colors = false;
  bool base_color = false, metallic_roughness = false, occlusion = false, emissive = false;  // textures
  Normals normals = Normals::kOfSurface;
  std::uint8_t coordinates = 1;  // different ones that textures are read at
  // Lights by kind: directional, point, point with a range, spot, spot with a range.
  static constexpr std::size_t kLightKinds = 5;
  std::array<std::uint16_t, kLightKinds> lights{};
  bool lights_move = false;
  // Lookups of shadows, by the projection of the maps: orthographic (directional lights), perspective (others). A light has one
  // for each time that it has maps of.
  struct ShadowCasters {
    std::uint16_t lookups = 0, layered = 0, layers = 0;  // layered: those with more than one map; layers: all maps
    bool operator==(const ShadowCasters&) const = default;
  };
  enum class ShadowFilter : std::uint8_t { kNearest, k2x2, k3x3 };
  static constexpr std::size_t kShadowProjections = 2;
  std::array<ShadowCasters, kShadowProjections> shadows{};
  ShadowFilter shadow_filter = ShadowFilter::k2x2;
  bool environment_image = false;  // in place of the built-in one
  // Layers that extensions of materials add, by the names of scene::MaterialEffect.
  std::vector<std::string_view> layers = {};
  std::uint8_t layer_textures = 0;  // of layers, the coat's normal map apart
  bool coat_normals = false;
  bool packed = false;  // the G-buffer of a half: its light half finds places by depths, not by triangles
  bool layered() const { return !layers.empty(); }
  bool has(std::string_view layer) const { return std::find(layers.begin(), layers.end(), layer) != layers.end(); }

  bool operator==(const ShaderFeatures&) const = default;
};

// Instructions that one warp executes, all paths of its code (it has no branches), and the registers of a lane.
struct ShaderCost {
  std::int32_t vector_operations = 0;     // on each lane, one per clock
  std::int32_t transcendental = 0;        // on each lane, a quarter of the rate; whole multiplications too
  std::int32_t scalar = 0;                // once per warp, beside the lanes
  std::int32_t texture_instructions = 0;  // a lookup of each lane
  std::int32_t memory = 0;                // a load of each lane: attributes, control points, the environment's table
  std::int32_t registers = 0;             // vector registers of 32 bits

  bool operator==(const ShaderCost&) const = default;
};

// Sum of the rows of the features.
ShaderCost shader_cost(const ShaderFeatures& features);

// Clocks that a lane needs for its operations, [spec] RDNA2: one each, four for each transcendental one.
constexpr std::int64_t lane_clocks(const ShaderCost& cost) {
  return std::int64_t{cost.vector_operations} + 4 * std::int64_t{cost.transcendental};
}
// Clocks for which a warp of `warp_lanes` occupies `lanes` lanes (both positive); the scalar unit works beside them, one
// operation a clock. Loads and lookups wait elsewhere.
double issue_cycles(const ShaderCost& cost, std::int64_t warp_lanes, std::int64_t lanes);

// ---- The table --------------------------------------------------------------------------------------------------

struct ShaderCostRow {
  std::string_view name;
  ShaderCost cost;
};
std::span<const ShaderCostRow> shader_cost_rows();

}  // namespace tessera::hardware

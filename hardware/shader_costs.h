#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace tessera::hardware {

// Costs of shaders, counted in compiled code.
//
// shader_costs.csv has the instruction counts of the machine's own shaders as LLVM compiles them for the gfx1030 ISA
// (RDNA2): whole shaders, and the increment of each feature. tilecore/shading/cost/make_costs.py makes the table.
// Included: interpolation of attributes (barycentric, from posed vertices that are fetched) or evaluation of the
// patch, displacement, tangent frame, material, built-in environment, alpha of blending. Not included: posing
// vertices (except in domain shaders, which project them), exports, rounding of attributes to half precision,
// background behind surfaces, and the stages of a procedure itself.
//
// Invariants (cited by the tests):
//   SHADE1  The table equals the compiler's output.
//   SHADE2  An additional feature never costs fewer vector operations or texture instructions. Exceptions:
//           specular-glossiness, which replaces metalness, and an environment's image, which replaces the built-in one.
//           Scalar operations and registers may fall: constants of a uniform roughness are scalar ones, and compilers reorder.
//   SHADE3  The sum of rows is within 5 % (vector operations; 7 % for fill halves) of a shader that is compiled whole; texture
//           instructions are equal.

// The features that a shader's code depends on. Everything else is a number in a constant buffer.
struct ShaderFeatures {
  // kDomain: one vertex. kOutputs: one vertex with the attributes that pixels interpolate, `coordinates` of them.
  // kBackground: the environment along a camera ray; the camera is kStill or, if it turns, kMoving. kFill, kLight: the halves
  // of a lit pixel shader with a G-buffer (tilecore/shading/gbuffer.h).
  enum class Stage : std::uint8_t { kPixel, kAlphaTest, kDomain, kOutputs, kBackground, kFill, kLight };
  enum class Surface : std::uint8_t { kTriangles, kPatch, kDisplacedPatch, kComputed };  // kComputed: by a procedure
  enum class Motion : std::uint8_t { kStill, kMoving, kDeforming };  // kDeforming: both poses of a patch are evaluated
  enum class Normals : std::uint8_t { kOfSurface, kMapped, kMappedAlongTangents };  // tangents derived, or given

  Stage stage = Stage::kPixel;
  Surface surface = Surface::kTriangles;
  Motion motion = Motion::kStill;
  // Derivatives of texture coordinates: differences within quads, by the texture unit, or the surface's own.
  bool quads = false;
  // In a pixel shader the gradient of heights tilts the normal of triangles; kOutputs then gives a normal without displacement.
  bool height_normals = false;
  bool unlit = false, vertex_colors = false;
  bool base_color = false, metallic_roughness = false, occlusion = false, emissive = false;  // textures
  Normals normals = Normals::kOfSurface;
  std::uint8_t coordinates = 1;  // number of different texture coordinates
  // Lights by kind: directional, point, point with a range, spot, spot with a range.
  static constexpr std::size_t kLightKinds = 5;
  std::array<std::uint16_t, kLightKinds> lights{};
  bool lights_move = false;
  // Shadow lookups by the projection of the maps: orthographic (directional lights), perspective (others). A light
  // has one lookup for each time at which it has maps.
  struct ShadowCasters {
    std::uint16_t lookups = 0, layered = 0,
                  layers = 0;  // layered: lookups with more than one map; layers: number of all maps
    bool operator==(const ShadowCasters&) const = default;
  };
  enum class ShadowFilter : std::uint8_t { kNearest, k2x2, k3x3 };
  static constexpr std::size_t kShadowProjections = 2;
  std::array<ShadowCasters, kShadowProjections> shadows{};
  ShadowFilter shadow_filter = ShadowFilter::k2x2;
  bool environment_image = false;  // replaces the built-in environment
  // Layers that extensions of materials add, by the names of scene::MaterialEffect.
  std::vector<std::string_view> layers = {};
  std::uint8_t layer_textures = 0;  // textures of layers, except the coat's normal map
  bool coat_normals = false;
  bool packed = false;  // the G-buffer of a half: its light half finds places by depths, not by triangles
  bool layered() const { return !layers.empty(); }
  bool has(std::string_view layer) const { return std::find(layers.begin(), layers.end(), layer) != layers.end(); }

  bool operator==(const ShaderFeatures&) const = default;
};

// Instructions that one warp executes on all paths of its code (it has no branches), and the registers of a lane.
struct ShaderCost {
  std::int32_t vector_operations = 0;     // on each lane, one per clock
  std::int32_t transcendental = 0;        // on each lane, at a quarter of the rate; includes integer multiplications
  std::int32_t scalar = 0;                // once per warp, beside the lanes
  std::int32_t texture_instructions = 0;  // one lookup of each lane
  std::int32_t memory = 0;                // one load of each lane: attributes, control points, the environment's table
  std::int32_t registers = 0;             // vector registers of 32 bits

  bool operator==(const ShaderCost&) const = default;
};

// The sum of the features' rows.
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

#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "scene/frame_geometry.h"
#include "shaders_cpp/layered_material.h"
#include "shaders_cpp/radiance_image.h"
#include "shaders_cpp/shadow_map.h"
#include "tilecore/shading/texture_unit.h"

namespace tessera::tilecore {

// Constants that all invocations of a draw share, in scalar registers: a drawable at one of the shutter's motion
// segments, and the lights of one of them.
struct DrawConstants {
  DrawConstants() {}  // member by member: clearing all of it first takes longer than the rest of an alpha test
  const scene::PosedDrawable* drawable = nullptr;
  const scene::Material* material = nullptr;
  bool grid = false;  // Bezier patches; else clusters
  bool half_attributes = false;
  bool quads = false;  // derivatives are differences within a quad
  // Set for a mesh of a displaced patch's vertices (shading.surface=frame): normals exclude the displacement, and
  // pixels add the gradient of the heights. M M^T of the matrix M from object to world space, at both keys.
  bool height_normals = false;
  std::array<Mat3, 2> height_metric{Mat3(1.0f), Mat3(1.0f)};
  // Camera.
  bool orthographic = false, camera_moves = false;
  Mat3 camera_to_world{1.0f};
  Vec3 eye_open{0.0f}, eye_close{0.0f};
  float center_x = 0, center_y = 0, scale = 1;
  // Light.
  shaders::Lights lights;
  shaders::Surroundings surroundings;
  // Layers of the material, if it has any.
  bool layered = false;
  scene::EffectFlags layers;
  shaders::LayerConstants layer_constants;
  float ior = 1.5f, reflectance = 0.04f;  // of a dielectric: relative index, reflectance at normal incidence
  float anisotropy_cosine = 1.0f, anisotropy_sine = 0.0f;  // of the anisotropy's rotation
  float volume_scale = 1.0f;                               // world units of one unit of the mesh, mean over its axes
  // The image behind transmissive surfaces, a pixel a texel; if empty they show the environment.
  shaders::RadianceView behind;
  float behind_u = 0, behind_v = 0, behind_levels = 0;  // texture coordinates of a pixel; log2 of its width
  // The maps of each of `lights`, one view for each of `shadow_times`, or its shares; nullptr: no light casts shadows.
  const shaders::ShadowView* shadows = nullptr;
  int shadow_times = 1;
  bool shadow_keys = false;  // moving receivers are looked up at their place at the maps' time
};

// Inputs of invocations, lane by lane. Lanes beyond the last invocation repeat the values of some invocation.
struct LaneArrays {
  // Clusters: the vertices of the triangle. Bezier patches: the first control point; cells of the grid along u and v,
  // eight bits each; factors of the four edges, eight bits each (TessellationPattern).
  std::array<const std::int32_t*, 3> vertex{};
  const std::int32_t* triangle = nullptr;            // of a grid
  const float *p = nullptr, *q = nullptr;            // weights of its second and third vertex
  const float *t = nullptr, *light_t = nullptr;      // within their motion segments
  const float* lod = nullptr;                        // of displacement
  const float *step_x = nullptr, *step_y = nullptr;  // to the neighbours in a quad, 1 or -1
};

// Colours, alpha and normals. If a texture unit gets the lines, LookupArrays takes the cache lines that each lookup
// reads: lines[slot][level][corner][lane], -1 for none.
struct ShadedArrays {
  std::array<float*, 3> color{}, normal{};
  float* alpha = nullptr;
};
// Lookups in images of radiance, numbered behind the slots of the material: the images that a surface and its coat
// mirror, and the image seen through it, in one or, with dispersion, in three colours.
enum class ImageLookup : std::uint8_t { kMirrored, kCoat, kBehind, kBehindGreen, kBehindBlue };
inline constexpr std::size_t kTextureSlots = scene::kMaterialTextureCount, kLookupSlots = kTextureSlots + 5;
constexpr std::size_t slot_of(ImageLookup lookup) { return kTextureSlots + static_cast<std::size_t>(lookup); }
inline constexpr std::size_t kLookupLines = 8;  // of each slot: two levels, four texels in each
inline constexpr std::size_t kShadowLines = 4;  // of a lookup of a shadow: four corners of its texels
struct ShadowLookups {
  const TextureLayoutView* layout = nullptr;  // nullptr: no texture unit gets the lines
  std::array<std::int32_t*, kShadowLines> line{};
  std::uint64_t texels = 1;  // texture.texels of a lane
};
struct LookupArrays {
  std::array<const TextureLayoutView*, kLookupSlots> layout{};  // of slots with a texture; nullptr: no lines
  std::array<std::array<std::int32_t*, kLookupLines>, kLookupSlots> line{};
  std::span<const ShadowLookups> shadows{};  // as DrawConstants::lights; empty: no texture unit gets the lines
};

}  // namespace tessera::tilecore

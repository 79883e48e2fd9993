#pragma once

// A draw's constants as a driver sees them: the features of a shader are known when it is compiled, every number is in
// a constant buffer. Replaces scene/ and tilecore/shading/draw_inputs.h under the names that lane_shader.inc uses. Only
// make_costs.py compiles it.

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include "base/vec.h"
#include "shaders_cpp/layered_material.h"

namespace tessera::gpu_cost {

#define TESSERA_CONSTANT __attribute__((address_space(4)))
#define TESSERA_GLOBAL __attribute__((address_space(1)))

using ImageResource = std::int32_t __attribute__((ext_vector_type(8)));
using ImageSampler = std::int32_t __attribute__((ext_vector_type(4)));

// A texture in the form of descriptors.
struct ImageConstants {
  ImageResource resource;
  ImageSampler sampler;
  std::int32_t width[16], height[16];  // of each level
  std::int32_t levels;
};

// The maps of a light, with the matrices from the camera's raster space at both keys to each layer's.
inline constexpr std::size_t kMaxShadowLayers = 4;
struct ShadowUniforms {
  float from_raster[kMaxShadowLayers][2][16], bias[kMaxShadowLayers], size, texel, t, slope_bias, max_slope;
  ImageConstants image;
};

}  // namespace tessera::gpu_cost

namespace tessera::shaders {

struct TextureView {
  const std::int32_t *width, *height;
  const TESSERA_CONSTANT gpu_cost::ImageConstants* image;
  bool quads = false;  // the hardware takes derivatives within quads
};
using HeightView = TextureView;
struct RadianceView {
  const TESSERA_CONSTANT gpu_cost::ImageConstants* image;
  const std::int32_t *width, *height;
  int levels;
};
struct EnvironmentMap {
  RadianceView radiance;
  std::array<Vec3, 9> diffuse;
};
struct Sampler {};

// As in shadow_map.h. The maps of a light are the layers of one image.
enum class ShadowFilter : std::uint8_t { kNearest, k2x2, k3x3 };
struct ShadowLayer {
  std::array<Mat4, 2> from_raster{Mat4(1.0f), Mat4(1.0f)};
  Mat4 from_resting{1.0f};
  float bias = 0;
};
struct ShadowView {
  const TESSERA_CONSTANT gpu_cost::ShadowUniforms* uniforms = nullptr;
  bool there = false;
  float size = 0, texel = 0;  // of an axis, in texels; of a texel, in texture coordinates
  int layers = 0;
  static constexpr int times = 1, first_layer = 0;
  float t = 0;
  bool perspective = false;
  ShadowFilter filter = ShadowFilter::k2x2;
  float slope_bias = 0, max_slope = 0;
  const ShadowLayer* layer = nullptr;

  bool casts() const { return there; }
};
// Slots with the same coordinate number also have the same transform.
template <class T>
struct SharedByCoordinate : T {
  using T::T;
  using T::operator=;
  bool operator==(const SharedByCoordinate&) const { return true; }
};
struct TextureTransform {
  SharedByCoordinate<glm::mat2> matrix;
  SharedByCoordinate<Vec2> offset;
};

}  // namespace tessera::shaders

namespace tessera::scene {

// A compiled shader knows whether a buffer exists, but not its address: neither is a pointer that may be null.
template <class T>
struct Buffer {
  bool there = false;
  const TESSERA_GLOBAL T* first;
  bool empty() const { return !there; }
  const T* data() const { return (const T*)first; }  // NOLINT: between address spaces
};

struct Texture {
  bool there = false;
  shaders::TextureView seen;
  shaders::TextureView view() const { return seen; }
  const Texture* operator->() const { return this; }
  bool operator==(std::nullptr_t) const { return !there; }
};
struct TextureSlot {
  Texture texture;
  shaders::Sampler sampler;
  int texcoord = 0;
  shaders::TextureTransform transform;
};
struct Displacement {
  Texture texture;
  shaders::Sampler sampler;
  int texcoord = 0;
  shaders::TextureTransform transform;
  float scale = 1.0f, bias = 0.0f;
};
enum class AlphaMode : std::uint8_t { kOpaque, kMask, kBlend };
#include "scene/material_effects.inc"
struct Material {
  Vec4 base_color{1.0f};
  float metallic = 1.0f, roughness = 1.0f;
  Vec3 emissive{0.0f};
  float normal_scale = 1.0f, occlusion_strength = 1.0f;
  TextureSlot base_color_texture, metallic_roughness_texture, normal_texture, occlusion_texture, emissive_texture;
  AlphaMode alpha_mode = AlphaMode::kBlend;
  bool unlit = false, glows_unlit = false;
  struct MaybeDisplacement {
    bool there = false;
    Displacement value;
    explicit operator bool() const { return there; }
    const Displacement& operator*() const { return value; }
  } displacement;
#define EFFECT(Name, member, ...) Name member;
#include "scene/material_extensions.def"
};
struct Primitive {
  enum class Kind : std::uint8_t { kTriangles, kBezierPatches, kProcedure };
  struct Vertices {
    std::array<Buffer<Vec2>, 2> texcoords;
    Buffer<Vec4> colors;
  } vertices;
};
struct Drawable {
  Primitive::Kind kind;
};
struct PosedDrawable {
  const Drawable* drawable = nullptr;
  const Primitive* primitive = nullptr;
  bool moving = false, deforming = false, mirrored = false;
  std::array<Mat4, 2> to_raster, to_world;
  std::array<Mat3, 2> normal_to_world;
  std::array<Buffer<Vec3>, 2> positions, normals;
  std::array<Buffer<Vec4>, 2> tangents;
  std::array<Buffer<Vec4>, 2> raster;  // of posed vertices
};

}  // namespace tessera::scene

namespace tessera::tilecore {

// By light.
struct ShadowViews {
  bool there = false;
  const shaders::ShadowView* first = nullptr;
  const shaders::ShadowView& operator[](std::size_t light) const { return first[light]; }
  bool operator==(std::nullptr_t) const { return !there; }
};

struct DrawConstants {
  const scene::PosedDrawable* drawable = nullptr;
  const scene::Material* material = nullptr;
  bool grid = false, half_attributes = false, quads = false, height_normals = false;
  std::array<Mat3, 2> height_metric{Mat3(1.0f), Mat3(1.0f)};
  bool orthographic = false, camera_moves = false;
  Mat3 camera_to_world{1.0f};
  Vec3 eye_open{0.0f}, eye_close{0.0f};
  float center_x = 0, center_y = 0, scale = 1;
  shaders::Lights lights;
  shaders::Surroundings surroundings;
  bool layered = false;
  scene::EffectFlags layers;
  shaders::LayerConstants layer_constants;
  float ior = 1.5f, reflectance = 0.04f, anisotropy_cosine = 1.0f, anisotropy_sine = 0.0f, volume_scale = 1.0f;
  shaders::RadianceView behind;
  float behind_u = 0, behind_v = 0, behind_levels = 0;
  ShadowViews shadows;
  static constexpr int shadow_times = 1;
  bool shadow_keys = false;
};

// No texture unit gets lookups.
struct LineSide {
  int texels;
  std::int32_t multiplier;
  int shift;
};
struct TextureLayoutView {
  const std::int32_t *first_line, *lines_across;
  LineSide width, height;
};
enum class ImageLookup : std::uint8_t { kMirrored, kCoat, kBehind, kBehindGreen, kBehindBlue };
inline constexpr std::size_t kTextureSlots = scene::kMaterialTextureCount, kLookupSlots = kTextureSlots + 5,
                             kLookupLines = 8, kShadowLines = 4;
constexpr std::size_t slot_of(ImageLookup lookup) { return kTextureSlots + static_cast<std::size_t>(lookup); }
struct ShadowLookups {
  const TextureLayoutView* layout = nullptr;
  std::array<std::int32_t*, kShadowLines> line{};
};
struct LookupArrays {
  std::array<const TextureLayoutView*, kLookupSlots> layout{};
  std::array<std::array<std::int32_t*, kLookupLines>, kLookupSlots> line{};
  std::span<const ShadowLookups> shadows{};
};

}  // namespace tessera::tilecore

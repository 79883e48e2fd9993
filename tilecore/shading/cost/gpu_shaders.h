#pragma once

// Pixel shaders, alpha tests and domain shaders of one set of features each, from the text that the machine runs.
// make_costs.py instantiates them, gives them the calling convention of pixel shaders (`Uniforms` in scalar registers,
// the other arguments in vector registers) and counts.

#include "tilecore/shading/cost/gpu_stages.h"
#include "tilecore/shading/gbuffer_packing.h"

namespace tessera::gpu_cost {

using tilecore::DrawConstants;
using tilecore::ImageLookup;
using tilecore::kLookupLines;
using tilecore::kShadowLines;
using tilecore::LineSide;
using tilecore::LookupArrays;
using tilecore::slot_of;
using tilecore::TextureLayoutView;

#define TESSERA_COUNTED_SHADER
#include "tilecore/shading/lane_shader.inc"

// Vertices are posed in advance: their places in the image are fetched like any other attribute.
template <bool kSame>
void set_triangle_raster(const DrawConstants& draw, const LaneInputs<Lane<kSame>>& in, LaneSurface<Lane<kSame>>& s) {
  using Real = Lane<kSame>;
  Point4<Real> corner[3];
  Vector3<Real> at_key[2][3];
  for (int k = 0; k < 3; ++k)
    for (std::size_t key = 0; key < (draw.drawable->moving ? 2u : 1u); ++key) {
      const float* numbers = &draw.drawable->raster[key].data()->x;
      const IntLane<kSame> at = in.vertex[k] * IntLane<kSame>(4);
      const Point4<Real> there{gather(numbers, at), gather(numbers + 1, at), gather(numbers + 2, at),
                               gather(numbers + 3, at)};
      corner[k] = key == 0 ? there : at_time(corner[k], there, in.t);
      at_key[key][k] = place_of(there);
    }
  const Point4<Real>&a = corner[0], &b = corner[1], &c = corner[2];
  const Real* w = s.weight;
  if (draw.shadow_keys && draw.drawable->moving)
    for (std::size_t key = 0; key < 2; ++key) {
      const Vector3<Real>* const at = at_key[key];
      s.key[key] = {at[0] * w[0] + at[1] * w[1] + at[2] * w[2], at[1] - at[0], at[2] - at[0]};
    }
  s.raster = {a.x * w[0] + b.x * w[1] + c.x * w[2], a.y * w[0] + b.y * w[1] + c.y * w[2],
              a.z * w[0] + b.z * w[1] + c.z * w[2], a.w * w[0] + b.w * w[1] + c.w * w[2]};
  s.raster_p = {b.x - a.x, b.y - a.y, b.z - a.z, b.w - a.w};
  s.raster_q = {c.x - a.x, c.y - a.y, c.z - a.z, c.w - a.w};
}

// ---- Inputs of a draw -----------------------------------------------------------------------------------------------

struct TextureUniforms {
  float transform[6];
  ImageConstants image;
};
struct Uniforms {
  const TESSERA_GLOBAL Vec3 *positions[2], *normals[2];
  const TESSERA_GLOBAL Vec4 *tangents[2], *raster[2], *colors;
  const TESSERA_GLOBAL Vec2* texcoords[2];
  float to_raster[2][16], to_world[2][16], normal_to_world[2][9], camera[9], eye[3], center_x, center_y, scale;
  float base_color[4], alpha_cutoff, metallic, roughness, emissive[3], normal_scale, occlusion_strength, environment;
  float displacement_scale, displacement_bias;
  struct LayerUniforms {
    float specular[3], glossiness, reflectance, coat, coat_roughness, coat_normal_scale, sheen[3], sheen_roughness;
    float anisotropy, anisotropy_cosine, anisotropy_sine, film, film_ior, film_min, film_max;
    float transmission, ior, thickness, volume_scale, absorption[3], dispersion, spread, spread_color[3];
  } layers;
  struct BehindUniforms {
    float scale_u, scale_v, levels;
    ImageConstants image;
  } behind;
  TextureUniforms textures[8];
  struct LightUniforms {
    float color[3], position[3], direction[3], range, cos_inner, cos_outer;
  } lights[2][2];  // at both keys
  struct AroundUniforms {
    float diffuse[9][3];
    ImageConstants image;
  } around;
  // The numbers of every effect; `layers` holds the numbers that were measured as neighbours, which one load fetches.
  struct EffectUniforms {
#define EFFECT(Name, ...) struct {
#define NUMBER(member, ...) float member;
#define COLOR(member, ...) float member[3];
#define END_EFFECT(member) \
  }                        \
  member;
#include "scene/material_extensions.def"
  } effects;
  // The camera's rays: their directions in the world are constant, times t, times t^2 (view_rays.h).
  struct RayUniforms {
    float to_world[3][9], inverse_focus;
  } rays;
  float height_metric[2][9];
  ShadowUniforms shadows[2];
  const TESSERA_GLOBAL float* gbuffer;  // a sample behind the other, and its depth
};

enum class Surface { kTriangles, kPatch, kDisplacedPatch, kComputed };
enum class Motion { kStill, kMoving, kDeforming };
enum class Normals { kOfSurface, kMapped, kMappedAlongTangents };
using shaders::ShadowFilter;
enum class LightKind { kDirectional, kPoint, kPointInRange, kSpot, kSpotInRange };

// A shader's features. The same names as in hardware/shader_costs.h, which a compiler for the device cannot read.
struct Shader {
  Surface surface = Surface::kTriangles;
  Motion motion = Motion::kStill;
  bool quads = false, unlit = false, colors = false, base_color = false, metallic_roughness = false, occlusion = false,
       emissive = false;
  Normals normals = Normals::kOfSurface;
  int lights = 0;
  LightKind light = LightKind::kDirectional;
  bool light_moves = false;
  bool apart = false;  // emission has its own texture coordinate
  // Layers: whether the material has some; whether the coat has a texture, and a normal map; the effects.
  bool layered = false, layer_texture = false, coat_normals = false;
#define EFFECT(Name, member, ...) bool member = false;
#include "scene/material_extensions.def"
  bool environment_image = false;
  bool height_normals = false;  // of triangles: turned by the gradient of heights; of outputs: without displacement
  // The first lights cast shadows into maps of so many layers; lookups use the receiver's place at both keys.
  int shadows = 0, shadow_layers = 1;
  ShadowFilter shadow_filter = ShadowFilter::k2x2;
  bool packed = false;  // the G-buffer
};

template <class Matrix>
Matrix matrix(const TESSERA_CONSTANT float* numbers) {
  Matrix m(1.0f);
  for (int c = 0; c < Matrix::length(); ++c)
    for (int r = 0; r < Matrix::length(); ++r) m[c][r] = numbers[c * Matrix::length() + r];
  return m;
}
inline Vec3 vector(const TESSERA_CONSTANT float* numbers) { return {numbers[0], numbers[1], numbers[2]}; }

template <class Slot>
void set_slot(Slot& slot, const TESSERA_CONSTANT ImageConstants& image, const TESSERA_CONSTANT float* transform,
              int set, bool quads) {
  slot.texture.there = true;
  slot.texture.seen = {(const std::int32_t*)image.width, (const std::int32_t*)image.height, &image, quads};  // NOLINT
  slot.texcoord = set;
  slot.transform.matrix = glm::mat2(transform[0], transform[1], transform[2], transform[3]);
  slot.transform.offset = Vec2(transform[4], transform[5]);
}

inline shaders::Light light_of(const TESSERA_CONSTANT Uniforms::LightUniforms& u, LightKind kind) {
  using Type = shaders::Light::Type;
  shaders::Light light;
  light.type = kind == LightKind::kDirectional                                 ? Type::kDirectional
               : kind == LightKind::kPoint || kind == LightKind::kPointInRange ? Type::kPoint
                                                                               : Type::kSpot;
  light.color = vector(u.color), light.position = vector(u.position), light.direction = vector(u.direction);
  // A compiled shader knows whether a light has a range, but not how long it is.
  const bool limited = kind == LightKind::kPointInRange || kind == LightKind::kSpotInRange;
  light.range = limited ? __builtin_fmaxf(u.range, 1e-6f) : 0.0f;
  light.cos_inner = u.cos_inner, light.cos_outer = u.cos_outer;
  return light;
}

// Sets the posed drawable of a draw's constants. It is a separate object: a compiler keeps an object that points into
// itself in memory.
template <Shader S>
void set_posed(const TESSERA_CONSTANT Uniforms& u, scene::PosedDrawable& posed) {
  const auto set = [](auto& buffer, auto* first, bool there) { buffer.first = first, buffer.there = there; };
  posed.moving = S.motion != Motion::kStill, posed.deforming = S.motion == Motion::kDeforming;
  for (std::size_t key = 0; key < 2; ++key) {
    set(posed.positions[key], u.positions[key], true), set(posed.normals[key], u.normals[key], true);
    set(posed.raster[key], u.raster[key], true),
        set(posed.tangents[key], u.tangents[key], S.normals == Normals::kMappedAlongTangents);
    if (S.surface == Surface::kTriangles) {
      posed.to_world[key] = Mat4(1.0f), posed.normal_to_world[key] = Mat3(1.0f);  // vertices come posed
      continue;
    }
    posed.to_raster[key] = matrix<Mat4>(u.to_raster[key]), posed.to_world[key] = matrix<Mat4>(u.to_world[key]);
    posed.normal_to_world[key] = matrix<Mat3>(u.normal_to_world[key]);
  }
}

inline void set_layers(const TESSERA_CONSTANT Uniforms& u, scene::Material& material) {
#define EFFECT(Name, effect, ...) \
  {                               \
    auto& to = material.effect;   \
    const auto TESSERA_CONSTANT& from = u.effects.effect;
#define NUMBER(member, ...) to.member = from.member;
#define COLOR(member, ...) to.member = vector(from.member);
#define END_EFFECT(...) }
#include "scene/material_extensions.def"
  const Uniforms::LayerUniforms TESSERA_CONSTANT& l = u.layers;
  material.specular_glossiness.specular = material.dielectric.specular_color = vector(l.specular);
  material.specular_glossiness.glossiness = material.dielectric.specular = l.glossiness;
  material.clearcoat.factor = l.coat, material.clearcoat.roughness = l.coat_roughness;
  material.clearcoat.normal_scale = l.coat_normal_scale;
  material.sheen.color = vector(l.sheen), material.sheen.roughness = l.sheen_roughness;
  material.anisotropy.strength = l.anisotropy;
  material.iridescence.factor = l.film, material.iridescence.ior = l.film_ior;
  material.iridescence.min_thickness = l.film_min, material.iridescence.max_thickness = l.film_max;
  material.transmission.factor = l.transmission, material.volume.thickness = l.thickness;
  material.diffuse_transmission.factor = l.spread, material.diffuse_transmission.color = vector(l.spread_color);
}

template <Shader S>
void set_material(const TESSERA_CONSTANT Uniforms& u, scene::Material& material) {
  material.base_color = {u.base_color[0], u.base_color[1], u.base_color[2], u.base_color[3]};
  material.metallic = u.metallic, material.roughness = u.roughness;
  material.emissive = vector(u.emissive);
  material.normal_scale = u.normal_scale, material.occlusion_strength = u.occlusion_strength;
  material.unlit = S.unlit, material.glows_unlit = S.unlit && S.emissive;
  const auto slot = [&](scene::TextureSlot& to, std::size_t image, bool there, bool apart) {
    if (!there) return;
    set_slot(to, u.textures[image].image, u.textures[apart ? 1 : 0].transform, apart ? 1 : 0, S.quads);
  };
  slot(material.base_color_texture, 0, S.base_color, false);
  slot(material.normal_texture, 1, S.normals != Normals::kOfSurface, false);
  slot(material.metallic_roughness_texture, 2, S.metallic_roughness, false);
  slot(material.occlusion_texture, 3, S.occlusion, false);
  slot(material.emissive_texture, 4, S.emissive, S.apart);
  if (S.layered) set_layers(u, material);
  slot(material.clearcoat.texture, 6, S.layer_texture, false);
  slot(material.clearcoat.normal_texture, 7, S.coat_normals, false);
  if (S.surface != Surface::kDisplacedPatch && !S.height_normals) return;
  scene::Displacement& displacement = material.displacement.value;
  // Pixels look heights up at the coordinate of the first texture.
  set_slot(displacement, u.textures[5].image, u.textures[S.surface == Surface::kTriangles ? 0 : 5].transform, 0, false);
  displacement.scale = u.displacement_scale, displacement.bias = u.displacement_bias;
  material.displacement.there = true;
}

template <Shader S>
void set_constants(const TESSERA_CONSTANT Uniforms& u, DrawConstants& draw) {
  draw.grid = S.surface == Surface::kPatch || S.surface == Surface::kDisplacedPatch, draw.quads = S.quads;
  draw.height_normals = S.height_normals && !draw.grid;
  for (std::size_t key = 0; key < 2; ++key) draw.height_metric[key] = matrix<Mat3>(u.height_metric[key]);
  draw.camera_to_world = matrix<Mat3>(u.camera);
  draw.center_x = u.center_x, draw.center_y = u.center_y, draw.scale = u.scale;
  draw.surroundings.intensity = u.environment;
  if (S.environment_image) draw.surroundings.kind = shaders::Surroundings::Kind::kImage;
  draw.layered = S.layered;
#define EFFECT(Name, member, ...) draw.layers.member = S.member;
#include "scene/material_extensions.def"
  const Uniforms::LayerUniforms TESSERA_CONSTANT& l = u.layers;
  draw.ior = l.ior, draw.reflectance = l.reflectance;
  draw.anisotropy_cosine = l.anisotropy_cosine, draw.anisotropy_sine = l.anisotropy_sine;
  draw.volume_scale = l.volume_scale;
  draw.layer_constants.absorption = vector(l.absorption), draw.layer_constants.dispersion = l.dispersion;
  if (S.transmission) draw.behind.levels = 1, draw.behind.image = &u.behind.image;
  draw.behind_u = u.behind.scale_u, draw.behind_v = u.behind.scale_v, draw.behind_levels = u.behind.levels;
}

template <Shader S>
void set_shadows(const TESSERA_CONSTANT Uniforms& u, std::size_t light, shaders::ShadowLayer* layers,
                 shaders::ShadowView& view) {
  const ShadowUniforms TESSERA_CONSTANT& from = u.shadows[light];
  constexpr auto kLayers = static_cast<std::size_t>(S.shadow_layers);
  static_assert(kLayers <= kMaxShadowLayers);
  for (std::size_t layer = 0; layer < kLayers; ++layer) {
    for (std::size_t key = 0; key < 2; ++key)
      layers[layer].from_raster[key] = matrix<Mat4>(from.from_raster[layer][key]);
    layers[layer].from_resting = layers[layer].from_raster[0];
    layers[layer].bias = from.bias[layer];
  }
  view.there = static_cast<int>(light) < S.shadows, view.uniforms = &from, view.layer = layers;
  view.size = from.size, view.texel = from.texel, view.layers = S.shadow_layers;
  view.perspective = S.light != LightKind::kDirectional, view.filter = S.shadow_filter;
  view.t = from.t, view.slope_bias = from.slope_bias, view.max_slope = from.max_slope;
}

// Calls `shade(draw)`.
template <Shader S, class Shade>
__attribute__((always_inline)) inline void with_draw(const TESSERA_CONSTANT Uniforms& u, const Shade& shade) {
  scene::Material material;
  set_material<S>(u, material);
  const scene::Drawable drawable{S.surface == Surface::kTriangles ? scene::Primitive::Kind::kTriangles
                                                                  : scene::Primitive::Kind::kBezierPatches};
  scene::Primitive primitive;
  for (std::size_t set = 0; set < 2; ++set) primitive.vertices.texcoords[set].first = u.texcoords[set];
  primitive.vertices.colors.first = u.colors, primitive.vertices.colors.there = S.colors;
  scene::PosedDrawable posed;
  set_posed<S>(u, posed);
  posed.drawable = &drawable, posed.primitive = &primitive;
  std::array<shaders::Light, 2> open, close;
  for (std::size_t i = 0; i < 2; ++i)
    open[i] = light_of(u.lights[0][i], S.light), close[i] = light_of(u.lights[1][i], S.light);
  shaders::EnvironmentMap around{};
  around.radiance.image = &u.around.image;
  for (std::size_t i = 0; i < 9; ++i) around.diffuse[i] = vector(u.around.diffuse[i]);
  DrawConstants draw;
  set_constants<S>(u, draw);
  draw.surroundings.image = &around;
  draw.drawable = &posed, draw.material = &material;
  constexpr auto kCount = static_cast<std::size_t>(S.lights);
  draw.lights.open = {open.data(), kCount};
  if (S.light_moves) draw.lights.close = {close.data(), kCount};
  shaders::ShadowLayer layers0[kMaxShadowLayers], layers1[kMaxShadowLayers];
  shaders::ShadowView shadows[2];
  if constexpr (S.shadows > 0) {
    set_shadows<S>(u, 0, layers0, shadows[0]), set_shadows<S>(u, 1, layers1, shadows[1]);
    draw.shadows = {true, shadows}, draw.shadow_keys = S.surface != Surface::kComputed;
  }
  shade(draw);
}

// Inputs of an invocation, in vector registers.
struct Inputs {
  std::int32_t vertex0, vertex1, vertex2, triangle;
  float p, q, t, light_t, lod, step_x, step_y;
  float normal_x, normal_y, normal_z, red, green, blue;  // of points that are computed elsewhere
};
template <class Real>
LaneInputs<Real> lane_inputs_of(const Inputs& v) {
  LaneInputs<Real> in;
  using Int = IntOf<Real>;
  in.vertex[0] = Int::of(v.vertex0), in.vertex[1] = Int::of(v.vertex1), in.vertex[2] = Int::of(v.vertex2);
  in.triangle = Int::of(v.triangle);
  in.p = v.p, in.q = v.q, in.t = v.t, in.light_t = v.light_t, in.lod = v.lod;
  in.step_x = v.step_x, in.step_y = v.step_y;
  in.one_patch = false;
  return in;
}

#define TESSERA_SHADER(name, stage, ...)                                                                              \
  extern "C" void name(const TESSERA_CONSTANT Uniforms* u, std::int32_t a, std::int32_t b, std::int32_t c,            \
                       std::int32_t triangle, float p, float q, float t, float light_t, float lod, float x, float y,  \
                       float nx, float ny, float nz, float red, float green, float blue) {                            \
    stage<Shader{__VA_ARGS__}>(*u,                                                                                    \
                               Inputs{a, b, c, triangle, p, q, t, light_t, lod, x, y, nx, ny, nz, red, green, blue}); \
  }

// ---- Shaders --------------------------------------------------------------------------------------------------------

void export_color(std::int32_t target, std::int32_t enabled, float, float, float, float, bool,
                  bool) __asm("llvm.amdgcn.exp.f32");
// Rows of the environment's table are the same in all lanes unless a texture gives the roughness.
template <Shader S>
using RealOf = Lane<!S.metallic_roughness>;

template <Shader S>
__attribute__((always_inline, flatten)) inline void pixel_shader(const TESSERA_CONSTANT Uniforms& u, const Inputs& v) {
  using Real = RealOf<S>;
  with_draw<S>(u, [&](const DrawConstants& draw) {
    LaneInputs<Real> in = lane_inputs_of<Real>(v);
    const LaneShaded<Real> out = shade_lanes(draw, in, LookupArrays(), 0);
    export_color(0, 15, out.color.x.v, out.color.y.v, out.color.z.v, out.alpha.v, true, true);
  });
}

// As shade_procedure(): a point whose place, normal and colour in object space are computed elsewhere.
template <Shader S>
__attribute__((always_inline, flatten)) inline void computed_shader(const TESSERA_CONSTANT Uniforms& u,
                                                                    const Inputs& v) {
  using Real = RealOf<S>;
  with_draw<S>(u, [&](const DrawConstants& draw) {
    const LaneInputs<Real> in = lane_inputs_of<Real>(v);
    const scene::PosedDrawable& d = *draw.drawable;
    const Vector3<Real> point{in.p, in.q, in.lod}, along{v.normal_x, v.normal_y, v.normal_z};
    LaneSurface<Real> s;
    s.position = placed(d.to_world[0], point), s.normal = turned(d.normal_to_world[0], along);
    s.raster = placed4(d.to_raster[0], point);
    if (S.motion != Motion::kStill) {
      s.position = at_time(s.position, placed(d.to_world[1], point), in.t);
      s.normal = at_time(s.normal, turned(d.normal_to_world[1], along), in.t);
      s.raster = at_time(s.raster, placed4(d.to_raster[1], point), in.t);
    }
    s.normal = unit_or(s.normal, constant_vector<Real>(Vec3(0, 0, 1)));
    const Vector3<Real> view = towards_viewer(draw, in, s);
    const Real least(1e-3f), side = select(dot(s.normal, view) < Real(0.0f), Real(-1.0f), Real(1.0f));
    Vector3<Real> normal = s.normal * side;
    const Real facing = dot(normal, view);
    const Vector3<Real> bent = normal + view * (least - facing);
    normal = select_vector(facing < least, bent * (Real(1.0f) / real_sqrt(dot(bent, bent))), normal);
    stage::MaterialPoint<Real> m;
    m.base_color = {v.red * draw.material->base_color.x, v.green * draw.material->base_color.y,
                    v.blue * draw.material->base_color.z};
    m.metallic = draw.material->metallic, m.roughness = draw.material->roughness, m.occlusion = Real(1.0f);
    m.emissive = constant_vector<Real>(draw.material->emissive);
    const LookupArrays lookups;
    const LaneSurroundings<Real> around{draw.surroundings, lookups, 0};
    if (S.shadows > 0) {
      // The surface's derivatives arrive in registers whose other contents this shader does not use.
      const auto number = [](std::int32_t bits) { return Real(__builtin_bit_cast(float, bits)); };
      s.raster_p = turned4(d.to_raster[0], Vector3<Real>{number(v.vertex0), number(v.vertex1), number(v.vertex2)});
      s.raster_q = turned4(d.to_raster[0], Vector3<Real>{number(v.triangle), Real(v.step_x), Real(v.step_y)});
    }
    const LaneShadows<Real> shadows{draw, s, lookups, 0};
    const Vector3<Real> out =
        S.unlit ? m.base_color
                : stage::shade_material(m, s.position, normal, view, draw.lights, in.light_t, around, shadows);
    export_color(0, 15, out.x.v, out.y.v, out.z.v, 1.0f, true, true);
  });
}

// Factor, texture, vertex colour, and the comparison with the cutoff.
template <Shader S>
__attribute__((always_inline, flatten)) inline void alpha_test(const TESSERA_CONSTANT Uniforms& u, const Inputs& v) {
  using Real = Lane<true>;
  with_draw<S>(u, [&](const DrawConstants& draw) {
    LaneInputs<Real> in = lane_inputs_of<Real>(v);
    LaneSurface<Real> s{};
    if (draw.grid) {
      set_grid_parameters(in), set_patch_weights(in, s);
      fill_patch(draw, in, s);
    } else {
      set_triangle_weights(in, s);
      set_triangle_raster(draw, in, s);
    }
    set_derivatives(false, s);
    Real alpha = draw.material->base_color.w * lane_vertex_color(draw, s).a;
    if (S.base_color) {
      SlotReader<Real> textures{draw, s, LookupArrays(), 0};
      alpha = alpha * textures.read(draw.material->base_color_texture, scene::MaterialTexture::kBaseColor).a;
    }
    export_color(0, 1, alpha.v < u.alpha_cutoff ? 0.0f : 1.0f, 0, 0, 0, true, true);
  });
}

// A vertex in object space at a key: of a grid, or the mesh's own.
template <Shader S>
Vector3<Lane<true>> vertex_at(const DrawConstants& draw, const LaneInputs<Lane<true>>& in, std::size_t key) {
  if (S.surface != Surface::kTriangles) return patch_point(draw, in, key).position;
  const float* numbers = &draw.drawable->positions[key].data()->x;
  const IntLane<true> at = in.vertex[0] * IntLane<true>(3);
  return {gather(numbers, at), gather(numbers + 1, at), gather(numbers + 2, at)};
}

// One vertex, in the image at each key.
template <Shader S>
__attribute__((always_inline, flatten)) inline void domain_shader(const TESSERA_CONSTANT Uniforms& u, const Inputs& v) {
  using Real = Lane<true>;
  with_draw<S>(u, [&](const DrawConstants& draw) {
    const LaneInputs<Real> in = lane_inputs_of<Real>(v);
    // A pixel shader of triangles needs none of these: its vertices are posed in advance.
    const auto placed_at = [&](const Vector3<Real>& point, std::size_t key) {
      return placed4(S.surface == Surface::kTriangles ? matrix<Mat4>(u.to_raster[key]) : draw.drawable->to_raster[key],
                     point);
    };
    const Vector3<Real> open = vertex_at<S>(draw, in, 0);
    const Point4<Real> at = placed_at(open, 0);
    export_color(12, 15, at.x.v, at.y.v, at.z.v, at.w.v, false, false);
    if (S.motion == Motion::kStill) return;
    const Vector3<Real> close = S.motion == Motion::kDeforming ? vertex_at<S>(draw, in, 1) : open;
    const Point4<Real> then = placed_at(close, 1);
    export_color(13, 15, then.x.v, then.y.v, then.z.v, then.w.v, true, false);
  });
}

// A vertex of a patch as pixels interpolate it (vertex_outputs.h): its place in the world and in the image and its
// normal, with a normal map also its tangent, at each key if it moves; coordinates and colour once.
template <Shader S>
__attribute__((always_inline, flatten)) inline void outputs_shader(const TESSERA_CONSTANT Uniforms& u,
                                                                   const Inputs& v) {
  using Real = Lane<true>;
  with_draw<S>(u, [&](const DrawConstants& draw) {
    const LaneInputs<Real> in = lane_inputs_of<Real>(v);
    const scene::PosedDrawable& d = *draw.drawable;
    LaneSurface<Real> s{};
    set_patch_weights(in, s);
    std::int32_t target = 32;
    const auto put = [&](Real x, Real y, Real z, Real w) {
      export_color(target++, 15, x.v, y.v, z.v, w.v, false, false);
    };
    LaneTexcoord<Real> at{}, apart{};
    const shaders::TextureTransform same;
    if (S.base_color) at = lane_texcoord(draw, s, 0, same);
    if (S.apart) apart = lane_texcoord(draw, s, 1, same);
    const PatchPoint<Real> open = patch_point<Real, S.height_normals>(draw, in, 0),
                           close =
                               S.motion == Motion::kDeforming ? patch_point<Real, S.height_normals>(draw, in, 1) : open;
    for (std::size_t key = 0; key < (S.motion == Motion::kStill ? 1u : 2u); ++key) {
      const PatchPoint<Real>& p = key == 0 ? open : close;
      const Vector3<Real> place = placed(d.to_world[key], p.position),
                          normal = turned(d.normal_to_world[key], p.normal);
      const Point4<Real> raster = placed4(d.to_raster[key], p.position);
      put(place.x, place.y, place.z, normal.x), put(raster.x, raster.y, raster.z, raster.w);
      Vector3<Real> tangent{Real(0.0f), Real(0.0f), Real(0.0f)};
      Real side(0.0f);
      if (S.normals == Normals::kMapped) {
        s.position_p = p.derivative_u, s.position_q = p.derivative_v, s.normal = p.normal;
        const TangentFrame<Real> frame = derived_tangents(s, at);
        tangent = turned(d.to_world[key], frame.tangent);
        side = dot(cross(p.normal, frame.tangent), frame.bitangent);
        put(tangent.x, tangent.y, tangent.z, side);
      }
      put(normal.y, normal.z, key == 0 ? at.u : Real(0.0f), key == 0 ? at.v : Real(0.0f));
    }
    if (S.apart) put(apart.u, apart.v, Real(0.0f), Real(0.0f));
    if (!S.colors) return;
    const stage::ColorOf<Real> color = lane_vertex_color(draw, s);
    put(color.r, color.g, color.b, color.a);
  });
}

// The environment along a ray of the camera, as in view_rays_kernel.cpp: through a point of the image (p, q) and one of
// the lens (step_x, step_y). Its moving variant has a camera that turns.
template <Shader S>
__attribute__((always_inline, flatten)) inline void background_shader(const TESSERA_CONSTANT Uniforms& u,
                                                                      const Inputs& v) {
  using Real = Lane<false>;
  with_draw<S>(u, [&](const DrawConstants& draw) {
    const Real inverse_scale(1.0f / u.scale), tilt_x = Real(v.step_x) * Real(u.rays.inverse_focus),
                                              tilt_y = Real(v.step_y) * Real(u.rays.inverse_focus), t(v.t);
    const Vector3<Real> in{(Real(v.p) - Real(u.center_x) - tilt_x) * inverse_scale,
                           (Real(u.center_y) + tilt_y - Real(v.q)) * inverse_scale, Real(-1.0f)};
    Vector3<Real> ray = turned(matrix<Mat3>(u.rays.to_world[0]), in);
    if (S.motion == Motion::kMoving)
      ray = ray + (turned(matrix<Mat3>(u.rays.to_world[1]), in) + turned(matrix<Mat3>(u.rays.to_world[2]), in) * t) * t;
    ray = unit_or(ray, constant_vector<Real>(Vec3(0, 0, -1)));
    stage::LookupTexels<IntOf<Real>> texels;
    Vector3<Real> color = stage::studio_background(ray.y, Real(u.environment));
    if (S.environment_image) {
      const stage::MapPoint<Real> at = stage::environment_point(ray);
      color =
          stage::sample_radiance<Real, IntOf<Real>>(draw.surroundings.image->radiance, at.u, at.v, Real(0.0f), texels) *
          Real(u.environment);
    }
    export_color(0, 15, color.x.v, color.y.v, color.z.v, 1.0f, true, true);
  });
}

// The fill half of a shader with a G-buffer, which leaves material and normal.
template <Shader S>
__attribute__((always_inline, flatten)) inline void fill_shader(const TESSERA_CONSTANT Uniforms& u, const Inputs& v) {
  using Real = Lane<false>;
  with_draw<S>(u, [&](const DrawConstants& draw) {
    LaneInputs<Real> in = lane_inputs_of<Real>(v);
    const LaneFilled<Real> f = fill_lanes(draw, in, LookupArrays(), 0);
    const std::array<float, 12> values{f.point.base_color.x.v, f.point.base_color.y.v, f.point.base_color.z.v,
                                       f.point.metallic.v,     f.point.roughness.v,    f.point.occlusion.v,
                                       f.point.emissive.x.v,   f.point.emissive.y.v,   f.point.emissive.z.v,
                                       f.normal.x.v,           f.normal.y.v,           f.normal.z.v};
    if constexpr (S.packed) {
      const tilecore::PackedGbuffer words = tilecore::pack_gbuffer(values, static_cast<std::uint32_t>(v.triangle));
      const auto number = [&](std::size_t k) { return __builtin_bit_cast(float, words[k]); };
      export_color(0, 15, number(0), number(1), number(2), number(3), true, true);
    } else {
      export_color(0, 15, values[0], values[1], values[2], values[3], false, false);
      export_color(1, 15, values[4], values[5], values[6], values[7], false, false);
      export_color(2, 15, values[8], values[9], values[10], values[11], true, true);
    }
  });
}

// Where a packed sample lies: along the ray through a point of the image (p, q), as deep as it says. Derivatives along the
// image's axes stay on the plane across its normal.
template <Shader S, class Real>
LaneSurface<Real> surface_of_depth(const TESSERA_CONSTANT Uniforms& u, const Inputs& v, Real depth,
                                   const Vector3<Real>& normal, Vector3<Real>& view) {
  const Real inverse_scale(1.0f / u.scale), x = (Real(v.p) - Real(u.center_x)) * inverse_scale,
                                            y = (Real(u.center_y) - Real(v.q)) * inverse_scale, t(v.t);
  const Vector3<Real> ray{x, y, Real(-1.0f)};
  Vector3<Real> way = turned(matrix<Mat3>(u.rays.to_world[0]), ray), eye = constant_vector<Real>(vector(u.eye));
  if (S.motion != Motion::kStill) {
    way = way + (turned(matrix<Mat3>(u.rays.to_world[1]), ray) + turned(matrix<Mat3>(u.rays.to_world[2]), ray) * t) * t;
    eye = eye + constant_vector<Real>(vector(u.camera)) * t;
  }
  LaneSurface<Real> s{};
  s.position = eye + way * depth;
  view = way * (Real(-1.0f) / real_sqrt(dot(way, way)));
  s.raster = {Real(v.p) * depth, Real(v.q) * depth, depth, depth};
  if (S.shadows == 0) return s;
  // The plane n . way * depth = const: how its depth changes from pixel to pixel.
  const Mat3 to_world = matrix<Mat3>(u.rays.to_world[0]);
  const Vector3<Real> right = constant_vector<Real>(to_world[0]), up = constant_vector<Real>(to_world[1]);
  const Real share = depth * inverse_scale / dot(normal, way), by_x = Real(-1.0f) * dot(normal, right) * share,
             by_y = dot(normal, up) * share;
  s.raster_p = {Real(v.p) * by_x + depth, Real(v.q) * by_x, by_x, by_x};
  s.raster_q = {Real(v.p) * by_y, Real(v.q) * by_y + depth, by_y, by_y};
  return s;
}

// The light half: its visibility record comes in registers, or a place in the image; the rest lies in the tile memory.
template <Shader S>
__attribute__((always_inline, flatten)) inline void light_shader(const TESSERA_CONSTANT Uniforms& u, const Inputs& v) {
  using Real = Lane<false>;
  constexpr int kWords = S.packed ? 5 : 12;
  with_draw<S>(u, [&](const DrawConstants& draw) {
    const auto bytes = static_cast<std::uint32_t>(v.triangle) * static_cast<std::uint32_t>(kWords * sizeof(float));
    const auto* words =
        reinterpret_cast<const TESSERA_GLOBAL float*>(reinterpret_cast<const TESSERA_GLOBAL char*>(u.gbuffer) + bytes);
    std::array<float, 12> values{};
    if constexpr (S.packed) {
      tilecore::PackedGbuffer packed{};
      for (std::size_t k = 0; k < 4; ++k) packed[k] = __builtin_bit_cast(std::uint32_t, words[k]);
      values = tilecore::unpack_gbuffer(packed);
    } else {
      for (std::size_t k = 0; k < 12; ++k) values[k] = words[k];
    }
    stage::MaterialPoint<Real> m;
    m.base_color = {values[0], values[1], values[2]};
    m.metallic = values[3], m.roughness = values[4], m.occlusion = values[5];
    m.emissive = {values[6], values[7], values[8]};
    const Vector3<Real> normal{values[9], values[10], values[11]};
    LaneInputs<Real> in = lane_inputs_of<Real>(v);
    LaneSurface<Real> s;
    Vector3<Real> view;
    if constexpr (S.packed) {
      s = surface_of_depth<S, Real>(u, v, Real(words[4]), normal, view);
    } else {
      s = lane_surface(draw, in);
      view = towards_viewer(draw, in, s);
    }
    const Vector3<Real> out = light_lanes(draw, s, m, normal, view, in.light_t, LookupArrays(), 0);
    export_color(0, 15, out.x.v, out.y.v, out.z.v, 1.0f, true, true);
  });
}

}  // namespace tessera::gpu_cost

#pragma once

// The programmable stages over a GPU's lanes. They use the hardware's own exponential, logarithm and texture lookups in
// place of the exact ones. Only make_costs.py compiles it.

#include "shaders_cpp/bicubic.h"
#include "shaders_cpp/studio.cpp"
#include "tilecore/shading/cost/gpu_draw.h"
#include "tilecore/shading/cost/gpu_lane.h"

namespace tessera::shaders {

// A compiler folds expressions that are the same for every frame.
constexpr float reciprocal_length(Vec3 a) {
  const double square = double{a.x} * a.x + double{a.y} * a.y + double{a.z} * a.z;
  double root = 1;
  for (int step = 0; step < 40; ++step) root = (root + square / root) / 2;
  return static_cast<float>(1 / root);
}
constexpr Vec3 unit_axis(std::size_t box) {
  const Vec3 a = kSoftBoxes[box].axis;
  const float r = reciprocal_length(a);
  return {a.x * r, a.y * r, a.z * r};
}
inline constexpr std::array<Vec3, 3> kAxes = {unit_axis(0), unit_axis(1), unit_axis(2)};
inline const std::array<Vec3, 3>& soft_box_axes() { return kAxes; }

}  // namespace tessera::shaders

namespace tessera::gpu_cost {

using gpu_lane::IntLane;
using gpu_lane::Lane;
using gpu_lane::LaneMask;
using Vec4f = float __attribute__((ext_vector_type(4)));

// Image instructions, by the names that the compiler knows them by.
Vec4f sample_quads(std::int32_t mask, float u, float v, ImageResource, ImageSampler, bool, std::int32_t,
                   std::int32_t) __asm("llvm.amdgcn.image.sample.2d.v4f32.f32");
Vec4f sample_level(std::int32_t mask, float u, float v, float lod, ImageResource, ImageSampler, bool, std::int32_t,
                   std::int32_t) __asm("llvm.amdgcn.image.sample.l.2d.v4f32.f32");
Vec4f gather4_level(std::int32_t mask, float u, float v, float lod, ImageResource, ImageSampler, bool, std::int32_t,
                    std::int32_t) __asm("llvm.amdgcn.image.gather4.l.2d.v4f32.f32");
float load_layer(std::int32_t mask, std::int32_t column, std::int32_t row, std::int32_t layer, ImageResource,
                 std::int32_t, std::int32_t) __asm("llvm.amdgcn.image.load.2darray.f32.i32");
Vec4f gather4_layer(std::int32_t mask, float u, float v, float layer, ImageResource, ImageSampler, bool, std::int32_t,
                    std::int32_t) __asm("llvm.amdgcn.image.gather4.lz.2darray.v4f32.f32");
float hardware_exp2(float) __asm("llvm.exp2.f32");
float hardware_log2(float) __asm("llvm.log2.f32");
float hardware_cos(float) __asm("llvm.cos.f32");

namespace stage {

using shaders::ControlPoints;
using shaders::EnvironmentLobes;
using shaders::EnvironmentMap;
using shaders::HeightView;
using shaders::kCeiling;
using shaders::kDiffuseRow;
using shaders::kFirstMapRoughness;
using shaders::kFloor;
using shaders::kHorizonWidths;
using shaders::kLobeFloats;
using shaders::kMapInside;
using shaders::kMapLevels;
using shaders::kMinRoughness;
using shaders::kMinSheenRoughness;
using shaders::kPi;
using shaders::kSoftBoxes;
using shaders::LayerConstants;
using shaders::Light;
using shaders::Lights;
using shaders::lobe_numbers;
using shaders::RadianceView;
using shaders::Sampler;
using shaders::ShadowFilter;
using shaders::ShadowLayer;
using shaders::ShadowView;
using shaders::soft_box_axes;
using shaders::SoftBox;
using shaders::Surroundings;
using shaders::TextureView;

template <class Real>
Real real_exp(Real x) {
  return hardware_exp2(x.v * 1.44269504f);
}
template <class Real>
Real real_log2(Real x) {
  return hardware_log2(x.v);
}
template <class Real>
Real real_cos(Real x) {
  return hardware_cos(x.v);
}
template <class Real>
Real clamp_unit(Real x) {
  return real_min(real_max(x, Real(0.0f)), Real(1.0f));
}

template <class Int>
struct LevelTexels {
  Int level = -1, column0, column1, row0, row1;
};
template <class Int>
struct LookupTexels {
  LevelTexels<Int> fine, coarse;
};
// One image instruction, filters included.
template <class Real, class Int>
Vector3<Real> sample_radiance(const RadianceView& image, Real u, Real v, Real lod, LookupTexels<Int>&) {
  const Vec4f c = sample_level(7, u.v, v.v, lod.v, image.image->resource, image.image->sampler, false, 0, 0);
  return {c.x, c.y, c.z};
}

// clang-format off
#include "shaders_cpp/studio_light.inc"
#include "shaders_cpp/surroundings.inc"
#include "shaders_cpp/environment_map.inc"
#include "shaders_cpp/metallic_roughness.inc"
#include "shaders_cpp/layered_material.inc"
// clang-format on

using shaders::bicubic_normal;
using shaders::bicubic_point;
using shaders::bicubic_row;
using shaders::bicubic_second_derivatives;
using shaders::SecondDerivatives;
using shaders::SurfacePoint;

template <class Real>
struct ColorOf {
  Real r, g, b, a;
};
template <class Int>
Int number_of(const std::int32_t* table, Int at) {
  return table[first_lane(at)];
}

// One image instruction, filters and wrap modes included; it computes its own derivatives in quads.
template <class Real, class Int>
ColorOf<Real> sample_texture(const TextureView& texture, const Sampler&, Real u, Real v, Real lod, LookupTexels<Int>&) {
  const ImageResource resource = texture.image->resource;
  const ImageSampler sampler = texture.image->sampler;
  const Vec4f c = texture.quads ? sample_quads(15, u.v, v.v, resource, sampler, false, 0, 0)
                                : sample_level(15, u.v, v.v, lod.v, resource, sampler, false, 0, 0);
  return {c.x, c.y, c.z, c.w};
}

template <class Real>
struct HeightGradient {
  Real height, d_s, d_t;
};
template <class Real>
Real between(Real a, Real b, Real share) {
  return a + (b - a) * share;
}

// As in texture_sampling.inc: 4 x 4 texels in four instructions that gather 2 x 2 each, weighted by the shader. A
// gather returns (left below, right below, right above, left above).
template <class Real>
HeightGradient<Real> height_gradient_in_level(const TextureView& texture, Real u, Real v, Real width, Real height,
                                              Real level) {
  const ImageResource resource = texture.image->resource;
  const ImageSampler sampler = texture.image->sampler;
  const Real x = u * width - Real(0.5f), y = v * height - Real(0.5f);
  const Real ws = x - real_floor(x), wt = y - real_floor(y), half(0.5f);
  const Real texel_u = Real(1.0f) / width, texel_v = Real(1.0f) / height;
  const auto quad = [&](Real s, Real t) { return gather4_level(1, s.v, t.v, level.v, resource, sampler, false, 0, 0); };
  const Vec4f a = quad(u - texel_u, v - texel_v), b = quad(u + texel_u, v - texel_v),
              c = quad(u - texel_u, v + texel_v), d = quad(u + texel_u, v + texel_v);
  const Real h11 = a.y, h01 = a.x, h10 = a.z, h21 = b.x, h31 = b.y, h20 = b.w, h12 = c.z, h02 = c.w, h13 = c.y,
             h22 = d.w, h32 = d.z, h23 = d.x;
  return {between(between(h11, h21, ws), between(h12, h22, ws), wt),
          between(between(h21 - h01, h31 - h11, ws), between(h22 - h02, h32 - h12, ws), wt) * (half * width),
          between(between(h12 - h10, h22 - h20, ws), between(h13 - h11, h23 - h21, ws), wt) * (half * height)};
}

// Two levels; a patch has one level of detail, and a warp's first lane gives the sizes of its levels.
template <class Real>
HeightGradient<Real> height_gradient(const TextureView& texture, const Sampler&, Real u, Real v, Real lod) {
  const Real at = real_max(real_min(lod, Real(static_cast<float>(texture.image->levels - 1))), Real(0.0f)),
             below = real_floor(at), weight = at - below;
  const auto level = IntLane<true>::of(static_cast<std::int32_t>(below.v));
  const auto in_level = [&](IntLane<true> number, Real of_lane) {
    return height_gradient_in_level<Real>(texture, u, v, texture.width[first_lane(number)],
                                          texture.height[first_lane(number)], of_lane);
  };
  const HeightGradient<Real> fine = in_level(level, below),
                             coarse = in_level(level + IntLane<true>(1), below + Real(1.0f));
  return {between(fine.height, coarse.height, weight), between(fine.d_s, coarse.d_s, weight),
          between(fine.d_t, coarse.d_t, weight)};
}

// One level, which each lane chooses by itself.
template <class Real>
HeightGradient<Real> height_gradient_in_nearest_level(const TextureView& texture, const Sampler&, Real u, Real v,
                                                      Real lod) {
  const Real at = real_max(real_min(lod, Real(static_cast<float>(texture.image->levels - 1))), Real(0.0f)),
             level = real_floor(at + Real(0.5f)), share = Real(__builtin_exp2f(-level.v));
  return height_gradient_in_level<Real>(texture, u, v, Real(texture.width[0]) * share, Real(texture.height[0]) * share,
                                        level);
}

// As in shadow_texels.inc. If a light has more than one layer, the numbers of a lane's layer are loaded.
constexpr int kResting = 2, kBias = 3;
template <class Int, class Real>
Real layer_number(const ShadowView& map, Real layer, int which, int column, int row) {
  const std::size_t key = which == kResting ? 0 : static_cast<std::size_t>(which);
  if (map.layers > 1 && which == kBias) return Real(map.uniforms->bias[to_int(layer).sum()]);
  if (map.layers > 1) return Real(map.uniforms->from_raster[to_int(layer).sum()][key][4 * column + row]);
  return Real(which == kBias ? map.layer[0].bias : map.layer[0].from_raster[key][column][row]);
}

// As in shadow_texels.inc: one image instruction for a texel, and one for a square of four; outside of the map the
// sampler's edge applies.
template <class Int, class Real>
Real texel_depth(const ShadowView& map, Real layer, Real column, Real row) {
  return load_layer(1, to_int(column).sum(), to_int(row).sum(), to_int(layer).sum(), map.uniforms->image.resource, 0,
                    0);
}
template <class Real>
struct DepthSquare {
  Real at[2][2];
};
template <class Int, class Real>
DepthSquare<Real> square_depths(const ShadowView& map, Real layer, Real column, Real row) {
  const Real texel(map.texel), u = (column + Real(1.0f)) * texel, v = (row + Real(1.0f)) * texel;
  const Vec4f d =
      gather4_layer(1, u.v, v.v, layer.v, map.uniforms->image.resource, map.uniforms->image.sampler, false, 0, 0);
  return {{{Real(d.w), Real(d.z)}, {Real(d.x), Real(d.y)}}};
}
// No texture unit gets these texels.
template <class Int>
Int within_map(const ShadowView&, Int at) {
  return at;
}

#define TESSERA_UNROLLED _Pragma("unroll")
#include "shaders_cpp/shadow_map.inc"

}  // namespace stage
}  // namespace tessera::gpu_cost

#include <algorithm>

#include "tilecore/tessellation/tessellator_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tilecore/tessellation/tessellator_kernel.cpp"
#include <hwy/foreach_target.h>

#include "base/simd-inl.h"
#include "scene/subpixel.h"
#include "shaders_cpp/shading-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::tilecore::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using Lanes = tessera::HWY_NAMESPACE::FloatLanes;
using tessera::HWY_NAMESPACE::IntLanes;
using tessera::HWY_NAMESPACE::Vector3;
using D = Lanes::D;

namespace shader = shaders::HWY_NAMESPACE;

// Runs body(first, lanes) over [0, count) in steps of the vector width. The last step may reach past `count`: arrays
// are padded by kVertexPadding.
template <class Body>
HWY_INLINE void each_vector(std::size_t count, const Body& body) {
  for (std::size_t i = 0; i < count; i += Lanes::count()) body(i);
}

HWY_INLINE Vector3<Lanes> load(const PointArrays& a, std::size_t i) {
  return {Lanes::load(a.x + i), Lanes::load(a.y + i), Lanes::load(a.z + i)};
}
HWY_INLINE void store(const Vector3<Lanes>& v, const PointArrays& a, std::size_t i) {
  v.x.store(a.x + i);
  v.y.store(a.y + i);
  v.z.store(a.z + i);
}

void EvaluateRow(const shaders::BicubicRow<float>& plain, const float* u, std::size_t count, PointArrays position,
                 PointArrays normal, float* normal_margin) {
  shader::BicubicRow<float> row;
  for (std::size_t i = 0; i < 4; ++i) {
    row.point[i] = {plain.point[i].x, plain.point[i].y, plain.point[i].z};
    row.derivative_v[i] = {plain.derivative_v[i].x, plain.derivative_v[i].y, plain.derivative_v[i].z};
  }
  each_vector(count, [&](std::size_t i) HWY_ATTR {
    const shader::SurfacePoint<Lanes> p = shader::bicubic_point(row, Lanes::load(u + i));
    store(p.position, position, i);
    if (normal_margin == nullptr) return;
    const shader::RegularNormal<Lanes> n = shader::regular_normal(p.derivative_u, p.derivative_v);
    store(n.normal, normal, i);
    n.margin.store(normal_margin + i);
  });
}

void Displace(std::size_t count, const float* offset, PointArrays normal, PointArrays position) {
  each_vector(count, [&](std::size_t i) HWY_ATTR {
    store(load(position, i) + load(normal, i) * Lanes::load(offset + i), position, i);
  });
}

// ScalarTexture::sample_level().
HWY_INLINE Lanes height_in_level(const shaders::HeightView& texture, const shaders::Sampler& sampler, Lanes u, Lanes v,
                                 std::size_t level) {
  const std::int32_t width = texture.width[level];
  const float* values = texture.values + texture.first[level];
  const auto s = shader::linear_texels<Lanes, IntLanes>(sampler.wrap_s, u, IntLanes(width)),
             t = shader::linear_texels<Lanes, IntLanes>(sampler.wrap_t, v, IntLanes(texture.height[level]));
  const IntLanes above = t.first * IntLanes(width), below = t.second * IntLanes(width);
  const Lanes one(1.0f), rest = one - s.weight,
                         top = gather(values, above + s.first) * rest + gather(values, above + s.second) * s.weight,
                         bottom = gather(values, below + s.first) * rest + gather(values, below + s.second) * s.weight;
  return top * (one - t.weight) + bottom * t.weight;
}

void SampleHeights(const shaders::HeightView& texture, const shaders::Sampler& sampler, float lod, const float* u,
                   const float* v, std::size_t count, float* heights) {
  const float at = lod > 0.0f ? std::min(lod, static_cast<float>(texture.levels - 1)) : 0.0f;
  const auto level = static_cast<std::size_t>(at);
  const float share = at - static_cast<float>(level);
  each_vector(count, [&](std::size_t i) HWY_ATTR {
    const Lanes x = Lanes::load(u + i), y = Lanes::load(v + i);
    Lanes height = height_in_level(texture, sampler, x, y, level);
    if (share != 0.0f)
      height = height * Lanes(1.0f - share) + height_in_level(texture, sampler, x, y, level + 1) * Lanes(share);
    height.store(heights + i);
  });
}

// One key's homogeneous coordinates.
struct Homogeneous {
  Lanes x, y, depth, w;
};
HWY_INLINE Homogeneous transform(const Mat4& m, const Vector3<Lanes>& p) {
  const auto row = [&](int r) HWY_ATTR {
    return (Lanes(m[0][r]) * p.x + Lanes(m[1][r]) * p.y) + (Lanes(m[2][r]) * p.z + Lanes(m[3][r]));
  };
  return {row(0), row(1), row(2), row(3)};
}

bool ProjectVertices(std::size_t count, const std::array<PointArrays, 2>& object, const std::array<Mat4, 2>& to_raster,
                     bool moving, const ProjectionSettings& settings, const std::array<PointArrays, 2>& raster,
                     std::uint8_t* projected) {
  const D d;
  const auto grid = hn::Set(d, settings.subpixels), cell = hn::Set(d, 1.0f / settings.subpixels);
  const auto cell_still = hn::Set(d, scene::kStillPixels), guard = hn::Set(d, scene::kGuardBandPixels),
             near = hn::Set(d, settings.near);
  const std::size_t keys = moving ? 2 : 1;
  bool all = true;
  each_vector(count, [&](std::size_t i) HWY_ATTR {
    auto good = hn::FirstN(d, count - i);
    const auto valid = good;
    hn::Vec<D> x[2], y[2];
    Homogeneous h[2];
    for (std::size_t key = 0; key < keys; ++key) {
      h[key] = transform(to_raster[key], load(object[key], i));
      const Lanes w = settings.orthographic ? Lanes(1.0f) : h[key].w;
      x[key] = (h[key].x / w).v;
      y[key] = (h[key].y / w).v;
      good = hn::And(good, hn::Ge(h[key].depth.v, near));
      good = hn::And(good, hn::And(hn::Le(hn::Abs(x[key]), guard), hn::Le(hn::Abs(y[key]), guard)));
    }
    if (moving) {
      // Vertices whose motion is below the thresholds count as still.
      const auto within = [&](hn::Vec<D> a, hn::Vec<D> b, hn::Vec<D> most)
                              HWY_ATTR { return hn::Le(hn::Abs(hn::Sub(a, b)), most); };
      const auto still_depth = hn::Mul(h[0].depth.v, hn::Set(d, scene::kStillDepth));
      const auto still = hn::And(hn::And(good, within(h[1].depth.v, h[0].depth.v, still_depth)),
                                 hn::And(within(x[1], x[0], cell_still), within(y[1], y[0], cell_still)));
      x[1] = hn::IfThenElse(still, x[0], x[1]);
      y[1] = hn::IfThenElse(still, y[0], y[1]);
      h[1].depth = Lanes(hn::IfThenElse(still, h[0].depth.v, h[1].depth.v));
    }
    for (std::size_t key = 0; key < keys; ++key) {
      const auto snap = [&](hn::Vec<D> v) HWY_ATTR { return hn::Mul(hn::Round(hn::Mul(v, grid)), cell); };
      hn::StoreU(hn::IfThenElse(good, snap(x[key]), h[key].x.v), d, raster[key].x + i);
      hn::StoreU(hn::IfThenElse(good, snap(y[key]), h[key].y.v), d, raster[key].y + i);
      h[key].depth.store(raster[key].z + i);
    }
    const std::uint32_t bits = tessera::HWY_NAMESPACE::mask_bits(d, good);
    for (std::size_t k = 0; k < Lanes::count() && i + k < count; ++k) projected[i + k] = bits >> k & 1;
    all = all && hn::CountTrue(d, good) == hn::CountTrue(d, valid);
  });
  return all;
}

}  // namespace tessera::tilecore::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::tilecore {

HWY_EXPORT(EvaluateRow);
HWY_EXPORT(Displace);
HWY_EXPORT(SampleHeights);
HWY_EXPORT(ProjectVertices);

void evaluate_row(const shaders::BicubicRow<float>& row, const float* u, std::size_t count, PointArrays position,
                  PointArrays normal, float* normal_margin) {
  HWY_DYNAMIC_DISPATCH(EvaluateRow)(row, u, count, position, normal, normal_margin);
}
void displace(std::size_t count, const float* offset, PointArrays normal, PointArrays position) {
  HWY_DYNAMIC_DISPATCH(Displace)(count, offset, normal, position);
}
void sample_heights(const shaders::HeightView& texture, const shaders::Sampler& sampler, float lod, const float* u,
                    const float* v, std::size_t count, float* heights) {
  HWY_DYNAMIC_DISPATCH(SampleHeights)(texture, sampler, lod, u, v, count, heights);
}
bool project_vertices(std::size_t count, const std::array<PointArrays, 2>& object, const std::array<Mat4, 2>& to_raster,
                      bool moving, const ProjectionSettings& settings, const std::array<PointArrays, 2>& raster,
                      std::uint8_t* projected) {
  return HWY_DYNAMIC_DISPATCH(ProjectVertices)(count, object, to_raster, moving, settings, raster, projected);
}

}  // namespace tessera::tilecore
#endif

#include <algorithm>
#include <limits>

#include "shaders_cpp/environment_map.h"
#include "shaders_cpp/studio.h"
#include "tilecore/shading/view_rays.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tilecore/shading/view_rays_kernel.cpp"
#include <hwy/foreach_target.h>

#include "shaders_cpp/shading-inl.h"

#ifndef TESSERA_TILECORE_SHADING_VIEW_RAYS_KERNEL_CPP_
#define TESSERA_TILECORE_SHADING_VIEW_RAYS_KERNEL_CPP_
namespace tessera::tilecore {

// The members of ViewRays that the kernel reads.
struct ViewRaysKernel {
  const scene::Projection& projection;
  bool turning;
  const std::array<DMat3, 3>& to_world;

  explicit ViewRaysKernel(const ViewRays& rays)
      : projection(rays.projection_), turning(rays.turning_), to_world(rays.to_world_) {}
};

}  // namespace tessera::tilecore
#endif

HWY_BEFORE_NAMESPACE();
namespace tessera::tilecore::HWY_NAMESPACE {

#include "tilecore/shading/lane_names.inc"
using tessera::HWY_NAMESPACE::real_max;
using tessera::HWY_NAMESPACE::real_min;

#include "tilecore/shading/lane_lookups.inc"

using D = hn::ScalableTag<double>;
using F = hn::Rebind<float, D>;
using V = hn::Vec<D>;

struct Direction {
  V x, y, z;
};

HWY_INLINE Direction turned(const DMat3& m, const Direction& v) {
  const D d;
  const auto row = [&](int r) HWY_ATTR {
    return hn::Add(hn::Add(hn::Mul(hn::Set(d, m[0][r]), v.x), hn::Mul(hn::Set(d, m[1][r]), v.y)),
                   hn::Mul(hn::Set(d, m[2][r]), v.z));
  };
  return {row(0), row(1), row(2)};
}

// constant + t (linear + t quadratic)
HWY_INLINE V at_time(V constant, V linear, V quadratic, V t) {
  return hn::Add(constant, hn::Mul(t, hn::Add(linear, hn::Mul(t, quadratic))));
}

// ViewRays::direction(), without its unused parts.
struct UnitDirection {
  hn::Vec<F> x, y, z;
};

HWY_INLINE UnitDirection directions(const ViewRaysKernel& rays, const ViewRays::Points& points, std::size_t i) {
  const D d;
  const F f;
  const scene::Projection& p = rays.projection;
  const auto wide = [&](const float* values) HWY_ATTR { return hn::PromoteTo(d, hn::LoadU(f, values + i)); };
  const V scale = hn::Set(d, p.scale), inverse_focus = hn::Set(d, p.inverse_focus),
          tilt_x = hn::Mul(wide(points.lens_u), inverse_focus), tilt_y = hn::Mul(wide(points.lens_v), inverse_focus);
  Direction in;
  in.z = hn::Set(d, -1.0);
  if (p.orthographic) {
    in.x = hn::Div(hn::Neg(tilt_x), scale), in.y = hn::Div(tilt_y, scale);
  } else {
    in.x = hn::Div(hn::Sub(hn::Sub(wide(points.x), hn::Set(d, p.center_x)), tilt_x), scale);
    in.y = hn::Div(hn::Neg(hn::Sub(hn::Sub(wide(points.y), hn::Set(d, p.center_y)), tilt_y)), scale);
  }
  Direction world = turned(rays.to_world[0], in);
  if (rays.turning) {
    const Direction linear = turned(rays.to_world[1], in), quadratic = turned(rays.to_world[2], in);
    const V t = wide(points.t);
    world = {at_time(world.x, linear.x, quadratic.x, t), at_time(world.y, linear.y, quadratic.y, t),
             at_time(world.z, linear.z, quadratic.z, t)};
  }
  const V length2 = hn::Add(hn::Add(hn::Mul(world.x, world.x), hn::Mul(world.y, world.y)), hn::Mul(world.z, world.z));
  const auto known =
      hn::And(hn::Gt(length2, hn::Zero(d)), hn::Le(length2, hn::Set(d, std::numeric_limits<double>::max())));
  const V length = hn::Sqrt(length2);
  return {hn::DemoteTo(f, hn::IfThenElseZero(known, hn::Div(world.x, length))),
          hn::DemoteTo(f, hn::IfThenElseZero(known, hn::Div(world.y, length))),
          hn::DemoteTo(f, hn::IfThenElse(known, hn::Div(world.z, length), hn::Set(d, -1.0)))};
}

void StudioBackground(const ViewRaysKernel& rays, const ViewRays::Points& points, std::size_t count, float intensity,
                      Vec3* colors) {
  const F f;
  const FloatLanes::D d;
  alignas(64) float height[hn::MaxLanes(FloatLanes::D())];
  for (std::size_t i = 0; i < count; i += FloatLanes::count()) {
    for (std::size_t k = 0; k < FloatLanes::count(); k += hn::Lanes(f))
      hn::StoreU(directions(rays, points, i + k).y, f, height + k);
    const Vector3<FloatLanes> color = stage::studio_background(FloatLanes::load(height), FloatLanes(intensity));
    hn::StoreInterleaved3(color.x.v, color.y.v, color.z.v, d, &colors[i].x);
  }
}

void ImageBackground(const ViewRaysKernel& rays, const ViewRays::Points& points, std::size_t count,
                     const shaders::Surroundings& around, const LookupArrays& lookups, Vec3* colors) {
  const F f;
  const FloatLanes::D d;
  alignas(64) float x[hn::MaxLanes(FloatLanes::D())], y[hn::MaxLanes(FloatLanes::D())],
      z[hn::MaxLanes(FloatLanes::D())];
  for (std::size_t i = 0; i < count; i += FloatLanes::count()) {
    for (std::size_t k = 0; k < FloatLanes::count(); k += hn::Lanes(f)) {
      const UnitDirection direction = directions(rays, points, i + k);
      hn::StoreU(direction.x, f, x + k), hn::StoreU(direction.y, f, y + k), hn::StoreU(direction.z, f, z + k);
    }
    const stage::MapPoint<FloatLanes> at =
        stage::environment_point(Vector3<FloatLanes>{FloatLanes::load(x), FloatLanes::load(y), FloatLanes::load(z)});
    stage::LookupTexels<IntLanes> texels;
    const Vector3<FloatLanes> color =
        stage::sample_radiance<FloatLanes, IntLanes>(around.image->radiance, at.u, at.v, FloatLanes(0.0f), texels) *
        FloatLanes(around.intensity);
    store_lookup(lookups, slot_of(ImageLookup::kMirrored), texels, i);
    hn::StoreInterleaved3(color.x.v, color.y.v, color.z.v, d, &colors[i].x);
  }
}

}  // namespace tessera::tilecore::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::tilecore {

HWY_EXPORT(StudioBackground);
HWY_EXPORT(ImageBackground);

void ViewRays::background(const Points& points, std::size_t count, const shaders::Surroundings& around,
                          const LookupArrays& lookups, Vec3* colors) const {
  switch (around.kind) {
    case shaders::Surroundings::Kind::kStudio:
      HWY_DYNAMIC_DISPATCH(StudioBackground)(ViewRaysKernel(*this), points, count, around.intensity, colors);
      break;
    case shaders::Surroundings::Kind::kUniform:
      std::fill_n(colors, count, Vec3(around.intensity));
      break;
    case shaders::Surroundings::Kind::kImage:
      HWY_DYNAMIC_DISPATCH(ImageBackground)(ViewRaysKernel(*this), points, count, around, lookups, colors);
      break;
  }
}

}  // namespace tessera::tilecore
#endif

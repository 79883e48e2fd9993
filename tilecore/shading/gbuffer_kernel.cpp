#include "tilecore/shading/gbuffer.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tilecore/shading/gbuffer_kernel.cpp"
#include <hwy/foreach_target.h>

#include "shaders_cpp/shading-inl.h"

// As in layered_shader_kernel.cpp: lookups are calls.
#ifndef TESSERA_STAGE_CALL
#define TESSERA_STAGE_CALL __attribute__((noinline))
#endif

HWY_BEFORE_NAMESPACE();
namespace tessera::tilecore::HWY_NAMESPACE {

#include "tilecore/shading/shade_draw.inc"

inline void store_vector(const Vector3<FloatLanes>& v, const GbufferArrays& to, std::size_t plane, std::size_t i) {
  v.x.store(to[plane] + i), v.y.store(to[plane + 1] + i), v.z.store(to[plane + 2] + i);
}
inline Vector3<FloatLanes> load_vector(const GbufferArrays& from, std::size_t plane, std::size_t i) {
  return {FloatLanes::load(from[plane] + i), FloatLanes::load(from[plane + 1] + i),
          FloatLanes::load(from[plane + 2] + i)};
}
inline void store_receiver(const stage::Receiver<FloatLanes>& r, const GbufferArrays& to, std::size_t plane,
                           std::size_t i) {
  store_vector(r.at, to, plane, i), store_vector(r.by_p, to, plane + 3, i), store_vector(r.by_q, to, plane + 6, i);
}
inline stage::Receiver<FloatLanes> load_receiver(const GbufferArrays& from, std::size_t plane, std::size_t i) {
  return {load_vector(from, plane, i), load_vector(from, plane + 3, i), load_vector(from, plane + 6, i)};
}

void FillDraw(const DrawConstants& draw, const LaneArrays& in, std::size_t count, const LookupArrays& lookups,
              bool receivers, const GbufferArrays& out) {
  using Planes = GbufferPlanes;
  for (std::size_t i = 0; i < count; i += FloatLanes::count()) {
    LaneInputs<FloatLanes> lanes = load_lanes(draw, in, i);
    const LaneFilled<FloatLanes> filled = fill_lanes(draw, lanes, lookups, i);
    store_vector(filled.point.base_color, out, Planes::kBaseColor, i);
    filled.point.metallic.store(out[Planes::kMetallic] + i);
    filled.point.roughness.store(out[Planes::kRoughness] + i);
    filled.point.occlusion.store(out[Planes::kOcclusion] + i);
    store_vector(filled.point.emissive, out, Planes::kEmissive, i);
    store_vector(filled.normal, out, Planes::kNormal, i);
    store_vector(filled.surface.position, out, Planes::kPlace, i);
    store_vector(filled.view, out, Planes::kView, i);
    if (!receivers) continue;
    store_receiver(receiver_of(filled.surface), out, Planes::kReceiver, i);
    if (!draw.shadow_keys || !draw.drawable->moving) continue;
    for (std::size_t key = 0; key < 2; ++key) store_receiver(filled.surface.key[key], out, Planes::kKeys + 9 * key, i);
  }
}

void LightDraw(const DrawConstants& draw, const GbufferArrays& in, const float* light_t, std::size_t count,
               const LookupArrays& lookups, const std::array<float*, 3>& color) {
  using Planes = GbufferPlanes;
  for (std::size_t i = 0; i < count; i += FloatLanes::count()) {
    LaneSurface<FloatLanes> s{};
    s.position = load_vector(in, Planes::kPlace, i);
    if (draw.shadows != nullptr) {
      const stage::Receiver<FloatLanes> at = load_receiver(in, Planes::kReceiver, i);
      const FloatLanes one(1.0f);
      s.raster = {at.at.x, at.at.y, at.at.z, one};
      s.raster_p = {at.by_p.x, at.by_p.y, at.by_p.z, one};
      s.raster_q = {at.by_q.x, at.by_q.y, at.by_q.z, one};
      if (draw.shadow_keys && draw.drawable->moving)
        for (std::size_t key = 0; key < 2; ++key) s.key[key] = load_receiver(in, Planes::kKeys + 9 * key, i);
    }
    stage::MaterialPoint<FloatLanes> point;
    point.base_color = load_vector(in, Planes::kBaseColor, i);
    point.metallic = FloatLanes::load(in[Planes::kMetallic] + i);
    point.roughness = FloatLanes::load(in[Planes::kRoughness] + i);
    point.occlusion = FloatLanes::load(in[Planes::kOcclusion] + i);
    point.emissive = load_vector(in, Planes::kEmissive, i);
    const Vector3<FloatLanes> out =
        light_lanes(draw, s, point, load_vector(in, Planes::kNormal, i), load_vector(in, Planes::kView, i),
                    FloatLanes::load(light_t + i), lookups, i);
    out.x.store(color[0] + i), out.y.store(color[1] + i), out.z.store(color[2] + i);
  }
}

}  // namespace tessera::tilecore::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::tilecore {

HWY_EXPORT(FillDraw);
HWY_EXPORT(LightDraw);

void fill_draw(const DrawConstants& draw, const LaneArrays& in, std::size_t count, const LookupArrays& lookups,
               bool receivers, const GbufferArrays& out) {
  HWY_DYNAMIC_DISPATCH(FillDraw)(draw, in, count, lookups, receivers, out);
}

void light_draw(const DrawConstants& draw, const GbufferArrays& in, const float* light_t, std::size_t count,
                const LookupArrays& lookups, const std::array<float*, 3>& color) {
  HWY_DYNAMIC_DISPATCH(LightDraw)(draw, in, light_t, count, lookups, color);
}

}  // namespace tessera::tilecore
#endif

#include "tilecore/shading/pixel_shader_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tilecore/shading/pixel_shader_kernel.cpp"
#include <hwy/foreach_target.h>

#include "shaders_cpp/shading-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::tilecore::HWY_NAMESPACE {

namespace stage = shaders::HWY_NAMESPACE;
using tessera::HWY_NAMESPACE::FloatLanes;
using tessera::HWY_NAMESPACE::IntLanes;
using tessera::HWY_NAMESPACE::Vector3;

// clang-format off: the second needs the first
#include "tilecore/shading/lane_surface.inc"
#include "tilecore/shading/lane_shader.inc"
// clang-format on

void ShadeDraw(const DrawConstants& draw, const LaneArrays& in, std::size_t count, const LookupArrays& lookups,
               const ShadedArrays& out) {
  for (std::size_t i = 0; i < count; i += FloatLanes::count()) {
    LaneInputs<FloatLanes> lanes;
    for (std::size_t k = 0; k < 3; ++k) lanes.vertex[k] = IntLanes::load(in.vertex[k] + i);
    lanes.p = FloatLanes::load(in.p + i), lanes.q = FloatLanes::load(in.q + i);
    lanes.t = FloatLanes::load(in.t + i), lanes.light_t = FloatLanes::load(in.light_t + i);
    lanes.lod = FloatLanes::load(in.lod + i);
    lanes.step_x = FloatLanes::load(in.step_x + i), lanes.step_y = FloatLanes::load(in.step_y + i);
    const LaneShaded<FloatLanes> shaded = shade_lanes(draw, lanes, lookups, i);
    shaded.color.x.store(out.color[0] + i), shaded.color.y.store(out.color[1] + i),
        shaded.color.z.store(out.color[2] + i);
    shaded.normal.x.store(out.normal[0] + i), shaded.normal.y.store(out.normal[1] + i),
        shaded.normal.z.store(out.normal[2] + i);
    shaded.alpha.store(out.alpha + i);
  }
}

}  // namespace tessera::tilecore::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::tilecore {

HWY_EXPORT(ShadeDraw);

void shade_draw(const DrawConstants& draw, const LaneArrays& in, std::size_t count, const LookupArrays& lookups,
                const ShadedArrays& out) {
  HWY_DYNAMIC_DISPATCH(ShadeDraw)(draw, in, count, lookups, out);
}

}  // namespace tessera::tilecore
#endif

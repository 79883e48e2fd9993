#include "tilecore/shading/alpha_test_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tilecore/shading/alpha_test_kernel.cpp"
#include <hwy/foreach_target.h>

#include "shaders_cpp/shading-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::tilecore::HWY_NAMESPACE {

#include "tilecore/shading/lane_names.inc"

#include "tilecore/shading/lane_shader.inc"

#include "tilecore/shading/lane_alpha.inc"

__attribute__((flatten)) void AlphaDraw(const DrawConstants& draw, const LaneArrays& in, std::size_t count,
                                        const LookupArrays& lookups, float* alpha) {
  for (std::size_t i = 0; i < count; i += FloatLanes::count()) {
    LaneInputs<FloatLanes> lanes;
    for (std::size_t k = 0; k < 3; ++k) lanes.vertex[k] = IntLanes::load(in.vertex[k] + i);
    lanes.triangle = IntLanes::load(in.triangle + i);
    lanes.one_patch = draw.grid;
    lanes.p = FloatLanes::load(in.p + i), lanes.q = FloatLanes::load(in.q + i);
    lanes.t = FloatLanes::load(in.t + i), lanes.lod = FloatLanes::load(in.lod + i);
    lane_alpha(draw, lanes, lookups, i).store(alpha + i);
  }
}

}  // namespace tessera::tilecore::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::tilecore {

HWY_EXPORT(AlphaDraw);

void alpha_draw(const DrawConstants& draw, const LaneArrays& in, std::size_t count, const LookupArrays& lookups,
                float* alpha) {
  HWY_DYNAMIC_DISPATCH(AlphaDraw)(draw, in, count, lookups, alpha);
}

}  // namespace tessera::tilecore
#endif

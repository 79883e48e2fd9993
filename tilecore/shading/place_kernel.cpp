#include "tilecore/shading/place_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tilecore/shading/place_kernel.cpp"
#include <hwy/foreach_target.h>

#include "shaders_cpp/shading-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::tilecore::HWY_NAMESPACE {

#include "tilecore/shading/shade_draw.inc"

void PlaceDraw(const DrawConstants& draw, const LaneArrays& in, std::size_t count, const std::array<float*, 3>& place) {
  for (std::size_t i = 0; i < count; i += FloatLanes::count()) {
    LaneInputs<FloatLanes> lanes = load_lanes(draw, in, i);
    const Vector3<FloatLanes> at = lane_surface(draw, lanes).position;
    at.x.store(place[0] + i), at.y.store(place[1] + i), at.z.store(place[2] + i);
  }
}

}  // namespace tessera::tilecore::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::tilecore {

HWY_EXPORT(PlaceDraw);

void place_draw(const DrawConstants& draw, const LaneArrays& in, std::size_t count,
                const std::array<float*, 3>& place) {
  HWY_DYNAMIC_DISPATCH(PlaceDraw)(draw, in, count, place);
}

}  // namespace tessera::tilecore
#endif

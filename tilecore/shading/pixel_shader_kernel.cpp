#include <algorithm>

#include "tilecore/shading/pixel_shader_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tilecore/shading/pixel_shader_kernel.cpp"
#include <hwy/foreach_target.h>

#include "shaders_cpp/shading-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::tilecore::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
namespace stage = shaders::HWY_NAMESPACE;
using tessera::HWY_NAMESPACE::FloatLanes;
using tessera::HWY_NAMESPACE::IntLanes;
using tessera::HWY_NAMESPACE::Vector3;

#include "tilecore/shading/lane_shader.inc"

// All of it in one function: calls with arguments of vectors cost a fifth of its time. Draws with layers have one of
// their own, so that others do not share their registers.
template <bool kLayered>
__attribute__((flatten, noinline)) void ShadeDrawOf(const DrawConstants& draw, const LaneArrays& in, std::size_t count,
                                                    const LookupArrays& lookups, const ShadedArrays& out) {
  for (std::size_t i = 0; i < count; i += FloatLanes::count()) {
    LaneInputs<FloatLanes> lanes;
    for (std::size_t k = 0; k < 3; ++k) lanes.vertex[k] = IntLanes::load(in.vertex[k] + i);
    lanes.triangle = IntLanes::load(in.triangle + i);
    lanes.one_patch = draw.grid && all(lanes.vertex[0] == IntLanes(first_lane(lanes.vertex[0])));
    lanes.p = FloatLanes::load(in.p + i), lanes.q = FloatLanes::load(in.q + i);
    lanes.t = FloatLanes::load(in.t + i), lanes.light_t = FloatLanes::load(in.light_t + i);
    lanes.lod = FloatLanes::load(in.lod + i);
    lanes.step_x = FloatLanes::load(in.step_x + i), lanes.step_y = FloatLanes::load(in.step_y + i);
    const LaneShaded<FloatLanes> shaded = shade_lanes<kLayered>(draw, lanes, lookups, i);
    shaded.color.x.store(out.color[0] + i), shaded.color.y.store(out.color[1] + i),
        shaded.color.z.store(out.color[2] + i);
    shaded.normal.x.store(out.normal[0] + i), shaded.normal.y.store(out.normal[1] + i),
        shaded.normal.z.store(out.normal[2] + i);
    shaded.alpha.store(out.alpha + i);
  }
}

void ShadeDraw(const DrawConstants& draw, const LaneArrays& in, std::size_t count, const LookupArrays& lookups,
               const ShadedArrays& out) {
  if (draw.layered)
    ShadeDrawOf<true>(draw, in, count, lookups, out);
  else
    ShadeDrawOf<false>(draw, in, count, lookups, out);
}

std::size_t DistinctNeighbours(const std::int32_t* lines, std::size_t count, std::int32_t* out) {
  if (count == 0) return 0;
  std::size_t kept = 0;
  if (lines[0] >= 0) out[kept++] = lines[0];
  const IntLanes::D d;
  const std::size_t lanes = hn::Lanes(d);
  std::size_t i = 1;
  // The last vector ends with the last line; what it shares with the one before is not looked at again.
  for (; i < count && lanes < count; i += lanes) {
    const std::size_t first = std::min(i, count - lanes);
    const auto line = hn::LoadU(d, lines + first), before = hn::LoadU(d, lines + first - 1);
    const auto fresh = hn::Not(hn::FirstN(d, i - first));
    const auto wanted = hn::And(fresh, hn::And(hn::Not(hn::Lt(line, hn::Zero(d))), hn::Ne(line, before)));
    kept += hn::CompressStore(line, wanted, d, out + kept);
  }
  for (; i < count; ++i)
    if (lines[i] >= 0 && lines[i] != lines[i - 1]) out[kept++] = lines[i];
  return kept;
}

}  // namespace tessera::tilecore::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::tilecore {

HWY_EXPORT(ShadeDraw);
HWY_EXPORT(DistinctNeighbours);

void shade_draw(const DrawConstants& draw, const LaneArrays& in, std::size_t count, const LookupArrays& lookups,
                const ShadedArrays& out) {
  HWY_DYNAMIC_DISPATCH(ShadeDraw)(draw, in, count, lookups, out);
}

std::size_t distinct_neighbours(const std::int32_t* lines, std::size_t count, std::int32_t* out) {
  return HWY_DYNAMIC_DISPATCH(DistinctNeighbours)(lines, count, out);
}

}  // namespace tessera::tilecore
#endif

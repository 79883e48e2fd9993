#include <algorithm>

#include "tilecore/shading/pixel_shader_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tilecore/shading/pixel_shader_kernel.cpp"
#include <hwy/foreach_target.h>

#include "shaders_cpp/shading-inl.h"

HWY_BEFORE_NAMESPACE();
namespace tessera::tilecore::HWY_NAMESPACE {

#include "tilecore/shading/shade_draw.inc"

void ShadePlainDraw(const DrawConstants& draw, const LaneArrays& in, std::size_t count, const LookupArrays& lookups,
                    const ShadedArrays& out) {
  ShadeDrawOf<false>(draw, in, count, lookups, out);
}

std::size_t DistinctNeighbours(const std::int32_t* lines, std::size_t count, std::int32_t* out) {
  if (count == 0) return 0;
  std::size_t kept = 0;
  if (lines[0] >= 0) out[kept++] = lines[0];
  const IntLanes::D d;
  const std::size_t lanes = hn::Lanes(d);
  std::size_t i = 1;
  // The last vector ends with the last line; lanes that it shares with the previous one are masked off.
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

HWY_EXPORT(ShadePlainDraw);
HWY_EXPORT(DistinctNeighbours);

void shade_draw(const DrawConstants& draw, const LaneArrays& in, std::size_t count, const LookupArrays& lookups,
                const ShadedArrays& out) {
  if (draw.layered)
    shade_layered_draw(draw, in, count, lookups, out);
  else
    HWY_DYNAMIC_DISPATCH(ShadePlainDraw)(draw, in, count, lookups, out);
}

std::size_t distinct_neighbours(const std::int32_t* lines, std::size_t count, std::int32_t* out) {
  return HWY_DYNAMIC_DISPATCH(DistinctNeighbours)(lines, count, out);
}

}  // namespace tessera::tilecore
#endif

#include "tilecore/shading/pixel_shader_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tilecore/shading/layered_shader_kernel.cpp"
#include <hwy/foreach_target.h>

#include "shaders_cpp/shading-inl.h"

// Lookups of textures and surroundings are calls: there are some twenty of them, and inlined they take four times as long to
// compile and save a twentieth of the time.
#ifndef TESSERA_STAGE_CALL
#define TESSERA_STAGE_CALL __attribute__((noinline))
#endif

HWY_BEFORE_NAMESPACE();
namespace tessera::tilecore::HWY_NAMESPACE {

#include "tilecore/shading/shade_draw.inc"

void ShadeLayeredDraw(const DrawConstants& draw, const LaneArrays& in, std::size_t count, const LookupArrays& lookups,
                      const ShadedArrays& out) {
  ShadeDrawOf<true>(draw, in, count, lookups, out);
}

}  // namespace tessera::tilecore::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace tessera::tilecore {

HWY_EXPORT(ShadeLayeredDraw);

void shade_layered_draw(const DrawConstants& draw, const LaneArrays& in, std::size_t count, const LookupArrays& lookups,
                        const ShadedArrays& out) {
  HWY_DYNAMIC_DISPATCH(ShadeLayeredDraw)(draw, in, count, lookups, out);
}

}  // namespace tessera::tilecore
#endif
